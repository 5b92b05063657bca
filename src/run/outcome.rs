//! How a run is started, how it ends, and why it cannot.
use std::path::PathBuf;

use partition::comm::Disagreement;

use crate::io::hdf5_file::FileError;
use crate::run::at_end::collapse::Collapse;
use crate::run::restart::From;
use crate::solver::Clock;

/// How a run is started.
#[derive(Clone, Debug)]
pub struct Options {
    /// File to go on from; a new run without it.
    pub restart: Option<From>,
    /// Whether a new run may replace the results of another job, or checkpoints.
    pub overwrite: bool,
    /// Whether this process shows the progress of the run.
    pub speaks: bool,
    /// Threads of this rank.
    pub threads: usize,
    /// What the user has been warned of before the run, for its report.
    pub warnings: Vec<String>,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// At its end time.
    Finished(Box<Summary>),
    /// On request, after writing this checkpoint.
    Stopped {
        /// The checkpoint.
        checkpoint: PathBuf,
    },
}

/// What a run has taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Steps done since the start.
    pub steps: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Wall time of this part of the run, s.
    pub wall_seconds: f64,
    /// Particles at the end; known on rank 0.
    pub particles: u64,
    /// How often the user has been warned; known on rank 0.
    pub warnings: usize,
}

/// What a finished run leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// What it has taken.
    pub effort: Effort,
    /// The last output, to look at.
    pub last_output: Option<PathBuf>,
    /// Index of the output files, for ParaView.
    pub series: PathBuf,
    /// Picture of the last state, or why there is none; `Ok(None)` if the job wants none.
    pub picture: Result<Option<PathBuf>, String>,
    /// Evaluation that the job asks for.
    pub collapse: Option<Collapse>,
}

/// Why a run could not be started or finished; the same on all ranks.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The bodies of the job cannot be filled with particles.
    #[error("{0}")]
    Seed(Disagreement),
    /// Some rank failed.
    #[error(transparent)]
    Rank(#[from] Disagreement),
    /// A step failed.
    #[error("step {step}, time {}: {source}", crate::text::quantity_to(*time, "s", 7))]
    Step {
        /// Number of the step.
        step: u64,
        /// Time at its start, s.
        time: f64,
        /// Rank and reason.
        source: Disagreement,
    },
    /// Something failed after a step, while files were written.
    #[error("step {step}, time {}: {source}", crate::text::quantity_to(*time, "s", 7))]
    After {
        /// Number of steps done.
        step: u64,
        /// Time, s.
        time: f64,
        /// What failed.
        source: Box<RunError>,
    },
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// What the run was asked for cannot be done, and nothing has been written.
    #[error("{0}")]
    Refused(String),
}

impl RunError {
    /// The same with step and time, if it does not name them yet.
    pub(super) fn after(self, clock: Clock) -> Self {
        match self {
            Self::Step { .. } | Self::After { .. } => self,
            other => Self::After { step: clock.step, time: clock.time, source: Box::new(other) },
        }
    }
}
