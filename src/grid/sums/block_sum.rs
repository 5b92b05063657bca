//! The sum at the nodes of one block.
use super::contributions::{BlockSum, ZERO, ZEROS};
use crate::grid::constraints::moments::{first_row, rows_of};
use crate::grid::mask::{bits, block_nodes, opposite};
use crate::grid::order::Origin;
use crate::grid::order::region::{MOST_BINS, SPAN, arena_node, part_bins, part_len};
use crate::grid::plan::Block;
use crate::kernel::{ARENA_EDGE, BLOCK, Row};

impl<const D: usize> BlockSum<'_, D> {
    /// Writes the sums of momentum and mass at all nodes of the regions in `wanted`.
    pub(super) fn sum_rows(&mut self, wanted: u32, to: &mut [Row]) {
        let to = &mut to[..block_nodes(D)];
        self.all_planes::<false>(wanted & !self.mixed, to);
        let left = if self.mixed == 0 { 0 } else { self.all_planes::<true>(wanted & self.mixed, to) };
        for region in bits(u64::from(left)) {
            self.fold_rows(region as usize, to);
        }
    }

    /// Sums the regions in `wanted` along the fixed pattern; returns those left out because their
    /// contributions do not fit it. `MIXED` if these regions have contributions beside whole arenas.
    #[inline(never)]
    fn all_planes<const MIXED: bool>(&mut self, wanted: u32, to: &mut [Row]) -> u32 {
        if D == 3 {
            self.plane::<MIXED, 0>(wanted, to)
                | self.plane::<MIXED, 1>(wanted, to)
                | self.plane::<MIXED, 2>(wanted, to)
        } else {
            self.plane::<MIXED, 1>(wanted, to)
        }
    }

    /// Those that have part `Z` along the third axis. In 2D there is none.
    #[inline(always)]
    fn plane<const MIXED: bool, const Z: usize>(&mut self, wanted: u32, to: &mut [Row]) -> u32 {
        self.line::<MIXED, 0, Z>(wanted, to)
            | self.line::<MIXED, 1, Z>(wanted, to)
            | self.line::<MIXED, 2, Z>(wanted, to)
    }

    #[inline(always)]
    fn line<const MIXED: bool, const Y: usize, const Z: usize>(
        &mut self,
        wanted: u32,
        to: &mut [Row],
    ) -> u32 {
        self.region::<MIXED, 0, Y, Z>(wanted, to)
            | self.region::<MIXED, 1, Y, Z>(wanted, to)
            | self.region::<MIXED, 2, Y, Z>(wanted, to)
    }

    #[inline(always)]
    fn region<const MIXED: bool, const X: usize, const Y: usize, const Z: usize>(
        &mut self,
        wanted: u32,
        to: &mut [Row],
    ) -> u32 {
        let region = X + 3 * Y + if D == 3 { 9 * Z } else { 0 };
        if wanted >> region & 1 == 0 {
            return 0;
        }
        if MIXED && !self.place(region) {
            return 1 << region;
        }
        let slots = &self.order[region];
        let deep = D == 3;
        let is_reached = self.occupied & self.regions.positions[region] != 0;
        let size = [part_len(X), part_len(Y), if deep { part_len(Z) } else { 1 }];
        let count = part_bins(X) * part_bins(Y) * if deep { part_bins(Z) } else { 1 };
        let span = size[0] + ARENA_EDGE * (size[1] - 1 + ARENA_EDGE * (size[2] - 1));
        let mut from: [&[Row]; MOST_BINS] = [&ZEROS[..span]; MOST_BINS];
        let partial = self.partial & self.regions.positions[region] != 0;
        for (from, slot) in from.iter_mut().zip(slots).take(if is_reached { count } else { 0 }) {
            let position = slot.position as usize % 32;
            if partial
                && self.partial >> position & 1 == 1
                && self.touched[position] & self.regions.nodes[region] == 0
            {
                continue;
            }
            *from = &self.rows[position][slot.start as usize..][..span];
        }
        if MIXED {
            self.copy_pieces(region);
            for placed in &self.scratch.placed {
                from[placed.slot] = match placed.origin {
                    Origin::Bin { bin, position } => {
                        let first =
                            arena_node::<D>(position as usize, self.regions.nodes[region].trailing_zeros());
                        &self.arenas.rows(bin).unwrap_or(&ZEROS)[first..][..span]
                    }
                    Origin::Piece(_) => &self.scratch.pieces[placed.slot * SPAN..][..span],
                };
            }
        }
        let first = [2 * X - X / 2, 2 * Y - Y / 2, if deep { 2 * Z - Z / 2 } else { 0 }];
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let i = x + ARENA_EDGE * (y + ARENA_EDGE * z);
                    let node = first[0] + x + BLOCK * (first[1] + y + BLOCK * (first[2] + z));
                    let at = |slot: usize| from[slot][i];
                    let pair = |slot: usize| at(slot).plus(&at(slot + 1));
                    let sum = match count {
                        1 => at(0),
                        2 => pair(0),
                        4 => pair(0).plus(&pair(2)),
                        _ => pair(0).plus(&pair(2)).plus(&pair(4).plus(&pair(6))),
                    };
                    to[node] = sum.plus(&ZERO);
                }
            }
        }
        0
    }

    /// Writes the sums of first moments at those of `nodes` that have any. `to` has all moments of the block.
    pub(super) fn sum_moments(&mut self, nodes: u64, to: &mut [Row]) {
        let nodes = nodes & self.plan.blocks[self.block].with_moments;
        if nodes == 0 {
            return;
        }
        let mut from: [&[Row]; 32] = [&[]; 32];
        for position in bits(u64::from(self.occupied)) {
            let bin = self.plan.bins_by_block.inner::<D>(self.block)[position as usize];
            if let Some(moments) = self.arenas.get(bin).and_then(|arena| arena.moments) {
                from[position as usize] = moments.from_block(opposite(D, position as usize));
            }
        }
        for region in bits(u64::from(self.regions.meeting::<D>(nodes))) {
            let wanted = nodes & self.regions.nodes[region as usize];
            let is_mixed = self.mixed >> region & 1 == 1;
            if is_mixed && !self.place(region as usize) {
                self.fold_moments(region as usize, wanted, to);
            } else {
                self.add_moments(region as usize, wanted, is_mixed, &from, to);
            }
        }
    }

    /// The moments at nodes of a region in the fixed pattern; `from` has those of each position.
    fn add_moments(&self, region: usize, nodes: u64, is_mixed: bool, from: &[&[Row]; 32], to: &mut [Row]) {
        let none = [ZERO; D];
        let Block { with_moments, chained, .. } = self.plan.blocks[self.block];
        let count = self.regions.bins[region];
        for bit in bits(nodes) {
            let below = chained & ((1 << bit) - 1);
            let mut at = [&none[..]; MOST_BINS];
            for (at, slot) in at.iter_mut().zip(&self.order[region]).take(count) {
                let position = slot.position as usize % 32;
                if chained >> bit & 1 == 0 {
                    continue;
                }
                // The whole arena has moments; they are zero where particles touch nothing.
                let first = rows_of::<D>(below & self.regions.overlap[position]);
                if let Some(found) = from[position].get(first..first + D) {
                    *at = found;
                }
            }
            let mut others = [none; MOST_BINS];
            if is_mixed {
                for placed in &self.scratch.placed {
                    others[placed.slot] = self.moments(placed.origin, bit).unwrap_or(none);
                }
                for placed in &self.scratch.placed {
                    at[placed.slot] = &others[placed.slot];
                }
            }
            for (i, to) in to[first_row::<D>(with_moments, bit)..][..D].iter_mut().enumerate() {
                let pair = |slot: usize| at[slot][i].plus(&at[slot + 1][i]);
                let sum = match count {
                    1 => at[0][i],
                    2 => pair(0),
                    4 => pair(0).plus(&pair(2)),
                    _ => pair(0).plus(&pair(2)).plus(&pair(4).plus(&pair(6))),
                };
                *to = sum.plus(&ZERO);
            }
        }
    }
}
