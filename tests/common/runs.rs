//! What tests of whole runs share: how a run is started, and what it leaves.
#![allow(dead_code, reason = "each test uses its part")]
#[path = "history.rs"]
pub(crate) mod history;
#[path = "../mpi_runs/launch.rs"]
pub(crate) mod launch;
#[path = "mpirun.rs"]
pub(crate) mod mpirun;
#[path = "restart.rs"]
pub(crate) mod restart;

use std::path::Path;

use launch::Outcome;

/// Runs a job on one rank in a directory, as `block.toml`, over what an earlier run has left. Returns what it leaves.
pub(crate) fn outcome(directory: &Path, job: &str) -> Outcome {
    let path = directory.join("block.toml");
    std::fs::write(&path, job).expect("job");
    launch::succeed(&mut launch::run(directory, 1, 1, &path, &["--overwrite"]));
    Outcome::read(directory, "block")
}
