//! Splitting and merging of particles in a run, and its ledger.
use partition::Octant;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::adaptivity::resample::cell_fit::{Resampling, Splits};
use crate::adaptivity::resample::merge_backoff::{self, BackoffState, RetrySlot};
use crate::adaptivity::resample::{Merged, ids, merge};
use crate::grid::leaf_geometry::leaf_box;
use crate::kernel::BoxPolicy;
use crate::particle::Chunk;
use crate::particle::chunk::Tag;
use crate::solver::state::Solver;
use crate::solver::step::exchange::reach_of_width;

impl<const D: usize> Solver<D> {
    /// Not collective. Whether each own leaf has particles that are too large or too small for it.
    pub(super) fn look_at_levels(&self) -> Vec<BackoffState> {
        if self.physics.adaptivity.is_none() {
            return Vec::new();
        }
        let turns = self.turns();
        let leaves = self.chunks.par_iter().zip(self.forest.leaves()).zip(&turns).enumerate();
        let maxima = Some(&self.leaf_data.maxima).filter(|maxima| maxima.len() == self.chunks.len());
        let each = leaves.with_min_len(64).map(|(number, ((chunk, leaf), &turn))| {
            // Particles that came in this very step can wait for the next regrid.
            let known = maxima.and_then(|maxima| maxima[number].levels?.look(leaf.level, turn));
            known.unwrap_or_else(|| merge_backoff::look(chunk, leaf.level, turn))
        });
        each.collect()
    }

    /// Not collective. Which particles of each own leaf are to be tried. While the grid is not that of the
    /// tree, leaves count as not beside finer ones.
    pub(super) fn turns(&self) -> Vec<RetrySlot> {
        let every = self.physics.adaptivity.as_ref().map_or(1, |adaptivity| adaptivity.every);
        let regrid = self.clock.step / every;
        let (lists, root_edge) = (&self.grid.fields[0].lists, self.physics.root_edge);
        let is_of_tree = self.grid.plan.revision == self.forest.revision();
        let leaves = self.forest.leaves().iter().enumerate();
        let each = leaves.map(|(number, leaf)| {
            let (lower, upper) = leaf_box(leaf, root_edge);
            let centre = std::array::from_fn(|a| 0.5 * (lower[a] + upper[a]));
            let beside_finer =
                is_of_tree && lists.is_finer_within(number, &centre, 0.75 * (upper[0] - lower[0]));
            RetrySlot::new(regrid, leaf.key(), beside_finer)
        });
        each.collect()
    }

    /// Not collective. Splits particles that are too large for their leaf. `from[i]` is the level of the
    /// cells that the affine state in leaf i comes from, if the tree has changed. Returns in which leaves any
    /// was split.
    pub(super) fn split_particles(&mut self, looks: &[BackoffState], from: Option<&[u8]>) -> Vec<bool> {
        let scheme = self.physics.scheme();
        let extent = self.grid.plan.extent();
        let Some(resampling) = Resampling::new(self.physics.adaptivity.as_ref(), &scheme, extent) else {
            return Vec::new();
        };
        let leaves =
            self.chunks.par_iter_mut().zip(self.forest.leaves()).zip(&self.leaf_data.maxima).enumerate();
        let done = leaves.with_min_len(64).map(|(number, ((chunk, leaf), maxima))| {
            let too_wide = |stretch| resampling.may_exceed(maxima.width, leaf.level, stretch);
            let is_wanted = looks[number].coarser
                || resampling.closes_gaps()
                || resampling.stretch().is_some_and(too_wide);
            let from = from.map_or(leaf.level, |from| from[number]);
            is_wanted.then(|| resampling.fit(chunk, leaf.level, from))
        });
        let done: Vec<Option<Splits>> = done.collect();
        let ledger = &mut self.adaptation.ledger;
        // Each regrid reports all refusals anew, so the count is that of the present state.
        ledger.refused = 0;
        done.iter().flatten().for_each(|done| ledger.enter_splits(done));
        done.iter().map(|done| done.as_ref().is_some_and(Splits::is_any)).collect()
    }

