//! The nodes where bodies meet, and the volumes of their basis functions.
use rayon::prelude::*;

use crate::grid::mask::{bits, block_nodes};
use crate::grid::{NodeFields, Window};
use crate::kernel::{ARENA_EDGE, BLOCK, Row};
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::velocity_field::VelocityField;

impl<const D: usize> Grid<D> {
    /// Real nodes of each block at which two velocity fields have mass.
    pub(super) fn nodes_where_fields_meet(&self) -> Vec<u64> {
        let nodes = block_nodes(D);
        let all: Vec<&NodeFields<D>> = self.all_fields().collect();
        let blocks = self.plan.blocks.par_iter().enumerate().with_min_len(64);
        let meets = blocks.map(|(index, block)| {
            let active = || all.iter().filter(|fields| fields.active[index]);
            if active().count() < 2 {
                return 0;
            }
            let has_mass =
                |fields: &NodeFields<D>, bit: u32| fields.rows[index * nodes + bit as usize].0[3] > 0.0;
            let meet = |bit: &u32| active().filter(|fields| has_mass(fields, *bit)).count() > 1;
            bits(block.real_nodes()).filter(meet).fold(0, |nodes, bit| nodes | 1 << bit)
        });
        meets.collect()
    }
}

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. Finds the volumes of the basis functions of real nodes: each cell of a
    /// leaf gives a share of its volume to each of its corners, and constrained nodes hand theirs to their
    /// parents.
    pub(super) fn find_hats(&mut self) {
        if !self.grid.hats.is_empty() {
            return;
        }
        let Grid { plan, exchange, hats, .. } = &mut self.grid;
        let mut of_cells = VelocityField::new(plan);
        let own_bins = (0..self.chunks.len()).map(|leaf| (plan.leaf_bins(leaf).start, Window::FULL));
        of_cells.arenas.occupy(plan, &exchange.seam, own_bins);
        // Members of bins are not used.
        let cells: Vec<f64> = (0..plan.levels()).map(|level| plan.cell(level as u8)).collect();
        let places = plan.bins.iter().map(|bin| (usize::from(bin.block.level), bin.block.coord[0]));
        let places: Vec<(usize, u32)> = places.collect();
        let coordinates = self.physics.coordinates;
        of_cells.scatter_and_sum((plan, exchange), &mut self.phases, &self.chunks, |(), bin, mut arena| {
            arena.clear(&Window::FULL);
            let (level, place) = places[bin.number];
            let cell = cells[level];
            let share = (0..D).fold(1.0, |share, _| 0.5 * share * cell);
            let first = f64::from(place) * BLOCK as f64;
            for_each_corner::<D>(|node, cells, along| {
                let around = coordinates.around((first + along) * cell);
                arena.rows[node] = Row([0.0, 0.0, 0.0, share * f64::from(cells) * around])
            });
        });
        hats.extend(of_cells.nodes.rows.iter().map(|row| row.0[3]));
    }
}

/// Calls `each` with the nodes of an arena that are corners of cells of the leaf's block, the number of these
/// cells, and the mean of the first coordinate over the node's hat in them, in cells from that of the block.
fn for_each_corner<const D: usize>(mut each: impl FnMut(usize, u32, f64)) {
    let along = BLOCK + 1;
    for corner in 0..along.pow(D as u32) {
        let (mut node, mut cells, mut rest) = (0, 1, corner);
        let along_first = match corner % along {
            0 => 1.0 / 3.0,
            BLOCK => BLOCK as f64 - 1.0 / 3.0,
            k => k as f64,
        };
        for axis in 0..D {
            let k = rest % along;
            rest /= along;
            node += (k + 1) * ARENA_EDGE.pow(axis as u32);
            cells *= if k == 0 || k == BLOCK { 1 } else { 2 };
        }
        each(node, cells, along_first);
    }
}
