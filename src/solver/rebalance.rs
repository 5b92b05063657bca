//! Partition of leaves by their cost.
use std::time::Instant;

use super::Solver;
pub use super::cost::{leaf_cost, leaf_weight};
use super::phases::Phase;
use crate::particle::Chunk;

/// Imbalance below which nothing is done.
const LIMIT: f64 = 1.02;
/// A new partition is expected to serve as long as the last one has, within these numbers of steps.
const HORIZON: std::ops::RangeInclusive<u64> = 100..=2000;

/// Greatest cost of a rank over the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imbalance(pub f64);

/// What the decision to partition anew rests on; the same on all ranks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Prospect {
    /// Imbalance now.
    now: f64,
    /// Imbalance with new cuts.
    then: f64,
    /// Seconds of a step now.
    step: f64,
    /// Seconds that the last new partition took.
    price: f64,
    /// Steps since then.
    age: u64,
}

impl Prospect {
    /// Whether the steps to come are expected to save more than a new partition takes.
    fn pays(self) -> bool {
        let saved_per_step = self.step * (1.0 - self.then / self.now);
        saved_per_step * self.age.clamp(*HORIZON.start(), *HORIZON.end()) as f64 > self.price
    }
}

/// Time that this thread has run. What other programs take of the machine does not count, where the system tells.
fn running_time() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<u64>().ok()? as f64 * 1e-9)
}

/// A moment in the run of this thread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    wall: Instant,
    running: Option<f64>,
}

impl Moment {
    pub fn now() -> Self {
        Self { wall: Instant::now(), running: running_time() }
    }

    /// Seconds since then.
    pub fn elapsed(&self) -> f64 {
        match (self.running, running_time()) {
            (Some(then), Some(now)) => now - then,
            _ => self.wall.elapsed().as_secs_f64(),
        }
    }
}

/// When the current partition was made and what that took.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastPartition {
    step: u64,
    /// Seconds; at first those of building the grid.
    price: f64,
    /// Time and step of the last look.
    looked: (Moment, u64),
}

impl LastPartition {
    /// The partition with which a run starts or goes on.
    pub fn at_start(step: u64, price: f64) -> Self {
        Self { step, price, looked: (Moment::now(), step) }
    }
}

impl<const D: usize> Solver<D> {
    /// Collective. Imbalance of the current partition.
    pub fn imbalance(&self) -> Imbalance {
        let own: u64 = self.leaf_costs().iter().sum();
        let (mut total, mut greatest) = ([own], [own]);
        self.comm.sum_u64(&mut total);
        self.comm.max_u64(&mut greatest);
        Imbalance(greatest[0] as f64 * self.comm.size() as f64 / total[0].max(1) as f64)
    }

    /// Collective. Imbalance that a new partition would have.
    pub fn possible_imbalance(&self) -> Imbalance {
        Imbalance(self.forest.plan_partition(&self.comm, &self.leaf_costs()).imbalance())
    }

    /// Collective. Measures costs and partitions anew if that is expected to pay. Changes no bit of the state.
    /// Returns whether leaves have moved.
    pub fn balance(&mut self) -> bool {
        self.agree_on_costs();
        let now = self.imbalance().0;
        let (moment, steps) = self.partitioned.looked;
        let step = moment.elapsed() / (self.clock.step - steps).max(1) as f64;
        self.partitioned.looked = (Moment::now(), self.clock.step);
        if now <= LIMIT {
            return false;
        }
        let mut slowest = [step, self.partitioned.price];
        self.comm.max_f64s(&mut slowest);
        let cuts = self.forest.plan_partition(&self.comm, &self.leaf_costs());
        let [step, price] = slowest;
        let age = self.clock.step - self.partitioned.step;
        let pays = Prospect { now, then: cuts.imbalance(), step, price, age }.pays();
        let moved = pays && self.move_leaves(cuts);
        self.partitioned.looked.0 = Moment::now();
        moved
    }

    /// Collective. Cuts the curve anew by current costs, moves leaves with their particles and rebuilds the
    /// grid where tree or partition have changed. Changes no bit of the state.
    pub fn rebalance(&mut self) {
        let cuts = self.forest.plan_partition(&self.comm, &self.leaf_costs());
        self.move_leaves(cuts);
    }

    fn move_leaves(&mut self, cuts: partition::Cuts) -> bool {
        let (start, moment) = (Instant::now(), Moment::now());
        let shipment = self.forest.partition_at(&self.comm, cuts);
        self.partitioned.step = self.clock.step;
        if shipment.changed() {
            let payload = std::mem::take(&mut self.chunks).iter().map(Chunk::to_bytes).collect();
            let arrived: Vec<Vec<u8>> = shipment.move_payload(&self.comm, payload);
            self.chunks = arrived.iter().map(|bytes| Chunk::from_bytes(bytes)).collect();
        }
        // The tree may have changed before, even if no leaf moves now.
        if self.grid.plan.revision != self.forest.revision() {
            self.signal = vec![0.0; self.chunks.len()];
            self.costs.forget(self.chunks.len());
            self.rebuild_grid(self.agreed_reach());
        }
        self.partitioned.price = moment.elapsed();
        self.phases.book(Phase::Regrid, start.elapsed());
        shipment.changed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partition_that_brings_nothing_is_not_made() {
        let prospect = Prospect { now: 1.3, then: 1.3, step: 1.0, price: 1e-9, age: 1000 };
        assert!(!prospect.pays());
        assert!(!Prospect { then: 1.4, ..prospect }.pays());
        assert!(Prospect { then: 1.04, ..prospect }.pays());
        // 4 % of 100 steps for the price of five: not yet; of 130 steps: yes.
        let small = Prospect { now: 1.0, then: 0.96, step: 1.0, price: 5.0, age: 1 };
        assert!(!small.pays());
        assert!(Prospect { age: 130, ..small }.pays());
    }
}