    /// Not collective. Merges particles made for finer leaves than theirs, further than a cell from the next
    /// finer leaf, in the wanted leaves; particles of several families only on demand. Returns per leaf the
    /// merged particles that need an identifier.
    pub(super) fn merge_in_leaves(
        &mut self,
        among_strangers: bool,
        is_wanted: impl Fn(usize) -> bool + Sync,
    ) -> Vec<Merged> {
        let scheme = self.physics.scheme();
        let extent = self.grid.plan.extent();
        let resampling = Resampling::new(self.physics.adaptivity.as_ref(), &scheme, extent);
        let limits = self.physics.adaptivity.as_ref().and_then(|a| a.merge);
        let Some((resampling, limits)) = resampling.zip(limits) else { return Vec::new() };
        let (turns, root_edge) = (self.turns(), self.physics.root_edge);
        let (plan, lists) = (&self.grid.plan, &self.grid.fields[0].lists);
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).enumerate().with_min_len(8);
        let done: Vec<(Merged, Vec<f64>)> = leaves
            .map(|(number, (chunk, leaf)): (usize, (&mut Chunk<D>, &Octant<D>))| {
                let mut energies = Vec::new();
                let mut merged = Merged::default();
                if is_wanted(number) {
                    let cell = plan.cell(leaf.level);
                    let is_far = |x: [f64; D]| !lists.is_finer_within(number, &x, cell);
                    let setting = resampling.setting_at(leaf.level, turns[number]);
                    let bounds = leaf_box(leaf, root_edge);
                    let bounds = among_strangers.then_some(&bounds);
                    merged = merge(chunk, &setting, &limits, bounds, is_far, &mut |e| energies.push(e));
                }
                (merged, energies)
            })
            .collect();
        let mut reports = Vec::with_capacity(done.len());
        for (merged, energies) in done {
            self.adaptation.ledger.merges += merged.merged;
            self.adaptation.ledger.removed += merged.removed;
            energies.iter().for_each(|&energy| self.adaptation.ledger.merge_energy.add(energy));
            reports.push(merged);
        }
        reports
    }

    /// Collective. Merges particles in leaves that are coarser than they are. Returns what was done in each
    /// own leaf.
    pub(super) fn merge_particles(&mut self, looks: &[BackoffState]) -> Vec<Merged> {
        let reports = self.merge_in_leaves(true, |leaf| looks[leaf].due);
        // Groups that are no family get roots of their own, counted along the curve.
        let strangers: u64 = reports.iter().map(|report| report.unnamed.len() as u64).sum();
        let mut total = [strangers];
        self.comm.sum_u64(&mut total);
        if total[0] > 0 && self.adaptation.ledger.next_root + total[0] <= ids::roots(D) {
            let mut root = self.adaptation.ledger.next_root + self.comm.exclusive_sum_u64(strangers);
            for (chunk, report) in self.chunks.iter_mut().zip(&reports) {
                for &p in &report.unnamed {
                    chunk.ids_mut()[p as usize] = root;
                    root += 1;
                }
            }
            self.adaptation.ledger.next_root += total[0];
        }
        reports
    }

    /// Not collective. After all merges of a regrid: counts the attempts that failed.
    pub(super) fn count_tries(&mut self, looks: &[BackoffState], reports: &[Merged]) {
        let turns = self.turns();
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).zip(looks).enumerate();
        let tried = leaves.with_min_len(64).filter(|(_, (_, look))| look.due || look.stale);
        tried.for_each(|(number, ((chunk, leaf), _))| {
            let nobody = FxHashSet::default();
            let refused = reports.get(number).map_or(&nobody, |report| &report.refused);
            merge_backoff::count(chunk, leaf.level, turns[number], refused);
        });
    }

    /// Not collective. Reach that merges of this rank's particles may need (see [`Solver::agreed_reach`]): a
    /// grid of that reach serves them too.
    pub(in crate::solver) fn reach_of_merges(&self) -> u32 {
        let Some(adaptivity) = self.physics.adaptivity.as_ref().filter(|a| a.merge.is_some()) else {
            return 0;
        };
        let stretch = match self.physics.boxes {
            BoxPolicy::Fixed => 1.0,
            BoxPolicy::Volume { max_stretch, .. } => max_stretch,
            BoxPolicy::Cell => return 0,
        };
        // Half widths and cells are those of level 0 over the same power of two.
        let nominal = adaptivity.nominal.iter().copied().fold(0.0, f64::max);
        let reach = reach_of_width(stretch * nominal / (0.25 * self.physics.root_edge));
        let has_finer = |(chunk, leaf): (&Chunk<D>, &Octant<D>)| {
            chunk.tags().iter().any(|&tag| Tag::unpack(tag).level > leaf.level)
        };
        if reach > 0 && self.chunks.iter().zip(self.forest.leaves()).any(has_finer) { reach } else { 0 }
    }

    /// Collective. The root after the highest that any living particle's identifier has.
    pub(in crate::solver) fn first_free_root(&self) -> u64 {
        let mut next = [self.chunks.iter().filter_map(ids::highest_root).max().map_or(0, |root| root + 1)];
        self.comm.max_u64(&mut next);
        next[0]
    }

    /// Enters splits on the way to other leaves in the ledger.
    pub(in crate::solver) fn book_entries(&mut self, splits: &[Splits]) {
        splits.iter().for_each(|done| self.adaptation.ledger.enter_splits(done));
    }
}
