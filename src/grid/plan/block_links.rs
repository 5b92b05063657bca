//! Which blocks hold the parents of constrained nodes: over these sums are restricted and values prolonged.
//!
//! Where the parents of a node lie is in a table for all blocks (`parent_table.rs`); a plan lists pairs of
//! blocks only.
use rustc_hash::FxHashMap;

use super::block::{Block, NO_BLOCK};
use super::grid_plan::GridPlan;
use super::links::{Child, FineBlock, Links};
use super::needed_nodes::constrained_nodes;
use crate::grid::constraints::moments::{first_row, rows_of};
use crate::grid::constraints::parent_table::{
    ParentTable, children, coarser_at, parents, parity, place_beside, weight_of,
};
use crate::grid::mask::{bits, offset};

impl<const D: usize> GridPlan<D> {
    /// Lists the links of all levels and finds which first moments nodes have; `number` numbers the blocks.
    pub(super) fn link_levels(&mut self, number: &FxHashMap<(u8, [u32; D]), u32>) {
        let table = ParentTable::of::<D>();
        self.links = vec![Links::default(); self.levels()];
        let mut pairs: Vec<Vec<(u32, Child)>> = vec![Vec::new(); self.levels()];
        for index in 0..self.blocks.len() {
            let block = &self.blocks[index];
            let (level, parity) = (block.level, parity(block.coord));
            let (summed, needed) = (
                block.needs_sum & block.constrained,
                (block.needs_sum | block.needs_velocity) & block.constrained,
            );
            let mut fine = FineBlock { block: index as u32, parents: [NO_BLOCK; 8] };
            for corner in (0..1u8 << D).filter(|&corner| table.having(parity, corner) & needed != 0) {
                let coord = coarser_at(block.coord, corner);
                let Some(&coarse) = number.get(&(level - 1, coord)) else { continue };
                fine.parents[usize::from(corner)] = coarse;
                if table.having(parity, corner) & summed != 0 && self.blocks[coarse as usize].needs_sum != 0 {
                    pairs[usize::from(level)].push((coarse, Child { block: index as u32, corner }));
                }
            }
            if needed != 0 {
                self.links[usize::from(level)].fine.push(fine);
            }
        }
        self.links.iter_mut().zip(pairs).for_each(|(links, pairs)| links.group(pairs));
        // Where neighbouring leaves differ by one level at most, parents are real.
        let is_graded = self.tree.is_graded();
        if !is_graded || cfg!(debug_assertions) {
            self.find_moments();
        }
        debug_assert!(!is_graded || self.moments == 0, "a parent hangs itself in a graded tree");
    }

    /// Finds which nodes have constrained parents: these and their parents have first moments.
    fn find_moments(&mut self) {
        let links = std::mem::take(&mut self.links);
        // Nodes through which first moments pass between levels.
        let mut passed = vec![0; self.blocks.len()];
        for fine in links.iter().flat_map(|links| &links.fine) {
            self.find_chained(fine, &mut passed);
        }
        for (block, passed) in self.blocks.iter_mut().zip(passed) {
            block.with_moments = block.chained | passed;
            block.first_moment = self.moments as u32;
            self.moments += rows_of::<D>(block.with_moments);
        }
        self.links = links;
    }

    /// Finds the nodes of a block with constrained parents, and lists these parents.
    fn find_chained(&mut self, fine: &FineBlock, passed: &mut [u64]) {
        let table = ParentTable::of::<D>();
        let Block { level, coord, needs_sum: sum, needs_velocity: value, constrained, .. } =
            self.blocks[fine.block as usize];
        let needed = (sum | value) & constrained;
        for corner in (0..1u8 << D).filter(|&corner| table.having(parity(coord), corner) & needed != 0) {
            let coarse = coarser_at(coord, corner);
            let number = fine.parents[usize::from(corner)];
            // Which nodes these are must not depend on what this rank needs.
            let of_coarse = match self.blocks.get(number as usize) {
                Some(block) => block.constrained,
                None => constrained_nodes(&self.tree, level - 1, coarse),
            };
            if of_coarse == 0 {
                continue;
            }
            let place = place_beside(coord, coarse);
            let chained = children::<D>(place, of_coarse) & needed;
            self.blocks[fine.block as usize].chained |= chained;
            if let Some(passed) = passed.get_mut(number as usize) {
                *passed |= parents::<D>(place, chained) & of_coarse;
            }
        }
    }

    /// Second moments of the constraints, `S_j = Σ c (S_i + (x_i - x_j)²)` with `S = 0` on real nodes, along
    /// each axis; by row of the first moments.
    pub(super) fn constraint_spread(&self) -> Vec<f64> {
        let table = ParentTable::of::<D>();
        let mut spread = vec![0.0; self.moments];
        for (level, links) in self.links.iter().enumerate() {
            let cell_squared = self.cell(level as u8).powi(2);
            for fine in &links.fine {
                let block = &self.blocks[fine.block as usize];
                for (bit, at) in bits(block.with_moments).zip((block.first_moment as usize..).step_by(D)) {
                    let mut sum = [0.0; D];
                    for parent in table.of_node::<D>(parity(block.coord), bit) {
                        let delta = offset::<D>(parent.offset.into());
                        let weight = weight_of(delta);
                        for axis in 0..D {
                            sum[axis] += weight * f64::from(delta[axis] * delta[axis]) * cell_squared;
                        }
                        let coarse = fine.parents[usize::from(parent.corner)];
                        let Some(coarse) = self.blocks.get(coarse as usize) else { continue };
                        if coarse.with_moments >> parent.bit & 1 == 1 {
                            let first = first_row::<D>(coarse.with_moments, parent.bit.into());
                            let of_parent = &spread[coarse.first_moment as usize + first..][..D];
                            sum.iter_mut().zip(of_parent).for_each(|(sum, spread)| *sum += weight * spread);
                        }
                    }
                    spread[at..at + D].copy_from_slice(&sum);
                }
            }
        }
        spread
    }
}
