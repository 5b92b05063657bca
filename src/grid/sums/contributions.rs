//! Contributions to the sum of a block: arenas of own bins, bins outside their leaves, sums of other ranks.
use std::ops::RangeInclusive;

use super::received::ReceivedSums;
use crate::grid::arenas::Arenas;
use crate::grid::arenas::window::Window;
use crate::grid::constraints::moments::Moments;
use crate::grid::mask::{bits, opposite};
use crate::grid::order::region::{MOST_BINS, Order, Regions, SPAN};
use crate::grid::order::{Origin, Term};
use crate::grid::plan::GridPlan;
use crate::grid::plan::bins_by_block::NO_BIN;
use crate::kernel::{Row, arena_nodes};

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

/// A bin outside its leaf that reaches a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Other {
    pub key: u64,
    pub tie: u64,
    /// Nodes of the block that it touches.
    pub touched: u64,
    /// Positions that its leaf covers or lies in.
    pub homes: u32,
    pub origin: Origin,
}

/// A sum that takes the place of an arena in the pattern of a region.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// The place.
    pub slot: usize,
    pub origin: Origin,
}

/// Sources of the sum of a block beside whole arenas. A thread reuses the memory from block to block.
#[derive(Debug)]
pub(super) struct Irregular<const D: usize> {
    /// Bins outside their leaves.
    pub outer: Vec<Other>,
    /// Sums that take the place of arenas in the present region.
    pub placed: Vec<Placed>,
    /// Rows of other ranks in the present region, by place, at the distances that they have in an arena.
    pub pieces: Vec<Row>,
    pub terms: Vec<Term>,
    pub rows: Vec<(u32, [Row; MOST_BINS])>,
    pub moments: Vec<(u32, Moments<D>)>,
}

impl<const D: usize> Default for Irregular<D> {
    fn default() -> Self {
        Self {
            outer: Vec::new(),
            placed: Vec::new(),
            pieces: vec![ZERO; MOST_BINS * SPAN],
            terms: Vec::new(),
            rows: Vec::new(),
            moments: Vec::new(),
        }
    }
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
    pub(super) rows: [&'a [Row]; 32],
    /// Nodes that the arena at a position touches, where these are not all.
    pub(super) touched: [u64; 32],
    /// Positions with arenas.
    pub(in crate::grid) occupied: u32,
    /// Those whose particles do not touch all nodes.
    pub(super) partial: u32,
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
}
