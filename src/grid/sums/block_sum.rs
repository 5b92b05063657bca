//! The sum at the nodes of one block.
use std::ops::RangeInclusive;

use super::exchange::ReceivedSums;
use super::irregular::{Irregular, Other};
use crate::grid::arenas::Arenas;
use crate::grid::arenas::window::Window;
use crate::grid::constraints::moments::{first_row, rows_of};
use crate::grid::mask::{bits, block_nodes, opposite};
use crate::grid::order::Origin;
use crate::grid::order::region::{MOST_BINS, Order, Regions, SPAN, arena_node, part_bins, part_len};
use crate::grid::plan::bins_by_block::NO_BIN;
use crate::grid::plan::{Block, GridPlan};
use crate::kernel::{ARENA_EDGE, BLOCK, Row, arena_nodes};

pub(super) const ZERO: Row = Row([0.0; 4]);
/// Stands in for arenas that are not there.
pub(super) static ZEROS: [Row; arena_nodes(3)] = [ZERO; arena_nodes(3)];

/// All that is summed in a step.
#[derive(Clone, Copy)]
pub(super) struct Sources<'a, const D: usize> {
    pub plan: &'a GridPlan<D>,
    pub arenas: &'a Arenas<D>,
    /// Sums of other ranks, where they are to be added.
    pub received: Option<&'a ReceivedSums<D>>,
}

/// Sources of the sum of one block in this step.
pub(super) struct BlockSum<'a, const D: usize> {
    pub(in crate::grid) plan: &'a GridPlan<D>,
    pub(in crate::grid) arenas: &'a Arenas<D>,
    pub(super) received: Option<&'a ReceivedSums<D>>,
    pub(in crate::grid) scratch: &'a mut Irregular<D>,
    pub(in crate::grid) block: usize,
    pub(in crate::grid) regions: &'static Regions,
    pub(in crate::grid) order: &'static Order,
    /// Rows of the arena at each position; zeros where there is none.
    rows: [&'a [Row]; 32],
    /// Nodes that the arena at a position touches, where these are not all.
    touched: [u64; 32],
    /// Positions with arenas.
    pub(in crate::grid) occupied: u32,
    /// Those whose particles do not touch all nodes.
    partial: u32,
    /// Regions with other contributions as well: bins outside their leaves, or sums of other ranks.
    pub(super) mixed: u32,
}

impl<'a, const D: usize> BlockSum<'a, D> {
    /// Finds the contributions to `block`: of own bins, only of sources with these `keys` if any are given;
    /// and of other ranks.
    pub(super) fn find(
        sources: Sources<'a, D>,
        scratch: &'a mut Irregular<D>,
        block: usize,
        keys: Option<RangeInclusive<u64>>,
    ) -> Self {
        let Sources { plan, arenas, received } = sources;
        let regions = Regions::of::<D>();
        scratch.outer.clear();
        let mut sum = Self {
            order: regions.order(plan.blocks[block].coord),
            rows: [&ZEROS; 32],
            touched: [0; 32],
            occupied: 0,
            partial: 0,
            mixed: 0,
            plan,
            arenas,
            received,
            scratch,
            block,
            regions,
        };
        let is_wanted = |key: u64| keys.as_ref().is_none_or(|keys| keys.contains(&key));
        for (position, &bin) in plan.bins_by_block.inner::<D>(block).iter().enumerate() {
            if bin == NO_BIN {
                continue;
            }
            let Some(rows) = arenas.rows(bin) else { continue };
            if keys.is_some() && !is_wanted(plan.bins[bin as usize].block.key()) {
                continue;
            }
            let window = arenas.window(bin as usize);
            if window != Window::FULL {
                let touched = window.nodes_of(opposite(D, position));
                if touched == 0 {
                    continue;
                }
                sum.touched[position] = touched;
                sum.partial |= 1 << position;
            }
            sum.rows[position] = rows;
            sum.occupied |= 1 << position;
        }
        let outer = if arenas.outer_reach(block) { plan.bins_by_block.outer(block) } else { &[] };
        for outer in outer {
            if !arenas.is_occupied(outer.bin as usize) {
                continue;
            }
            let (key, tie) = plan.source_key(outer.bin);
            let touched = arenas.window(outer.bin as usize).nodes_of(opposite(D, outer.position as usize));
            if touched != 0 && is_wanted(key) {
                let origin = Origin::Bin { bin: outer.bin, position: outer.position };
                let homes = plan.homes(outer.bin, block);
                sum.scratch.outer.push(Other { key, tie, touched, homes, origin });
                sum.mixed |= regions.meeting::<D>(touched);
            }
        }
        if let Some(received) = received {
            for part in plan.parts(block) {
                if received.touched(part.piece) & regions.nodes[part.region as usize] != 0 {
                    sum.mixed |= 1 << part.region;
                }
            }
        }
        sum
    }

    /// Whether nothing reaches the block.
    pub(super) fn is_empty(&self) -> bool {
        self.occupied == 0 && self.mixed == 0
    }

    /// Nodes that own bins touch.
    pub(super) fn own_nodes(&self) -> u64 {
        let outer = self.scratch.outer.iter().fold(0, |all, term| all | term.touched);
        bits(u64::from(self.occupied)).fold(outer, |all, position| all | self.touched_at(position as usize))
    }

    /// Nodes that the arena at a position touches.
    pub(super) fn touched_at(&self, position: usize) -> u64 {
        if self.partial >> position & 1 == 1 {
            self.touched[position]
        } else {
            self.regions.overlap[position]
        }
    }

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

impl<const D: usize> Sources<'_, D> {
    /// Prefetches the rows of arenas that the sums of a block need: they lie too far apart for the prefetcher
    /// of the processor.
    pub(super) fn read_ahead(&self, block: usize) {
        for (position, &bin) in self.plan.bins_by_block.inner::<D>(block).iter().enumerate() {
            if bin == NO_BIN {
                continue;
            }
            let (Some(rows), Some(shared)) =
                (self.arenas.rows(bin), Window::<D>::FULL.shared(opposite(D, position)))
            else {
                continue;
            };
            let first = rows.as_ptr().addr();
            shared.for_each_run(|run| run.read_ahead(first + size_of::<Row>() * run.arena));
        }
    }
}
