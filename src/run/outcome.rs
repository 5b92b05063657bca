//! How a run is started, how it ends, and why it cannot.
use std::path::{Path, PathBuf};

use partition::comm::Disagreement;

use crate::io::hdf5_file::FileError;
use crate::solver::Clock;

/// How a run is started.
#[derive(Clone, Debug)]
pub struct Options {
    /// File to go on from; a new run without it.
    pub restart: Option<From>,
    /// Whether a new run may replace the results of another job, or checkpoints.
    pub overwrite: bool,
    /// Whether this process prints the progress of the run.
    pub speaks: bool,
    /// Threads of this rank.
    pub threads: usize,
    /// Warnings before the run, for its report.
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

/// Effort of a run: steps, time and particles.
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

/// Results of a finished run.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Its effort.
    pub effort: Effort,
    /// The last output, for pictures.
    pub last_output: Option<PathBuf>,
    /// Index of the output files, for ParaView.
    pub series: PathBuf,
    /// Picture of the last state, or why there is none; `Ok(None)` if the job wants none.
    pub picture: Result<Option<PathBuf>, String>,
    /// Whether all is at rest in outputs, as between load steps.
    pub is_still: bool,
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
        /// The failure.
        source: Box<RunError>,
    },
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The request cannot be fulfilled, and nothing has been written.
    #[error("{0}")]
    Refused(String),
    /// It was asked to stop before its first step.
    #[error("stopped on request before the first step, and nothing is written; the same command starts it")]
    Stopped,
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

/// The file from which a run continues.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum From {
    /// The newest complete file of the run.
    Latest,
    /// This file.
    File(PathBuf),
}

impl From {
    /// Not collective. Whether the file lies in this directory, that of the results of the run.
    pub fn is_in(&self, directory: &Path) -> bool {
        let Self::File(path) = self else { return true };
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let [own, other] = [parent.unwrap_or(Path::new(".")), directory].map(Path::canonicalize);
        own.is_ok_and(|own| other.is_ok_and(|other| own == other))
    }
}
