//! Why the program ends without success, and its exit code.
use agimp::job::JobError;
use agimp::setup::particles::seed::SeedError;

/// Why the program ends without success.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The job file is wrong.
    #[error(transparent)]
    Job(#[from] JobError),
    /// The bodies of a job cannot be filled.
    #[error(transparent)]
    Seed(#[from] SeedError),
    /// The command line is wrong, or asks for help.
    #[error(transparent)]
    Arguments(#[from] clap::Error),
    /// The command cannot be carried out as given.
    #[error("{0}")]
    Usage(String),
    /// A failure while the command ran.
    #[error("{0}")]
    Run(String),
    /// The run has stopped on request and written a checkpoint.
    #[error("stopped on request; continue with --restart {}", .0.display())]
    Stopped(std::path::PathBuf),
    /// The run has stopped on request before its first step.
    #[error("{}", agimp::run::RunError::Stopped)]
    StoppedBefore,
    /// The sweep and its run have stopped on request.
    #[error("stopped on request; the same command continues")]
    SweepStopped,
    /// The user has all messages; the program ends with this exit code.
    #[error("a failure that has been reported")]
    Reported(u8),
}

/// Exit code for input that cannot be used.
const BAD_INPUT: u8 = 2;

impl Failure {
    /// 2 for wrong input, 1 for later failures, 3 after a stop on request.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Job(_) | Self::Seed(_) | Self::Usage(_) => BAD_INPUT,
            Self::Run(_) => 1,
            Self::Arguments(error) => error.exit_code() as u8,
            Self::Reported(code) => *code,
            Self::Stopped(_) | Self::StoppedBefore | Self::SweepStopped => agimp::run::stop::STOPPED,
        }
    }
}

/// Of writing to standard output.
impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            // The reader has closed the pipe, as in `agimp schema | head`.
            std::io::ErrorKind::BrokenPipe => Self::Reported(0),
            _ => Self::Run(format!("cannot write: {error}")),
        }
    }
}
