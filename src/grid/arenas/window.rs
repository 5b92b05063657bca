//! The part of an arena that the particles of a bin touch.
//!
//! Bins beside level jumps often hold a few particles along one face. Clearing, summing, sending and loading
//! only the nodes that these reach keeps their cost in proportion.
use crate::grid::mask::{offset, product};
use crate::kernel::{ARENA_EDGE, BLOCK, Row, arena_nodes};
use crate::simd::prefetch;

/// A box of arena nodes, `lower..upper` per axis; nodes outside it have no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window<const D: usize> {
    /// First node per axis.
    pub lower: [u8; D],
    /// Node after the last per axis.
    pub upper: [u8; D],
}

/// Consecutive nodes along x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// First node in the arena.
    pub arena: usize,
    /// First node in the block.
    pub block: usize,
    /// Number of nodes.
    pub len: usize,
}

impl Run {
    /// Prefetches the rows of the nodes, of which the first lies at an address: at most four, so in three
    /// cache lines.
    #[inline(always)]
    pub fn read_ahead(&self, first: usize) {
        prefetch(first);
        if self.len > 2 {
            prefetch(first + 64);
        }
        prefetch(first + size_of::<Row>() * (self.len - 1));
    }
}

impl<const D: usize> Window<D> {
    /// The whole arena.
    pub const FULL: Self = Self { lower: [0; D], upper: [ARENA_EDGE as u8; D] };
    /// No node.
    pub const EMPTY: Self = Self { lower: [ARENA_EDGE as u8; D], upper: [0; D] };

    /// Grows to the stencil of a box. `lowest` is the box's lower face along each axis, in cells from the
    /// corner of the bin's block.
    pub fn include(&mut self, lowest: [f64; D]) {
        // More than rounding can shift the lowest node that the kernel finds.
        const SLACK: f64 = 1e-9;
        for axis in 0..D {
            let lowest_node = |x: f64| (x.floor().clamp(-1.0, 3.0) + 1.0) as usize;
            self.lower[axis] = self.lower[axis].min(FIRST[lowest_node(lowest[axis] - SLACK)]);
            self.upper[axis] = self.upper[axis].max(END[lowest_node(lowest[axis] + SLACK)]);
        }
    }

    /// Nodes of the block at offset number `index` from the bin that lie inside, as a mask.
    pub fn nodes_of(&self, index: usize) -> u64 {
        // Arena nodes 0, 1..5 and 5..7 belong to the blocks below, at and above the bin.
        let towards = offset::<D>(index);
        product::<D>(std::array::from_fn(|axis| {
            let along = (1u16 << self.upper[axis]) - (1u16 << self.lower[axis].min(self.upper[axis]));
            match towards[axis] {
                -1 => ((along & 1) << 3) as u8,
                0 => (along >> 1 & 0b1111) as u8,
                _ => (along >> 5 & 0b11) as u8,
            }
        }))
    }

    /// All nodes, in runs of consecutive ones.
    pub fn for_each_run(&self, mut f: impl FnMut(std::ops::Range<usize>)) {
        if *self == Self::FULL {
            return f(0..arena_nodes(D));
        }
        let (lower, upper) = (self.lower.map(usize::from), self.upper.map(usize::from));
        for_each_line(lower, upper, |line| {
            let start = (0..D).map(|axis| line[axis] * ARENA_EDGE.pow(axis as u32)).sum::<usize>();
            f(start..start + upper[0].saturating_sub(lower[0]));
        });
    }

    /// The nodes that the block at offset number `index` from the bin shares; `None` if there are none.
    #[inline(always)]
    pub fn shared(&self, index: usize) -> Option<Shared<D>> {
        // Arena nodes 0, 1..5 and 5..7 belong to the blocks below, at and above the bin.
        let mut rest = index;
        let mut shared = Shared { arena: 0, block: 0, count: [0; D] };
        for axis in 0..D {
            let (start, end, node) = PIECES[rest % 3];
            rest /= 3;
            let lower = start.max(usize::from(self.lower[axis]));
            let upper = end.min(usize::from(self.upper[axis]));
            if lower >= upper {
                return None;
            }
            shared.arena += lower * ARENA_EDGE.pow(axis as u32);
            shared.block += (node + lower - start) << (2 * axis);
            shared.count[axis] = upper - lower;
        }
        Some(shared)
    }
}

