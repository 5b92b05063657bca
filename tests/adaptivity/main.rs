//! Dynamic refinement, through the program and the library: same bits however a run is carried out, conservation
//! through many changes of the tree, bodies that stay whole and free of stress, and criteria that refine where they
//! should.
#[path = "../mpi_runs/launch.rs"]
#[allow(dead_code, reason = "shared with another test")]
mod launch;
#[path = "../common/mpirun.rs"]
mod mpirun;
#[path = "../common/relaunch.rs"]
mod relaunch;

mod criteria;
mod crossing;
mod same_bits;
mod state;
mod sweeps;

/// Runs share few cores, so they take turns.
fn in_turn() -> std::sync::MutexGuard<'static, ()> {
    static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());
    // A failed test must not fail the others.
    TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
