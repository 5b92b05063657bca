//! `agimp check`: the size and cost of a job, without running it.
use super::Failure;
use super::run::start_threads;
use super::shared::message::{launched, together, warn_of};
use super::shared::settings::Changes;
use super::shared::{ranks, summary};
use agimp::job::{self, AnyProblem};
use agimp::memory::Limits;
use agimp::setup::estimate::Estimate;
use agimp::setup::known::{Unknown, known};
use agimp::text::bytes;
use partition::comm::{Comm, World};
use std::ffi::OsStr;
use std::path::PathBuf;

/// Arguments of `agimp check`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Job file.
    job: PathBuf,
    /// Ranks that share the memory.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    ranks: u32,
    /// Values that replace those of the job.
    #[command(flatten)]
    changes: Changes,
}

/// Reads the job and prints its size and cost.
///
/// # Errors
/// The job is wrong.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let settings = arguments.changes.settings()?;
    let mut world = launched()?;
    let problem = match &world {
        Some(world) => {
            let mut words = vec![OsStr::new("check"), arguments.job.as_os_str()];
            words.extend(settings.words());
            ranks::same_command(world.comm(), &words)?;
            ranks::load(world.comm(), &arguments.job, &settings)?
        }
        None => job::load_with(&arguments.job, &settings)?,
    };
    let report = report(arguments, &problem, &mut world);
    once(world.as_ref(), report)
}

/// The result on which all ranks agree, if there are several; the own one otherwise.
fn once<T>(world: Option<&World>, result: Result<T, Failure>) -> Result<T, Failure> {
    match world {
        Some(world) => together(world.comm(), result),
        None => result,
    }
}

fn report(arguments: &Arguments, problem: &AnyProblem, world: &mut Option<World>) -> Result<(), Failure> {
    let start = |comm: &Comm| start_threads(comm, None).map(drop).map_err(|failure| failure.to_string());
    let known = known(problem, world, &start).map_err(|error| match error {
        Unknown::Seed(error) => Failure::Seed(error),
        Unknown::Machine(reason) => Failure::Run(reason),
        other => Failure::Usage(other.to_string()),
    })?;
    if world.as_ref().is_none_or(|world| world.comm().rank() == 0) {
        let out = &mut std::io::stdout().lock();
        match problem {
            AnyProblem::Two(problem) => summary::write(out, arguments.ranks, problem, &known)?,
            AnyProblem::Three(problem) => summary::write(out, arguments.ranks, problem, &known)?,
        }
        let mut all = known.warnings;
        all.extend(lack_of_memory(&known.estimate, arguments.ranks));
        warn_of(&all);
    }
    Ok(())
}

/// Memory of this machine that the job exceeds: with one rank, or with each of some that may be on machines
/// of their own.
fn lack_of_memory(estimate: &Estimate, ranks: u32) -> Option<String> {
    let (needed, has) = (estimate.memory_per_rank(ranks), Limits::of_machine().per_rank(1));
    let each = if ranks == 1 { String::new() } else { format!(" on each of {ranks} ranks") };
    (needed > has).then(|| {
        format!(
            "tree: the job takes about {} of memory{each}, and this machine has {}; a run here is refused: use coarser cells, lower levels, or more machines",
            bytes(needed),
            bytes(has)
        )
    })
}
