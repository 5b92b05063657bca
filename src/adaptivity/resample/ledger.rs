//! The ledger of splits and merges.
use partition::comm::Comm;

use crate::adaptivity::resample::cell_fit::Splits;
use crate::exact_sum::ExactSum;
use crate::saved::Saved;

/// Counts and energies of splits and merges since the start of the run: sums of this rank, except for the
/// root.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    /// Particles that were split.
    pub splits: u64,
    /// Those among them that were halved because they were stretched.
    pub halved: u64,
    /// Particles that could not be split: their identifiers have no room for another generation.
    pub refused: u64,
    /// Particles that stand for several that were merged.
    pub merges: u64,
    /// Particles that went away in merges.
    pub removed: u64,
    /// Kinetic energy that splits took out of affine velocities, J.
    pub split_energy: ExactSum,
    /// Kinetic energy that merges removed, J.
    pub merge_energy: ExactSum,
    /// The first root that no particle's identifier has had; the same on all ranks.
    pub next_root: u64,
}

/// The ledgers of all ranks together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LedgerTotals {
    /// See [`Ledger::splits`].
    pub splits: u64,
    /// See [`Ledger::refused`].
    pub refused: u64,
    /// See [`Ledger::merges`].
    pub merges: u64,
    /// See [`Ledger::removed`].
    pub removed: u64,
    /// See [`Ledger::split_energy`].
    pub split_energy: f64,
    /// See [`Ledger::merge_energy`].
    pub merge_energy: f64,
}

/// Name of the counter of the first root that no particle has had.
pub const NEXT_ROOT: &str = "next_root";

impl Ledger {
    /// Collective to a file. All but the counts of those halved and refused, which begin with the process.
    pub fn save(&mut self, saved: &mut Saved<'_>) {
        let counts = [&mut self.splits, &mut self.merges, &mut self.removed];
        saved.counts_of_ranks(["splits", "merges", "particles_merged_away"], counts);
        let energies = ["split_energy", "merge_energy"];
        saved.sums(|i| energies[i].into(), [&mut self.split_energy, &mut self.merge_energy].into_iter());
        self.save_next_root(saved);
    }

    /// The first free root.
    pub fn save_next_root(&mut self, saved: &mut Saved<'_>) {
        saved.count(NEXT_ROOT, &mut self.next_root);
    }

    /// Collective. Totals of all ranks; energies are exact before they are rounded once.
    pub fn total(&self, comm: &Comm) -> LedgerTotals {
        let mut counts = [self.splits, self.refused, self.merges, self.removed];
        comm.sum_u64(&mut counts);
        let mut energies = [self.split_energy.clone(), self.merge_energy.clone()];
        ExactSum::sum_over_ranks(comm, &mut energies);
        let [splits, refused, merges, removed] = counts;
        let [split_energy, merge_energy] = energies.each_ref().map(ExactSum::to_f64);
        LedgerTotals { splits, refused, merges, removed, split_energy, merge_energy }
    }

    /// Adds the splits of one leaf.
    pub fn enter_splits(&mut self, done: &Splits) {
        self.splits += done.split;
        self.refused += done.refused;
        done.energies.iter().for_each(|&energy| self.split_energy.add(energy));
    }
}
