//! Which own bins reach each block.
use super::arena::Arenas;
use super::known::KnownTree;
use super::mask::{offset_count, opposite};
use super::plan::{Bin, GridPlan, NO_BLOCK};

/// No own bin.
pub const NO_BIN: u32 = u32::MAX;

/// Own bins by the blocks that they reach.
#[derive(Clone, Debug, Default)]
pub struct Feeders {
    /// By block and position, the bin whose block lies in its source leaf.
    inner: Vec<u32>,
    /// First of the other bins of each block, and their number at the end.
    outer_start: Vec<u32>,
    outer: Vec<Outer>,
    /// All these bins, each once.
    outer_bins: Vec<u32>,
}

/// Blocks that occupied bins outside their leaves reach in a step. In most steps there are none: boxes must be wide, or lie
/// across a change of level.
#[derive(Debug, Default)]
pub struct Strays(Vec<bool>);

impl Strays {
    /// Whether one reaches the block.
    pub fn reach(&self, block: usize) -> bool {
        self.0.get(block).is_some_and(|reached| *reached)
    }
}

/// A bin whose block lies outside its source leaf.
#[derive(Clone, Copy, Debug)]
pub struct Outer {
    /// The bin.
    pub bin: u32,
    /// Its position.
    pub position: u8,
}

impl Feeders {
    /// Not collective. The bins around each of `blocks` blocks.
    pub fn new<const D: usize>(tree: &KnownTree<D>, bins: &[Bin<D>], blocks: usize) -> Self {
        let positions = offset_count(D);
        let first = tree.first_own();
        let mut feeders = Self {
            inner: vec![NO_BIN; blocks * positions],
            outer_start: vec![0; blocks + 1],
            outer: Vec::new(),
            outer_bins: Vec::new(),
        };
        let mut outer: Vec<(u32, Outer)> = Vec::new();
        for (number, bin) in (0..).zip(bins) {
            let is_inner = tree.leaves()[first + bin.leaf as usize].contains(&bin.block);
            if !is_inner {
                feeders.outer_bins.push(number);
            }
            for (towards, &block) in bin.around.iter().enumerate().take(positions) {
                if block == NO_BLOCK {
                    continue;
                }
                let position = opposite(D, towards);
                if is_inner {
                    feeders.inner[block as usize * positions + position] = number;
                } else {
                    feeders.outer_start[block as usize + 1] += 1;
                    outer.push((block, Outer { bin: number, position: position as u8 }));
                }
            }
        }
        for block in 0..blocks {
            feeders.outer_start[block + 1] += feeders.outer_start[block];
        }
        outer.sort_by_key(|(block, _)| *block);
        feeders.outer = outer.into_iter().map(|(_, outer)| outer).collect();
        feeders
    }

    /// By position, the bins whose blocks lie in their source leaves; [`NO_BIN`] where there is none.
    pub fn inner<const D: usize>(&self, block: usize) -> &[u32] {
        &self.inner[block * offset_count(D)..][..offset_count(D)]
    }

    /// Not collective. Blocks that occupied bins among [`Feeders::outer`] reach.
    pub fn strays<const D: usize>(&self, plan: &GridPlan<D>, arenas: &Arenas<D>) -> Strays {
        let mut reached = Vec::new();
        for &bin in self.outer_bins.iter().filter(|&&bin| arenas.is_occupied(bin as usize)) {
            reached.resize(plan.blocks.len(), false);
            for &block in plan.bins[bin as usize].around.iter().filter(|&&block| block != NO_BLOCK) {
                reached[block as usize] = true;
            }
        }
        Strays(reached)
    }

    /// All others that reach the block.
    pub fn outer(&self, block: usize) -> &[Outer] {
        &self.outer[self.outer_start[block] as usize..self.outer_start[block + 1] as usize]
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        (self.inner.capacity() + self.outer_start.capacity()) * 4 + self.outer.capacity() * size_of::<Outer>()
    }
}
