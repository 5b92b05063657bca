//! The grid of one tree and one partition, and the exchanges of a step.
use partition::comm::Traffic;
use rayon::prelude::*;

use crate::adaptivity::resample::cell_fit::Resampling;
use crate::grid::sums::statistics::{Statistics, surface_bytes};
use crate::solver::migration::depart::Departed;
use crate::solver::migration::error::MigrateError;
use crate::solver::migration::migrate::Moved;
use crate::solver::sorting::box_widths::BoxWidths;
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::phases::Phase;

/// Factor by which boxes may widen until the next change of the tree without a new grid in between. A grid
/// for boxes wider than a cell has bins of every leaf in those around it and takes three times as long to
/// make.
const GROWTH: f64 = 1.1;

/// Reach that boxes of a half width need, which is given in cells.
pub(in crate::solver) fn reach_of_width(cells: f64) -> u32 {
    // Rounding must not make a box that is exactly one cell wide a wide one.
    if cells <= 0.5 * (1.0 + 4.0 * f64::EPSILON) { 0 } else { cells.ceil() as u32 }
}

impl<const D: usize> Solver<D> {
    /// Not collective. Reach that the boxes of this rank need if they become `growth` times as wide. Boxes
    /// whose bounds need no more than the `known` reach are not examined.
    fn local_reach(&self, growth: f64, known: u32) -> u32 {
        let widths = self.physics.widths(&self.grid.plan);
        let root_edge = self.physics.root_edge;
        let leaves = self.forest.leaves().par_iter().zip(&self.chunks).with_min_len(32);
        let reaches = leaves.map(|(leaf, chunk)| {
            let cell = root_edge / f64::from(4u32 << leaf.level);
            let bound = widths.bound(chunk) / cell;
            match reach_of_width(bound) {
                reach if reach <= known => reach,
                _ => reach_of_width(bound.min(growth * widths.greatest_of_wide(chunk, cell) / cell)),
            }
        });
        reaches.max().unwrap_or(0)
    }

    /// Collective. Reach for a new grid: enough for the boxes of all ranks, with a margin for their growth,
    /// and for particles that are due to merge.
    pub(in crate::solver) fn agreed_reach(&self) -> u32 {
        let mut reach = [u64::from(self.local_reach(GROWTH, 0).max(self.reach_of_merges()))];
        self.comm.max_u64(&mut reach);
        reach[0] as u32
    }

    /// Not collective. Reach that the boxes of this rank need now, exact where it is more than the grid has.
    pub(in crate::solver) fn reach_now(&self) -> u32 {
        self.local_reach(1.0, self.grid.plan.tree.reach())
    }

    /// Collective. Makes the grid anew if the boxes of any rank need more reach than it has.
    pub(in crate::solver) fn provide_reach(&mut self, of_any_rank: u32) {
        if of_any_rank > self.grid.plan.tree.reach() {
            self.rebuild_grid(of_any_rank);
        }
    }

    /// Messages and bytes that this rank has sent in steps so far.
    pub fn traffic(&self) -> Traffic {
        let now = self.grid.traffic();
        Traffic {
            messages: self.balance.sent_before.messages + now.messages,
            bytes: self.balance.sent_before.bytes + now.bytes,
        }
    }

    /// Keeps the arenas of a step until the next, for measurements.
    pub fn keep_arenas(&mut self) {
        self.grid.fields[0].arenas.keep();
    }

    /// The grid of the current tree and partition.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Not collective. Records the data of the surface between partitions, while the arenas are those of the
    /// present tree.
    pub(in crate::solver) fn note_surface(&mut self) {
        let Grid { plan, fields, exchange, .. } = &self.grid;
        self.balance.surface_bytes = surface_bytes(&exchange.arenas, plan, &fields[0].arenas);
    }

    /// Collective. Parts of the tree on this rank, and messages of its last exchange.
    pub fn statistics(&self) -> Statistics {
        let (tree, exchange) = (&self.grid.plan.tree, &self.grid.exchange.arenas);
        Statistics {
            leaves: self.forest.leaves().len() as u64,
            ghost_leaves: tree.ghost_len() as u64,
            neighbours: exchange.neighbours().len() as u64,
            arena_bytes: self.grid.sum_bytes,
            surface_bytes: self.balance.surface_bytes,
            grid_bytes: self.grid.heap_bytes() as u64,
        }
    }

    /// Collective over neighbours. Moves particles to the leaves that contain them; only leaves for which
    /// `may_stray` is true may contain others.
    pub(in crate::solver) fn migrate(
        &mut self,
        may_stray: impl Fn(usize) -> bool + Sync,
    ) -> Result<Moved, MigrateError> {
        let scheme = self.physics.scheme();
        let resampling = Resampling::new(self.physics.adaptivity.as_ref(), &scheme, self.grid.plan.extent());
        let (grid, chunks, crossings) = (&mut self.grid, &mut self.chunks, &mut self.measured.crossings);
        let mut splits = Vec::new();
        let moved = self.phases.time(Phase::Migrate, || {
            let (tree, resampling) = (&grid.plan.tree, resampling.as_ref());
            grid.migration.migrate(tree, chunks, resampling, may_stray, &mut splits, crossings)
        });
        self.book_entries(&splits);
        moved
    }

    /// Collective over neighbours. Particles that have left their leaf go to the leaf, and rank, that
    /// contains them.
    ///
    /// # Errors
    /// A particle that has left the domain or moved too far, on the rank that finds it.
    pub(in crate::solver) fn migrate_particles(
        &mut self,
        departed: Vec<Departed>,
    ) -> Result<Moved, MigrateError> {
        let (grid, chunks, crossings) = (&mut self.grid, &mut self.chunks, &mut self.measured.crossings);
        let mut splits = Vec::new();
        let moved = self.phases.time(Phase::Migrate, || {
            grid.migration.arrive(&grid.plan.tree, chunks, departed, &mut splits, crossings)
        });
        self.book_entries(&splits);
        moved
    }
}
