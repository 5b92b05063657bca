//! The sum of one block.
use std::ops::RangeInclusive;

use super::arena::{Arenas, Moments};
use super::exchange::ReceivedSums;
use super::feeders::{NO_BIN, Strays};
use super::mask::{bits, block_nodes, opposite};
use super::order::{Origin, Term, arrange, fold};
use super::plan::GridPlan;
use super::region::{MOST_BINS, Order, Regions, arena_node, part_bins, part_len};
use super::window::Window;
use crate::kernel::{ARENA_EDGE, BLOCK, Row, arena_nodes};

const ZERO: Row = Row([0.0; 4]);
/// Stands in for arenas that are not there.
static ZEROS: [Row; arena_nodes(3)] = [ZERO; arena_nodes(3)];

/// Memory that a thread reuses from block to block.
#[derive(Debug, Default)]
pub(super) struct Scratch<const D: usize> {
    outer: Vec<Term>,
    terms: Vec<Term>,
    rows: Vec<(u32, [Row; MOST_BINS])>,
    moments: Vec<(u32, Moments<D>)>,
}

/// All that is summed in a step.
#[derive(Clone, Copy)]
pub(super) struct Sources<'a, const D: usize> {
    pub plan: &'a GridPlan<D>,
    pub arenas: &'a Arenas<D>,
    pub strays: &'a Strays,
    /// Sums of other ranks, where they are wanted.
    pub received: Option<&'a ReceivedSums<D>>,
}

/// What reaches one block in this step.
pub(super) struct BlockSum<'a, const D: usize> {
    plan: &'a GridPlan<D>,
    arenas: &'a Arenas<D>,
    received: Option<&'a ReceivedSums<D>>,
    scratch: &'a mut Scratch<D>,
    block: usize,
    regions: &'static Regions,
    order: &'static Order,
    /// Rows of the arena at each position; zeros where there is none.
    rows: [&'a [Row]; 32],
    /// Nodes that the arena at a position touches, where these are not all.
    touched: [u64; 32],
    /// Keys of the bins at the positions, where something else than whole arenas reaches the block.
    keys: [u64; 32],
    /// Positions with arenas.
    occupied: u32,
    /// Those whose particles do not touch all nodes.
    partial: u32,
    /// Regions that something else reaches as well: bins outside their leaves, or sums of other ranks.
    mixed: u32,
}

