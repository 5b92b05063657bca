//! Partition of leaves by their cost.
//!
//! When to make a new one: ranks take new cuts when the time that the present ones have lost since they were
//! made reaches the cost of a new partition, as in the problem of renting or buying. While imbalance grows
//! evenly, that is the interval with the least sum of both. The partition with which a run starts is a guess;
//! it is replaced as soon as costs are measured, if that halves the imbalance.
use std::time::Instant;

use partition::{CutAt, Cuts};

use crate::adaptivity::Adaptivity;
use crate::particle::Chunk;
use crate::solver::state::Solver;
pub use crate::solver::state::cost::{leaf_cost, leaf_weight};
use crate::solver::state::last_partition::LastPartition;
use crate::solver::state::phases::{Phase, thread_time};
use crate::solver::state::regrid_timers::Part;

/// Steps between checks of the imbalance.
const LOOK_EVERY: u64 = 10;
/// Imbalance below which nothing is done.
const LIMIT: f64 = 1.01;
/// Imbalance from which on the cost of a new partition does not matter, if new cuts halve the imbalance.
const CEILING: f64 = 1.04;

/// Greatest cost of a rank over the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imbalance(pub f64);

/// Where the curve may be cut: trees that may become coarser need families whole.
pub fn cut_at<const D: usize>(adaptivity: Option<&Adaptivity<D>>) -> CutAt {
    if adaptivity.is_some() { CutAt::Families } else { CutAt::Leaves }
}

/// Figures on which the decision for a new partition rests; the same on all ranks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Prospect {
    /// Imbalance now.
    now: f64,
    /// Imbalance with new cuts.
    then: f64,
    /// Seconds lost to imbalance since the last partition, against new cuts.
    lost: f64,
    /// Seconds that the last new partition took.
    price: f64,
    /// Whether the partition was made before costs were measured.
    is_guess: bool,
}

impl Prospect {
    fn pays(self) -> bool {
        let helps = self.then - 1.0 <= 0.5 * (self.now - 1.0);
        let at_any_price = self.is_guess || self.now > CEILING;
        self.then < self.now && (self.lost > self.price || at_any_price && helps)
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
        Imbalance(self.plan_partition().imbalance())
    }

    /// Collective. [`Solver::balance`] in those steps in which several ranks check it.
    pub fn balance_if_due(&mut self) {
        if self.comm.size() > 1 && self.clock.step.is_multiple_of(LOOK_EVERY) {
            self.balance();
        }
    }

    /// Collective. Measures costs, and partitions anew if that saves more time than it takes. Changes no bit
    /// of the state. Returns whether leaves have moved.
    pub fn balance(&mut self) -> bool {
        self.agree_on_costs();
        let now = self.imbalance().0;
        let time = thread_time();
        let since = (time - self.balance.partitioned.looked).as_secs_f64();
        self.balance.partitioned.looked = time;
        let is_guess =
            self.balance.costs.are_measured() && std::mem::take(&mut self.balance.partitioned.is_guess);
        if now <= LIMIT {
            return false;
        }
        let mut slowest = [since, self.balance.partitioned.price];
        self.comm.max_f64s(&mut slowest);
        let [since, price] = slowest;
        let cuts = self.plan_partition();
        let then = cuts.imbalance();
        self.balance.partitioned.lost += since * (1.0 - then / now).max(0.0);
        let pays = Prospect { now, then, lost: self.balance.partitioned.lost, price, is_guess }.pays();
        pays && self.move_leaves(cuts)
    }

    /// Collective. Cuts the curve anew by current costs, moves leaves with their particles and rebuilds the
    /// grid where tree or partition have changed. Changes no bit of the state. Returns whether leaves have
    /// moved.
    pub fn rebalance(&mut self) -> bool {
        let cuts = self.plan_partition();
        self.move_leaves(cuts)
    }

    /// Collective. Where new cuts would lie by current costs.
    fn plan_partition(&self) -> Cuts {
        // A rank that is alone has all leaves, whatever they cost.
        let costs = if self.comm.size() > 1 { self.leaf_costs() } else { vec![1; self.chunks.len()] };
        self.forest.plan_partition(&self.comm, &costs, cut_at(self.physics.adaptivity.as_ref()))
    }

    fn move_leaves(&mut self, cuts: Cuts) -> bool {
        let (wall, start) = (Instant::now(), thread_time());
        self.adaptation.timers.begin();
        let shipment = self.forest.partition_at(&self.comm, cuts);
        if shipment.changed() {
            let chunks = std::mem::take(&mut self.chunks);
            self.chunks = shipment.move_items(&self.comm, chunks, Chunk::append_to, Chunk::from_bytes);
        }
        self.adaptation.timers.end(Part::Partition);
        // The tree may have changed before, even if no leaf moves now.
        if self.grid.plan.revision != self.forest.revision() {
            self.leaf_data.reset(self.chunks.len());
            self.rebuild_grid(self.agreed_reach());
        }
        self.adaptation.timers.end(Part::Grid);
        self.balance.partitioned = LastPartition::since(start);
        self.balance.partitions += u64::from(shipment.changed());
        self.phases.book(Phase::Regrid, wall.elapsed());
        shipment.changed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partition_that_brings_nothing_is_not_made() {
        let prospect = Prospect { now: 1.03, then: 1.01, lost: 2.0, price: 1.0, is_guess: false };
        assert!(prospect.pays());
        assert!(!Prospect { then: 1.03, ..prospect }.pays());
        assert!(!Prospect { lost: 0.5, ..prospect }.pays());
        let guess = Prospect { lost: 0.0, is_guess: true, ..prospect };
        assert!(guess.pays());
        assert!(!Prospect { then: 1.02, ..guess }.pays());
        // Beyond the ceiling at any price, but only where it helps.
        let dear = Prospect { now: 1.06, price: 1e9, ..prospect };
        assert!(dear.pays());
        assert!(!Prospect { then: 1.05, ..dear }.pays());
    }
}
