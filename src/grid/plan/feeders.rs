//! Which own bins reach each block.
use super::{Bin, NO_BLOCK};
use crate::grid::mask::{offset_count, opposite};

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
    pub fn new<const D: usize>(bins: &[Bin<D>], blocks: usize) -> Self {
        let positions = offset_count(D);
        let mut feeders = Self {
            inner: vec![NO_BIN; blocks * positions],
            outer_start: vec![0; blocks + 1],
            outer: Vec::new(),
        };
        let outer = || (0..).zip(bins).filter(|(_, bin)| !bin.is_inner);
        outer().for_each(|(_, bin)| bin.reached().for_each(|block| feeders.outer_start[block + 1] += 1));
        for block in 0..blocks {
            feeders.outer_start[block + 1] += feeders.outer_start[block];
        }
        let mut next = feeders.outer_start.clone();
        let none = Outer { bin: NO_BIN, position: 0 };
        feeders.outer = vec![none; feeders.outer_start[blocks] as usize];
        for (number, bin) in (0..).zip(bins) {
            for (towards, &block) in bin.around.iter().enumerate().take(positions) {
                if block == NO_BLOCK {
                    continue;
                }
                let (block, position) = (block as usize, opposite(D, towards));
                if bin.is_inner {
                    feeders.inner[block * positions + position] = number;
                } else {
                    feeders.outer[next[block] as usize] = Outer { bin: number, position: position as u8 };
                    next[block] += 1;
                }
            }
        }
        feeders
    }

    /// By position, the bins whose blocks lie in their source leaves; [`NO_BIN`] where there is none.
    pub fn inner<const D: usize>(&self, block: usize) -> &[u32] {
        &self.inner[block * offset_count(D)..][..offset_count(D)]
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