impl<'a, const D: usize> BlockSum<'a, D> {
    /// Finds what reaches `block`: from own bins, only of sources with these `keys` if any are given; and from other ranks.
    pub fn find(
        sources: Sources<'a, D>,
        scratch: &'a mut Scratch<D>,
        block: usize,
        keys: Option<RangeInclusive<u64>>,
    ) -> Self {
        let Sources { plan, arenas, strays, received } = sources;
        let regions = Regions::of::<D>();
        scratch.outer.clear();
        let mut sum = Self {
            order: regions.order(plan.blocks[block].coord),
            rows: [&ZEROS; 32],
            touched: [0; 32],
            keys: [0; 32],
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
        for (position, &bin) in plan.feeders.inner::<D>(block).iter().enumerate() {
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
        let outer = if strays.reach(block) { plan.feeders.outer(block) } else { &[] };
        for outer in outer {
            if !arenas.is_occupied(outer.bin as usize) {
                continue;
            }
            let (key, tie) = plan.source_key(outer.bin);
            let touched = arenas.window(outer.bin as usize).nodes_of(opposite(D, outer.position as usize));
            if touched != 0 && is_wanted(key) {
                let origin = Origin::Bin { bin: outer.bin, position: outer.position };
                sum.scratch.outer.push(Term { key, tie, separation: 0, touched, origin });
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
        if sum.mixed != 0 {
            let bins = plan.feeders.inner::<D>(block);
            for position in bits(u64::from(sum.occupied)).map(|position| position as usize) {
                sum.keys[position] = plan.bins[bins[position] as usize].block.key();
            }
        }
        sum
    }

    /// Whether nothing reaches the block.
    pub fn is_empty(&self) -> bool {
        self.occupied == 0 && self.mixed == 0
    }

    /// Nodes that own bins touch.
    pub fn own_nodes(&self) -> u64 {
        let outer = self.scratch.outer.iter().fold(0, |all, term| all | term.touched);
        bits(u64::from(self.occupied)).fold(outer, |all, position| all | self.touched_at(position as usize))
    }

    /// Nodes that the arena at a position touches.
    fn touched_at(&self, position: usize) -> u64 {
        if self.partial >> position & 1 == 1 {
            self.touched[position]
        } else {
            self.regions.overlap[position]
        }
    }

    /// Writes the sums of momentum and mass at all nodes of the regions in `wanted`.
    pub fn sum_rows(&mut self, wanted: u32, to: &mut [Row]) {
        let to = &mut to[..block_nodes(D)];
        let plain = wanted & !self.mixed;
        let cut = if D == 3 {
            self.plane::<0>(plain, to) | self.plane::<1>(plain, to) | self.plane::<2>(plain, to)
        } else {
            self.plane::<1>(plain, to)
        };
        for region in bits(u64::from(cut | wanted & self.mixed)) {
            self.fold_rows(region as usize, to);
        }
    }

    /// Sums the regions that have parts `Y`, `Z` along the second and third axis; returns those left out because a
    /// window ends inside. In 2D there is no third axis.
    #[inline(always)]
    fn plane<const Z: usize>(&self, wanted: u32, to: &mut [Row]) -> u32 {
        self.line::<0, Z>(wanted, to) | self.line::<1, Z>(wanted, to) | self.line::<2, Z>(wanted, to)
    }

    #[inline(always)]
    fn line<const Y: usize, const Z: usize>(&self, wanted: u32, to: &mut [Row]) -> u32 {
        self.region::<0, Y, Z>(wanted, to)
            | self.region::<1, Y, Z>(wanted, to)
            | self.region::<2, Y, Z>(wanted, to)
    }

    #[inline(always)]
    fn region<const X: usize, const Y: usize, const Z: usize>(&self, wanted: u32, to: &mut [Row]) -> u32 {
        let region = X + 3 * Y + if D == 3 { 9 * Z } else { 0 };
        if wanted >> region & 1 == 0 {
            return 0;
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
            if partial && self.partial >> position & 1 == 1 {
                let nodes = self.regions.nodes[region];
                match self.touched[position] & nodes {
                    0 => continue,
                    inside if inside != nodes => return 1 << region,
                    _ => {}
                }
            }
            *from = &self.rows[position][slot.start as usize..][..span];
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

    /// The sums of a region that more than whole arenas reach.
    fn fold_rows(&mut self, region: usize, to: &mut [Row]) {
        self.list_terms(region);
        let nodes = self.regions.nodes[region];
        let mut stack = std::mem::take(&mut self.scratch.rows);
        let load = |term: &Term| self.rows_of(term, nodes);
        let add = |to: &mut [Row; MOST_BINS], from: &[Row; MOST_BINS]| {
            to.iter_mut().zip(from).for_each(|(to, from)| to.add(from));
        };
        let sum = fold(&self.scratch.terms, &mut stack, load, add).unwrap_or_default();
        for (bit, row) in bits(nodes).zip(&sum) {
            to[bit as usize] = row.plus(&ZERO);
        }
        self.scratch.rows = stack;
    }

    /// Writes the sums of first moments at `nodes`, all of them constrained.
    pub fn sum_moments(&mut self, nodes: u64, to: &mut [Moments<D>]) {
        if nodes == 0 {
            return;
        }
        let mut from: [&[Moments<D>]; 32] = [&[]; 32];
        for position in bits(u64::from(self.occupied)) {
            let bin = self.plan.feeders.inner::<D>(self.block)[position as usize];
            if let Some(moments) = self.arenas.get(bin).and_then(|arena| arena.moments) {
                from[position as usize] = moments.from_block(opposite(D, position as usize));
            }
        }
        for region in bits(u64::from(self.regions.meeting::<D>(nodes))) {
            let wanted = nodes & self.regions.nodes[region as usize];
            if self.mixed >> region & 1 == 1 {
                self.fold_moments(region as usize, wanted, to);
            } else {
                self.add_moments(region as usize, wanted, &from, to);
            }
        }
    }

    /// The moments at nodes of a region that whole arenas reach alone; `from` has those of each position.
    fn add_moments(&self, region: usize, nodes: u64, from: &[&[Moments<D>]; 32], to: &mut [Moments<D>]) {
        let none = [ZERO; D];
        let constrained = self.plan.blocks[self.block].constrained;
        let count = self.regions.bins[region];
        for bit in bits(nodes) {
            let below = constrained & ((1 << bit) - 1);
            let mut at = [&none; MOST_BINS];
            for (at, slot) in at.iter_mut().zip(&self.order[region]).take(count) {
                let position = slot.position as usize % 32;
                // The whole arena has moments; they are zero where particles touch nothing.
                let number = (below & self.regions.overlap[position]).count_ones() as usize;
                if let Some(found) = from[position].get(number) {
                    *at = found;
                }
            }
            to[bit as usize] = std::array::from_fn(|axis| {
                let pair = |slot: usize| at[slot][axis].plus(&at[slot + 1][axis]);
                let sum = match count {
                    1 => at[0][axis],
                    2 => pair(0),
                    4 => pair(0).plus(&pair(2)),
                    _ => pair(0).plus(&pair(2)).plus(&pair(4).plus(&pair(6))),
                };
                sum.plus(&ZERO)
            });
        }
    }

    /// The moments at nodes of a region that more than whole arenas reach.
    fn fold_moments(&mut self, region: usize, nodes: u64, to: &mut [Moments<D>]) {
        self.list_terms(region);
        let mut stack = std::mem::take(&mut self.scratch.moments);
        for bit in bits(nodes) {
            let sum = fold(&self.scratch.terms, &mut stack, |term| self.moments(term, bit), add_moments);
            to[bit as usize] = sum.unwrap_or([ZERO; D]).map(|row| row.plus(&ZERO));
        }
        self.scratch.moments = stack;
    }

    /// Lists what reaches a region, in order.
    fn list_terms(&mut self, region: usize) {
        self.scratch.terms.clear();
        let nodes = self.regions.nodes[region];
        let is_mixed = self.mixed >> region & 1 == 1;
        let bins = self.plan.feeders.inner::<D>(self.block);
        let mut separation = 0;
        for (i, slot) in self.order[region][..self.regions.bins[region]].iter().enumerate() {
            // Heights of the cube's own tree: all that matters is which are higher.
            separation = separation.max(1 + i.trailing_zeros() % 32);
            let position = slot.position as usize;
            if self.occupied >> position & 1 == 0 {
                continue;
            }
            let bin = bins[position];
            let key = self.keys[position];
            let origin = Origin::Bin { bin, position: slot.position };
            let touched = self.touched_at(position);
            self.scratch.terms.push(Term { key, tie: key, separation, touched, origin });
            separation = 0;
        }
        if !is_mixed {
            return;
        }
        let Scratch { outer, terms, .. } = &mut *self.scratch;
        terms.extend(outer.iter().filter(|term| term.touched & nodes != 0));
        if let Some(received) = self.received {
            // Parts are listed region by region.
            let parts = self.plan.parts(self.block);
            let first = parts.partition_point(|part| (part.region as usize) < region);
            for part in parts[first..].iter().take_while(|part| part.region as usize == region) {
                let touched = received.touched(part.piece);
                if touched & nodes != 0 {
                    let origin = Origin::Piece(part.piece);
                    terms.push(Term { key: part.key, tie: part.key, separation: 0, touched, origin });
                }
            }
        }
        arrange(terms);
    }

    /// What a term adds to the nodes of a region, in the order of their bits.
    #[inline(always)]
    fn rows_of(&self, term: &Term, nodes: u64) -> [Row; MOST_BINS] {
        let mut rows = [ZERO; MOST_BINS];
        let touched = bits(nodes).enumerate().filter(|(_, bit)| term.touched >> bit & 1 == 1);
        match (term.origin, self.received) {
            (Origin::Bin { bin, position }, _) => {
                let from = self.arenas.rows(bin).unwrap_or(&ZEROS);
                touched.for_each(|(i, bit)| rows[i] = from[arena_node::<D>(position as usize, bit)]);
            }
            (Origin::Piece(piece), Some(received)) => {
                touched.for_each(|(i, bit)| rows[i] = received.row(piece, bit));
            }
            (Origin::Piece(_), None) => {}
        }
        rows
    }

    /// First moments that a term adds to a node.
    fn moments(&self, term: &Term, bit: u32) -> Moments<D> {
        let found = match (term.origin, self.received) {
            _ if term.touched >> bit & 1 == 0 => None,
            (Origin::Bin { bin, position }, _) => {
                let node = arena_node::<D>(position as usize, bit);
                self.arenas.get(bin).and_then(|arena| arena.moments).map(|moments| moments.at(node))
            }
            (Origin::Piece(piece), received) => received.map(|received| received.moments(piece, bit)),
        };
        found.unwrap_or([ZERO; D])
    }
}

/// Adds one node's moments.
fn add_moments<const D: usize>(to: &mut Moments<D>, from: &Moments<D>) {
    to.iter_mut().zip(from).for_each(|(to, from)| to.add(from));
}

impl<const D: usize> Sources<'_, D> {
    /// Whether an own bin that reaches the block is occupied.
    pub fn reach(&self, block: usize) -> bool {
        let mut inner = self.plan.feeders.inner::<D>(block).iter();
        self.strays.reach(block) || inner.any(|&bin| bin != NO_BIN && self.arenas.is_occupied(bin as usize))
    }
}
