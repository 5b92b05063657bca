//! Code that all test crates share.
//!
//! | module | content |
//! |---|---|
//! | [`mpirun`] | the one place where ranks start |
//! | [`scenarios`], [`relaunch`] | this binary again, under `mpirun` |
//! | [`launch`] | the program, as a user starts it |
//! | [`runs`], [`history`], [`restart`] | results of whole runs; equality across ranks and restarts |
//! | [`load_steps`] | jobs by load steps |
//! | [`program`] | subcommands, a browser, a body for a job |
//! | [`papers`] | fenced blocks of the documentation |
//! | [`boxes`], [`exact`], [`tree`] | boxes, exact weights and trees |
//! | [`random`], [`damage`], [`spinning`] | random numbers, damaged files, rotating bodies |
#![allow(dead_code, reason = "each test crate uses its part")]
pub(crate) mod boxes;
pub(crate) mod damage;
pub(crate) mod exact;
pub(crate) mod history;
pub(crate) mod launch;
pub(crate) mod load_steps;
pub(crate) mod mpirun;
pub(crate) mod papers;
pub(crate) mod program;
pub(crate) mod random;
pub(crate) mod relaunch;
pub(crate) mod restart;
pub(crate) mod runs;
pub(crate) mod scenarios;
pub(crate) mod spinning;
pub(crate) mod tree;

/// Does something with each item, three at a time: for programs that wait more than they compute.
pub(crate) fn three_at_a_time<T: Send>(
    items: impl IntoIterator<Item = T, IntoIter: Send>,
    does: impl Fn(T) + Sync,
) {
    let items = std::sync::Mutex::new(items.into_iter());
    let next = || items.lock().expect("no iterator panics").next();
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                while let Some(item) = next() {
                    does(item)
                }
            });
        }
    });
}

/// Runs share few cores and some tests measure time, so they take turns.
pub(crate) fn in_turn() -> std::sync::MutexGuard<'static, ()> {
    static TURN: std::sync::Mutex<()> = std::sync::Mutex::new(());
    // A failed test must not fail the others.
    TURN.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
