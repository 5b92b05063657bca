//! `JOB.report.json`: the report of a finished run, for scripts.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::safety::Safety;
use crate::io::hdf5_file::FileError;
use crate::io::whole_file::write_whole;

/// Report of a finished run. Quantities are in SI units.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Report {
    /// Program and version.
    pub program: String,
    /// Name of the job.
    pub job: String,
    /// Checksum of the keys that decide the state, in hexadecimal digits.
    pub digest: String,
    /// End of the run that the job asks for, s.
    pub end: f64,
    /// Title of the job.
    pub title: String,
    /// Steps done.
    pub steps: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Ranks of the last part of the run.
    pub ranks: usize,
    /// Threads of each rank.
    pub threads: usize,
    /// Wall time of the last part of the run, s.
    pub wall_seconds: f64,
    /// Stages that have begun, with the times at which they did, s; empty in a job without stages.
    pub stages: Vec<(String, f64)>,
    /// Particles at the end.
    pub particles: u64,
    /// Last row of the history: value and unit by name of the column; no value where it is not a number.
    pub history: BTreeMap<String, (Option<f64>, String)>,
    /// The factor of safety, if a stage looks for it.
    pub factor_of_safety: Option<Safety>,
    /// Messages during the run.
    pub messages: Vec<String>,
    /// Warnings during the run.
    pub warnings: Vec<String>,
    /// Index of the outputs.
    pub outputs: PathBuf,
    /// Picture of the last state.
    pub picture: Option<PathBuf>,
}

/// The digest of a job as reports have it.
pub fn digest(digest: u64) -> String {
    format!("{digest:016x}")
}

/// Path of the report of a job of this name, in the directory of its results.
pub fn path(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.report.json"))
}

impl Report {
    /// Not collective. Writes it, under a temporary name first.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        let save = || {
            let mut text = serde_json::to_string_pretty(self).map_err(std::io::Error::other)?;
            text.push('\n');
            write_whole(path, text.as_bytes())
        };
        save().map_err(|source| FileError::System { path: path.into(), action: "write the report", source })
    }
}
