//! Cost of the current partition.
use crate::solver::state::phases::thread_time;
use std::time::Duration;

/// Cost of the current partition, in seconds of processor time.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct LastPartition {
    /// Of making it; at first of building the grid.
    pub(in crate::solver) price: f64,
    /// Lost to its imbalance so far.
    pub(in crate::solver) lost: f64,
    /// Processor time at the last check of the imbalance.
    pub(in crate::solver) looked: Duration,
    /// Whether it was made before costs were measured.
    pub(in crate::solver) is_guess: bool,
}

impl LastPartition {
    /// The partition with which a run starts or goes on, made since `start`.
    pub(crate) fn at_start(start: Duration) -> Self {
        Self { is_guess: true, ..Self::since(start) }
    }

    /// One made since `start`.
    pub(crate) fn since(start: Duration) -> Self {
        let now = thread_time();
        Self { price: (now - start).as_secs_f64(), lost: 0.0, looked: now, is_guess: false }
    }
}
