//! The constrained nodes of an arena by block, and the first moments that a bin has for them.
use rustc_hash::FxHashMap;

use super::arena::Moments;
use super::mask::{arena_overlap, bits, block_nodes, offset, offset_count};
use super::plan::{Block, NO_BLOCK, arena_index};
use crate::kernel::Row;
use crate::kernel::constrained::ConstrainedNodes;

/// Constrained nodes in the arena of a bin: numbered block by block around the bin, in the order of their bits.
#[derive(Clone, Debug)]
pub struct ArenaConstraints {
    /// What the kernels need of them.
    pub nodes: ConstrainedNodes,
    /// Per offset number of a block, its constrained nodes in the arena and the number of the first.
    parts: Vec<(u64, u16)>,
}

/// The constrained nodes that the blocks around a bin share with its arena, by offset number.
fn shared<const D: usize>(
    blocks: &[Block<D>],
    around: &[u32; 27],
) -> impl Iterator<Item = (usize, u32, u64)> {
    let around = around.iter().copied().enumerate().take(offset_count(D));
    around.filter(|(_, block)| *block != NO_BLOCK).map(|(index, block)| {
        (index, block, blocks[block as usize].constrained & arena_overlap::<D>(offset(index)))
    })
}

/// Whether the arena of a bin has constrained nodes.
pub(super) fn has_constrained<const D: usize>(blocks: &[Block<D>], around: &[u32; 27]) -> bool {
    shared(blocks, around).any(|(_, _, nodes)| nodes != 0)
}

/// Tables of constrained nodes, each kept once: beside level jumps the same patterns occur again and again.
#[derive(Default)]
pub(super) struct Tables {
    /// By what a table is made from.
    numbers: FxHashMap<Vec<u64>, u32>,
    tables: Vec<ArenaConstraints>,
}

impl Tables {
    /// Number of the table for the constrained nodes around a bin; `second` holds the second moments of all blocks that
    /// have moments.
    pub fn number<const D: usize>(&mut self, blocks: &[Block<D>], around: &[u32; 27], second: &[Row]) -> u32 {
        let mut parts = vec![(0, 0); offset_count(D)];
        let mut nodes: Vec<(usize, Row)> = Vec::new();
        for (index, block, constrained) in shared(blocks, around) {
            parts[index] = (constrained, nodes.len() as u16);
            let slot = blocks[block as usize].moments;
            nodes.extend(bits(constrained).map(|bit| {
                let moments = slot.map(|slot| second[slot as usize * block_nodes(D) + bit as usize]);
                (arena_index::<D>(index, bit), moments.unwrap_or_default())
            }));
        }
        let moments = nodes.iter().flat_map(|(_, row)| row.0.map(f64::to_bits));
        let content: Vec<u64> = parts.iter().map(|(nodes, _)| *nodes).chain(moments).collect();
        *self.numbers.entry(content).or_insert_with(|| {
            self.tables.push(ArenaConstraints { nodes: ConstrainedNodes::new::<D>(nodes), parts });
            self.tables.len() as u32 - 1
        })
    }

    /// The tables by number.
    pub fn finish(self) -> Vec<ArenaConstraints> {
        self.tables
    }
}

impl ArenaConstraints {
    /// Those of the nodes `inside` of the block at offset number `index`, with their numbers.
    pub fn of_block(&self, index: usize, inside: u64) -> impl Iterator<Item = (u32, usize)> {
        let (nodes, first) = self.parts[index];
        let numbered = bits(nodes).zip(usize::from(first)..);
        numbered.filter(move |(bit, _)| inside >> bit & 1 == 1)
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.nodes.heap_bytes() + self.parts.capacity() * size_of::<(u64, u16)>()
    }
}

/// First moments in the arena of a bin: of its constrained nodes alone.
#[derive(Clone, Copy, Debug)]
pub struct ArenaMoments<'a, const D: usize> {
    /// Moments in the order of the nodes' numbers.
    pub values: &'a [Moments<D>],
    /// The nodes.
    pub constraints: &'a ArenaConstraints,
}

impl<'a, const D: usize> ArenaMoments<'a, D> {
    /// Moments of the arena's constrained nodes in the block at offset number `index`, in the order of their bits; those
    /// of other blocks follow.
    pub fn from_block(self, index: usize) -> &'a [Moments<D>] {
        let (_, first) = self.constraints.parts[index];
        &self.values[usize::from(first)..]
    }

    /// Moments of a node of the arena; zero if it is not constrained.
    pub fn at(self, node: usize) -> Moments<D> {
        self.constraints.nodes.place(node).map_or([Row::default(); D], |number| self.values[number])
    }
}