/// First node of a window, by the lowest node of a stencil, and its end. Windows contain all or none of the
/// nodes that the arena shares with a region of a block (see [`crate::grid::order::region`]), so that sums
/// never see part of a region.
const FIRST: [u8; 5] = [0, 1, 1, 3, 4];
const END: [u8; 5] = [3, 4, 5, 7, 7];

/// First arena node, the one after the last, and the first block node that the arena of a bin shares along
/// one axis with the blocks below, at and above it.
const PIECES: [(usize, usize, usize); 3] = [(0, 1, 3), (1, 5, 0), (5, 7, 0)];

/// A box of nodes that an arena and a block share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shared<const D: usize> {
    /// First node in the arena.
    arena: usize,
    /// First node in the block.
    block: usize,
    /// Nodes per axis, at most 4.
    count: [usize; D],
}

impl<const D: usize> Shared<D> {
    /// Calls `f` for each run along x. Runs have one of four lengths, each with its own copy of the loop.
    #[inline(always)]
    pub fn for_each_run(self, mut f: impl FnMut(Run)) {
        match self.count[0] {
            1 => self.with_length(1, &mut f),
            2 => self.with_length(2, &mut f),
            3 => self.with_length(3, &mut f),
            _ => self.with_length(4, &mut f),
        }
    }

    #[inline(always)]
    fn with_length(self, len: usize, f: &mut impl FnMut(Run)) {
        for z in 0..if D == 3 { self.count[D - 1] } else { 1 } {
            for y in 0..self.count[1] {
                let arena = self.arena + ARENA_EDGE * (y + ARENA_EDGE * z);
                f(Run { arena, block: self.block + BLOCK * (y + BLOCK * z), len });
            }
        }
    }
}

/// Starts of all lines along x in the box `lower..upper`.
fn for_each_line<const D: usize>(lower: [usize; D], upper: [usize; D], mut f: impl FnMut([usize; D])) {
    let mut line = lower;
    let deep = if D == 3 { lower[D - 1]..upper[D - 1] } else { 0..1 };
    for z in deep {
        for y in lower[1]..upper[1] {
            line[D - 1] = z;
            line[1] = y;
            f(line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::mask::{arena_overlap, bits, offset_count};
    use crate::grid::plan::arena_index;

    fn shared_nodes_equal_the_masks<const D: usize>() {
        let mut window = Window::<D>::EMPTY;
        window.include([0.4; D]);
        window.include([2.9; D]);
        for window in [Window::FULL, window] {
            for index in 0..offset_count(D) {
                let mut found = Vec::new();
                if let Some(shared) = window.shared(index) {
                    shared.for_each_run(|run| {
                        found.extend((0..run.len).map(|i| (run.arena + i, run.block + i)));
                    });
                }
                let inside = |node: usize| {
                    (0..D).all(|axis| {
                        let at = (node / ARENA_EDGE.pow(axis as u32) % ARENA_EDGE) as u8;
                        (window.lower[axis]..window.upper[axis]).contains(&at)
                    })
                };
                let expected: Vec<_> = bits(arena_overlap::<D>(offset(index)))
                    .map(|bit| (arena_index::<D>(index, bit), bit as usize))
                    .filter(|&(node, _)| inside(node))
                    .collect();
                let mask = expected.iter().fold(0, |mask, &(_, bit)| mask | 1 << bit);
                assert_eq!(window.nodes_of(index), mask);
                assert_eq!(found, expected);
            }
        }
    }

    #[test]
    fn shared_nodes() {
        shared_nodes_equal_the_masks::<2>();
        shared_nodes_equal_the_masks::<3>();
    }

    #[test]
    fn window_of_a_box() {
        let mut window = Window::<3>::EMPTY;
        window.include([-0.5, 3.2, 1.0]);
        assert_eq!(window, Window { lower: [0, 4, 1], upper: [3, 7, 5] });
        let mut nodes = 0;
        window.for_each_run(|run| nodes += run.len());
        assert_eq!(nodes, 3 * 3 * 4);
    }
}
