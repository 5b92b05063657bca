//! `agimp run`: runs a job, alone or on the ranks of `mpirun`.
use std::path::PathBuf;

use partition::comm::{Comm, World};

use super::Failure;
use crate::job::problem::{AnyProblem, Problem};
use crate::run::stop::StopRequest;
use crate::run::{self, Options, Outcome, RunError, restart};

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
    let loaded = crate::job::load(&arguments.job);
    // Every rank reads the same file; should one fail alone, rank 0 cannot tell the place in the file.
    let failed = comm.any(loaded.is_err());
    let problem = match loaded {
        Ok(problem) if !failed => problem,
        Err(error) if comm.rank() == 0 => return Err(error.into()),
        _ => return Err(Failure::Elsewhere),
    };
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
        AnyProblem::Two(problem) => start(comm, problem, &options, &stop),
        AnyProblem::Three(problem) => start(comm, problem, &options, &stop),
    };
    match outcome {
        Ok(Outcome::Finished) => Ok(()),
        Ok(Outcome::Stopped { checkpoint }) => Err(Failure::Stopped(checkpoint)),
        // All ranks have the same error; one message is enough.
        Err(_) if comm.rank() != 0 => Err(Failure::Elsewhere),
        Err(error @ RunError::Seed(_)) => Err(Failure::Usage(error.to_string())),
        Err(error) => Err(Failure::Run(error.to_string())),
    }
}

fn start<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    options: &Options,
    stop: &StopRequest,
) -> Result<Outcome, RunError> {
    run::run(comm, problem, options, stop)
}

/// Collective. Starts the threads of this rank and warns when they do not fit the machine.
fn start_threads(comm: &Comm, wanted: Option<u16>) -> Result<usize, Failure> {
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
