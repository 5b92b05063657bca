//! Which own bins reach each block.
use super::block::{Bin, NO_BLOCK};
use crate::csr::Csr;
use crate::grid::mask::{offset_count, opposite};

/// No own bin.
pub const NO_BIN: u32 = u32::MAX;

/// Own bins by the blocks that they reach.
#[derive(Clone, Debug, Default)]
pub struct BinsByBlock {
    /// By block and position, the bin whose block lies in its source leaf.
    inner: Vec<u32>,
    /// By block, the others.
    outer: Csr<Outer>,
}

/// A bin whose block lies outside its source leaf.
#[derive(Clone, Copy, Debug)]
pub struct Outer {
    /// The bin.
    pub bin: u32,
    /// Its position.
    pub position: u8,
}

impl BinsByBlock {
    /// Not collective. The bins around each of `blocks` blocks.
    pub fn new<const D: usize>(bins: &[Bin<D>], blocks: usize) -> Self {
        let positions = offset_count(D);
        let reached = (0..).zip(bins).flat_map(|(number, bin)| {
            let around =
                bin.around.iter().enumerate().take(positions).filter(|(_, block)| **block != NO_BLOCK);
            around.map(move |(towards, &block)| (number, bin, block, opposite(D, towards)))
        });
        let mut inner = vec![NO_BIN; blocks * positions];
        for (number, _, block, position) in reached.clone().filter(|(_, bin, ..)| bin.is_inner) {
            inner[block as usize * positions + position] = number;
        }
        let outer = reached.filter(|(_, bin, ..)| !bin.is_inner);
        let outer = outer.map(|(bin, _, block, position)| (block, Outer { bin, position: position as u8 }));
        Self { inner, outer: Csr::new(blocks, outer) }
    }

    /// By position, the bins whose blocks lie in their source leaves; [`NO_BIN`] where there is none.
    pub fn inner<const D: usize>(&self, block: usize) -> &[u32] {
        &self.inner[block * offset_count(D)..][..offset_count(D)]
    }

    /// All others that reach the block.
    pub fn outer(&self, block: usize) -> &[Outer] {
        self.outer.of(block)
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        4 * self.inner.capacity() + self.outer.heap_bytes()
    }
}
