//! `agimp run`: runs a job, alone or on the ranks of `mpirun`.
use std::io::Write;
use std::path::{Path, PathBuf};

use partition::comm::{Comm, World};

use super::{BAD_INPUT, Failure};
use crate::job::problem::AnyProblem;
use crate::run::stop::StopRequest;
use crate::run::{self, Options, Outcome, RunError, Summary, restart};

/// Arguments of `agimp run`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Job file (TOML).
    pub job: PathBuf,
    /// Go on from a file of this job, or from its newest complete one (`latest`).
    #[arg(long, value_name = "FILE|latest")]
    pub restart: Option<String>,
    /// Threads of each rank; by default the cores of the machine shared out to its ranks.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

/// Carries out `agimp run`.
///
/// # Errors
/// The job is wrong, or the run failed; the same on all ranks.
pub fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let stop = StopRequest::listen()?;
    let world = World::init().map_err(|error| Failure::Run(error.to_string()))?;
    let comm = world.comm();
    let problem = load(comm, &arguments.job)?;
    let threads = start_threads(comm, arguments.threads)?;
    let options = Options {
        restart: arguments.restart.as_deref().map(|from| match from {
            "latest" => restart::From::Latest,
            path => restart::From::File(path.into()),
        }),
        speaks: comm.rank() == 0 && !arguments.quiet,
        threads,
    };
    let outcome = match &problem {
        AnyProblem::Two(problem) => run::run(comm, problem, &options, &stop),
        AnyProblem::Three(problem) => run::run(comm, problem, &options, &stop),
    };
    let failure = match outcome {
        Ok(Outcome::Finished(summary)) => {
            if options.speaks {
                print(&mut std::io::stdout().lock(), &summary)?;
            }
            return Ok(());
        }
        Ok(Outcome::Stopped { checkpoint }) => Failure::Stopped(checkpoint),
        Err(error @ RunError::Seed(_)) => Failure::Usage(error.to_string()),
        Err(error) => Failure::Run(error.to_string()),
    };
    // All ranks have the same; one message is enough.
    Err(if comm.rank() == 0 { failure } else { Failure::Elsewhere(failure.exit_code()) })
}

/// Collective. Every rank reads the job. If that fails on any of them, the lowest of these tells why.
fn load(comm: &Comm, path: &Path) -> Result<AnyProblem, Failure> {
    let loaded = crate::job::load(path);
    let ranks = comm.size() as u64;
    let mut lowest = [if loaded.is_err() { comm.rank() as u64 } else { ranks }];
    comm.min_u64(&mut lowest);
    match loaded {
        Ok(problem) if lowest[0] == ranks => Ok(problem),
        Err(error) if lowest[0] == comm.rank() as u64 => Err(error.into()),
        _ => Err(Failure::Elsewhere(BAD_INPUT)),
    }
}

/// What the user wants to know when the run is over.
fn print(out: &mut impl Write, summary: &Summary) -> std::io::Result<()> {
    writeln!(out, "outputs  {} (open in ParaView)", summary.series.display())?;
    match &summary.picture {
        Ok(Some(path)) => writeln!(out, "picture  {}", path.display())?,
        Ok(None) => {}
        Err(reason) => writeln!(out, "no picture: {reason}")?,
    }
    if let Some(collapse) = &summary.collapse {
        writeln!(out, "{collapse}")?;
    }
    Ok(())
}

/// Collective. Starts the threads of this rank and warns when they do not fit the machine.
pub(super) fn start_threads(comm: &Comm, wanted: Option<u16>) -> Result<usize, Failure> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = wanted.map_or_else(|| (cores / comm.size()).max(1), usize::from);
    // The main thread works too; handing each small loop to another thread would cost more than the loop.
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .use_current_thread()
        .build_global()
        .map_err(|error| Failure::Run(format!("cannot start {threads} threads: {error}")))?;
    Ok(threads)
}
