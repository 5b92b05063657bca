//! `agimp run`: runs a job, alone or on the ranks of `mpirun`.
use std::ffi::{OsStr, OsString};
use std::io::Write;
use std::path::{Path, PathBuf};

use partition::comm::{Comm, World, is_launched};

use super::Failure;
#[cfg(not(feature = "post"))]
use super::no_results as ended;
#[cfg(feature = "post")]
use super::results::ended;
use super::shared::message::{together, warn_of};
use super::shared::ranks;
use super::shared::settings::Changes;
use agimp::io::cause::tell_size_limits;
use agimp::job::Settings;
use agimp::job::problem::AnyProblem;
use agimp::run::cores::Cores;
use agimp::run::stop::StopRequest;
use agimp::run::{self, Effort, Options, Outcome, RunError, Summary};
use agimp::setup::warnings::first_warnings;
use agimp::text::{count, counted, quantity, wall_time};

/// Arguments of `agimp run`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Job file (TOML).
    pub job: PathBuf,
    /// Continue from a file of this job, or from its newest complete one (`latest`).
    #[arg(long, value_name = "FILE|latest")]
    pub restart: Option<OsString>,
    /// Start again even if that replaces checkpoints or the results of another job.
    #[arg(long, conflicts_with = "restart")]
    pub overwrite: bool,
    /// Threads of each rank; by default RAYON_NUM_THREADS, or the cores of its machine divided by the ranks
    /// there.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Print only errors and warnings.
    #[arg(long)]
    pub quiet: bool,
    /// Values that replace those of the job.
    #[command(flatten)]
    pub changes: Changes,
}

impl Arguments {
    /// The words that decide the results of a run. Threads and messages may differ between ranks.
    fn words<'a>(&'a self, settings: &'a Settings) -> Vec<&'a OsStr> {
        let mut words = vec![OsStr::new("run"), self.job.as_os_str()];
        words.extend(settings.words());
        if let Some(from) = &self.restart {
            words.extend([OsStr::new("--restart"), from]);
        }
        if self.overwrite {
            words.push(OsStr::new("--overwrite"));
        }
        words
    }
}

/// Carries out `agimp run`.
///
/// # Errors
/// The job is wrong, or the run failed; the same on all ranks.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let stop = StopRequest::listen()?;
    let settings = arguments.changes.settings()?;
    let world = World::init().map_err(|error| Failure::Run(error.to_string()))?;
    let comm = world.comm();
    if is_launched() {
        tell_size_limits()?;
    }
    ranks::same_command(comm, &arguments.words(&settings))?;
    let problem = ranks::load(comm, &arguments.job, &settings)?;
    let threads = together(comm, start_threads(comm, arguments.threads))?;
    let warned = warned(comm, &problem, arguments.restart.is_none());
    let options = Options {
        restart: arguments.restart.as_deref().map(|from| match from.to_str() {
            Some("latest") => run::From::Latest,
            _ => run::From::File(from.into()),
        }),
        overwrite: arguments.overwrite,
        speaks: comm.rank() == 0 && !arguments.quiet,
        threads,
        warnings: together(comm, warned)?,
    };
    let outcome = run::run(comm, &problem, &options, &stop, ended::PICTURES);
    let has_begun = !matches!(&outcome, Err(RunError::Seed(_) | RunError::Refused(_) | RunError::Stopped));
    let wants_page = problem.output().report && has_begun && comm.rank() == 0;
    let results = Results { directory: &problem.output().directory, name: problem.name() };
    let page = if wants_page { ended::page(results.directory, results.name, &arguments.job) } else { None };
    together(comm, conclude(outcome, page, options.speaks.then_some(results)))
}

/// Where a run has written.
#[derive(Clone, Copy)]
struct Results<'a> {
    directory: &'a Path,
    name: &'a str,
}

/// Collective. Warns of likely mistakes in the job, once, when a run starts anew. Returns the warnings.
fn warned(comm: &Comm, problem: &AnyProblem, is_new: bool) -> Result<Vec<String>, Failure> {
    let found = first_warnings(problem, comm.rank() == 0 && is_new);
    let found = found.map_err(|error| Failure::Usage(error.to_string()))?;
    warn_of(&found);
    Ok(found)
}

/// Reports how a finished run ended; anything else is a failure.
fn conclude(
    outcome: Result<Outcome, RunError>,
    page: Option<Result<PathBuf, String>>,
    speaks_of: Option<Results<'_>>,
) -> Result<(), Failure> {
    if let (Some(Ok(page)), Some(_), false) = (&page, speaks_of, matches!(outcome, Ok(Outcome::Finished(_))))
    {
        // In one piece; a closed pipe is no error.
        let line = format!("report   {} (open in a browser)\n", page.display());
        let _ = std::io::stderr().write_all(line.as_bytes());
    }
    match outcome {
        Ok(Outcome::Finished(summary)) => {
            if let Some(results) = speaks_of {
                // The run is complete and its results are on disk, whether or not its output is read.
                let _ = print(&mut std::io::stdout().lock(), &summary, page.as_ref(), results);
            }
            Ok(())
        }
        Ok(Outcome::Stopped { checkpoint }) => Err(Failure::Stopped(checkpoint)),
        Err(RunError::Stopped) => Err(Failure::StoppedBefore),
        Err(error @ (RunError::Seed(_) | RunError::Refused(_))) => Err(Failure::Usage(error.to_string())),
        Err(error) => Err(Failure::Run(error.to_string())),
    }
}

/// Summary after a run: where the results are, its effort, and the commands that show more.
fn print(
    out: &mut impl Write,
    summary: &Summary,
    page: Option<&Result<PathBuf, String>>,
    results: Results<'_>,
) -> std::io::Result<()> {
    writeln!(out, "outputs  {} (open in ParaView)", summary.series.display())?;
    match &summary.picture {
        Ok(Some(path)) => writeln!(out, "picture  {}", path.display())?,
        Ok(None) => {}
        Err(reason) => writeln!(out, "no picture: {reason}")?,
    }
    match page {
        Some(Ok(path)) => writeln!(out, "report   {} (open in a browser)", path.display())?,
        Some(Err(reason)) => writeln!(out, "no report: {reason}")?,
        None => {}
    }
    writeln!(out, "history  {}", results.directory.join(format!("{}.history.csv", results.name)).display())?;
    let Effort { steps, time, wall_seconds, particles, warnings } = summary.effort;
    write!(
        out,
        "took     {} to {} in {}, {} particles",
        counted(steps, "step"),
        quantity(time, "s"),
        wall_time(wall_seconds),
        count(particles)
    )?;
    match warnings {
        0 => writeln!(out)?,
        1 => writeln!(out, ", 1 warning")?,
        more => writeln!(out, ", {more} warnings")?,
    }
    ended::hints(out, summary, results.directory, results.name, matches!(page, Some(Ok(_))))
}

/// Collective. Starts the threads of this rank: as many as wanted, else as the variable of rayon says, else
/// its share of the cores.
pub(super) fn start_threads(comm: &Comm, wanted: Option<u16>) -> Result<usize, Failure> {
    let cores = Cores::survey(comm);
    let said = || std::env::var("RAYON_NUM_THREADS").ok()?.parse().ok().filter(|threads| *threads > 0);
    let threads = wanted.map(usize::from).or_else(said).unwrap_or_else(|| cores.threads());
    // The main thread works too; handing each small loop to another thread would cost more than the loop.
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .use_current_thread()
        .build_global()
        .map_err(|error| Failure::Run(format!("cannot start {threads} threads: {error}")))?;
    Ok(threads)
}
