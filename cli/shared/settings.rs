//! Values of a job that the command line sets.
use crate::Failure;
use agimp::job::Settings;

/// Options of subcommands that read a job.
#[derive(Debug, clap::Args)]
pub struct Changes {
    /// Set a value of the job, such as `time.cfl=0.3`, `materials.sand.density=1500` or
    /// `bodies.0.velocity=[1, 0]`; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Directory of the results: sets `output.directory`.
    #[arg(long, value_name = "DIR")]
    out: Option<String>,
    /// End of the run, s: sets `time.end`.
    #[arg(long, value_name = "TIME", allow_negative_numbers = true)]
    end: Option<String>,
}

impl Changes {
    /// The settings, in a fixed order: those by key first.
    ///
    /// # Errors
    /// One is not of the form `KEY=VALUE`.
    pub fn settings(&self) -> Result<Settings, Failure> {
        let mut settings = Settings::default();
        for text in &self.set {
            settings.set(text).map_err(Failure::Usage)?;
        }
        if let Some(directory) = &self.out {
            settings.set_directory(directory);
        }
        if let Some(end) = &self.end {
            settings.set_end(end);
        }
        Ok(settings)
    }
}
