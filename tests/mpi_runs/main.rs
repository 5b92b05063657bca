//! The whole program under `mpirun`: same bits on any ranks and threads, restarts, signals, and the end of all
//! ranks when one fails.
mod differing_ranks;
mod directory;
mod faults;
mod launch;
mod mending;
#[path = "../common/mpirun.rs"]
mod mpirun;
mod ranks;
mod restart;
mod same_bits;
mod signals;

/// Runs share few cores and some tests measure time, so they take turns.
fn in_turn() -> std::sync::MutexGuard<'static, ()> {
    static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());
    // A failed test must not fail the others.
    TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
