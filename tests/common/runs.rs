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
