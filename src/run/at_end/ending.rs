//! `JOB.ended.json`: why a run has ended ahead of its time, and what to do.
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::io::whole_file::write_whole;
use crate::run::RunError;

/// Why a run has ended ahead of its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ending {
    /// The message to the user.
    pub reason: String,
    /// Advice.
    pub advice: String,
    /// Whether it stopped on request.
    pub is_stop: bool,
    /// Steps done.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
}

/// Advice for a run that has become unstable.
const UNSTABLE: &str = "Check the last output where the speed is greatest (agimp plot --colour speed, agimp view). If the material is stretched or compressed beyond the range of its law, change the job there: a stiffer or plastic material, a slower load, finer cells. Otherwise try a smaller Courant number (time.cfl, for example half of it), or damping.";
/// Advice where a file cannot be written.
const FILE: &str =
    "Free space on the disk, or give this user permission to write there; then continue from the last state.";
/// Advice where material has left the domain.
const LEFT: &str = "Check the last output where material has reached that face. If it is expected there, open the face (kind outflow) or set boundaries.leaving; otherwise use a larger domain, or find out why the material moves so far.";
/// Advice in all other cases.
const OTHER: &str = "Correct what the message names; then continue from the last state, or start again if the job must change.";

impl Ending {
    /// Asked to stop by a signal.
    pub(in crate::run) fn stopped(step: u64, time: f64) -> Self {
        let reason = "stopped on request (signal), after a checkpoint".into();
        Self { reason, advice: "Continue from the last state.".into(), is_stop: true, step, time }
    }

    /// By an error.
    pub(in crate::run) fn failed(error: &RunError, step: u64, time: f64) -> Self {
        let reason = error.to_string();
        let is_unstable =
            ["unstable", "not finite", "NaN", "reaches beyond"].iter().any(|word| reason.contains(word));
        let is_file = ["cannot write", "cannot create", "cannot rename", "no space"]
            .iter()
            .any(|word| reason.contains(word));
        let advice = match () {
            () if reason.contains("left the domain") => LEFT,
            () if is_unstable => UNSTABLE,
            () if is_file => FILE,
            () => OTHER,
        };
        Self { reason, advice: advice.into(), is_stop: false, step, time }
    }

    /// Not collective. Writes it, under a temporary name first.
    pub(in crate::run) fn write(&self, path: &Path) -> std::io::Result<()> {
        let mut text = serde_json::to_string_pretty(self).map_err(std::io::Error::other)?;
        text.push('\n');
        write_whole(path, text.as_bytes())
    }

    /// Not collective. The record that a run has left, if it has ended ahead of its time.
    pub fn read(directory: &Path, name: &str) -> Option<Self> {
        serde_json::from_slice(&std::fs::read(path(directory, name)).ok()?).ok()
    }
}

/// Path of the record of a job of this name, in the directory of its results.
pub fn path(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.ended.json"))
}
