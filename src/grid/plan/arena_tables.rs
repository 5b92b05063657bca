//! The constrained nodes of an arena by block, and the first moments that a bin has for them.
use rustc_hash::FxHashMap;

use super::block::{Block, NO_BLOCK, arena_index};
use crate::grid::constraints::moments::{self, Moments, first_row, rows_of};
use crate::grid::mask::{arena_overlap, bits, offset, offset_count};
use crate::kernel::constrained_nodes::{ConstrainedNodes, MomentNode};
use crate::kernel::hanging::HangingNodes;
use crate::kernel::{Row, arena_nodes};

/// First moments in the arena of a bin: block by block around the bin, node by node in the order of bits.
#[derive(Clone, Debug)]
pub struct ArenaConstraints<const D: usize> {
    /// Tables for the kernels.
    pub nodes: ConstrainedNodes,
    /// Per offset number of a block, its nodes with moments in the arena, and the first row of these.
    parts: Vec<(u64, u16)>,
}

/// The nodes with moments that the blocks around a bin share with its arena, by offset number.
fn shared<const D: usize>(
    blocks: &[Block<D>],
    around: &[u32; 27],
) -> impl Iterator<Item = (usize, u32, u64)> {
    let around = around.iter().copied().enumerate().take(offset_count(D));
    around.filter(|(_, block)| *block != NO_BLOCK).map(|(index, block)| {
        (index, block, blocks[block as usize].chained & arena_overlap::<D>(offset(index)))
    })
}

/// Whether the arena of a bin has constrained nodes.
pub(super) fn has_constrained<const D: usize>(blocks: &[Block<D>], around: &[u32; 27]) -> bool {
    shared(blocks, around)
        .any(|(index, block, _)| blocks[block as usize].constrained & arena_overlap::<D>(offset(index)) != 0)
}

/// Tables of constrained nodes, each kept once: beside level jumps the same patterns occur again and again.
pub(in crate::grid) struct Tables<'a, const D: usize> {
    blocks: &'a [Block<D>],
    /// Second moments, by row of the first moments.
    second: Vec<f64>,
    /// By block; blocks with equal nodes and second moments have the same number.
    kinds: Vec<u32>,
    /// By kinds of the blocks around a bin.
    of_kinds: FxHashMap<[u32; 27], u32>,
    /// By what a table is made from: parts of different kinds of blocks may be equal.
    of_content: FxHashMap<Vec<u64>, u32>,
    tables: Vec<ArenaConstraints<D>>,
}

impl<'a, const D: usize> Tables<'a, D> {
    /// `second` holds the second moments of all blocks, by row of their first moments.
    pub(crate) fn new(blocks: &'a [Block<D>], second: Vec<f64>) -> Self {
        let mut known: FxHashMap<Vec<u64>, u32> = FxHashMap::default();
        let kinds = blocks.iter().map(|block| {
            let own = &second[block.first_moment as usize..][..rows_of::<D>(block.with_moments)];
            let nodes = [block.constrained, block.chained, block.with_moments];
            let content = nodes.into_iter().chain(own.iter().map(|second| second.to_bits()));
            let next = known.len() as u32;
            *known.entry(content.collect()).or_insert(next)
        });
        let kinds = kinds.collect();
        let (of_kinds, of_content, tables) = Default::default();
        Self { blocks, second, kinds, of_kinds, of_content, tables }
    }

    /// Number of the table for the nodes around a bin.
    pub(crate) fn number(&mut self, around: &[u32; 27]) -> u32 {
        let kinds = around.map(|block| self.kinds.get(block as usize).copied().unwrap_or(NO_BLOCK));
        if let Some(&number) = self.of_kinds.get(&kinds) {
            return number;
        }
        let number = self.number_by_content(around);
        self.of_kinds.insert(kinds, number);
        number
    }

    fn number_by_content(&mut self, around: &[u32; 27]) -> u32 {
        let (blocks, second) = (self.blocks, &self.second);
        let mut parts = vec![(0, 0); offset_count(D)];
        let mut all: Vec<MomentNode<D>> = Vec::new();
        let mut hanging = vec![0; offset_count(D)];
        for (index, block, nodes) in shared(blocks, around) {
            parts[index] = (nodes, (D * all.len()) as u16);
            let block = &blocks[block as usize];
            hanging[index] = block.constrained & !block.chained & arena_overlap::<D>(offset(index));
            all.extend(bits(nodes).map(|bit| {
                let first = block.first_moment as usize + first_row::<D>(block.with_moments, bit);
                let second = std::array::from_fn(|axis| second[first + axis]);
                MomentNode { node: arena_index::<D>(index, bit), second }
            }));
        }
        let seconds = all.iter().flat_map(|node| node.second.map(f64::to_bits));
        let content = parts.iter().map(|(nodes, _)| *nodes).chain(seconds);
        let next = self.tables.len() as u32;
        let number = *self.of_content.entry(content.chain(hanging.iter().copied()).collect()).or_insert(next);
        if number == next {
            let nodes = ConstrainedNodes::new(&all, hanging_nodes::<D>(&hanging));
            self.tables.push(ArenaConstraints { nodes, parts });
        }
        number
    }

    /// The tables by number.
    pub(crate) fn finish(self) -> Vec<ArenaConstraints<D>> {
        self.tables
    }
}

/// For the kernels, from the nodes in the blocks around a bin.
fn hanging_nodes<const D: usize>(hanging: &[u64]) -> HangingNodes {
    let mut is_hanging = vec![false; arena_nodes(D)];
    for (index, &nodes) in hanging.iter().enumerate() {
        bits(nodes).for_each(|bit| is_hanging[arena_index::<D>(index, bit)] = true);
    }
    HangingNodes::new::<D>(&is_hanging)
}

impl<const D: usize> ArenaConstraints<D> {
    /// Nodes with moments in the arena of the block at offset number `index`, and the first row of these.
    #[inline(always)]
    pub fn of_block(&self, index: usize) -> (u64, usize) {
        let (nodes, first) = self.parts[index];
        (nodes, usize::from(first))
    }

    /// Copies moments into the arena from those of the block at offset number `index`, which are of the nodes
    /// `of_block`.
    #[inline(always)]
    pub fn copy_block(&self, index: usize, of_block: u64, from: &[Row], arena: &mut [Row]) {
        let (nodes, first) = self.of_block(index);
        for (bit, to) in bits(nodes).zip(arena[first..].chunks_exact_mut(D)) {
            to.copy_from_slice(&from[first_row::<D>(of_block, bit)..][..D]);
        }
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.nodes.heap_bytes() + self.parts.capacity() * size_of::<(u64, u16)>()
    }
}

/// First moments in the arena of a bin.
#[derive(Clone, Copy, Debug)]
pub struct ArenaMoments<'a, const D: usize> {
    /// Node by node.
    pub values: &'a [Row],
    /// The nodes.
    pub constraints: &'a ArenaConstraints<D>,
}

impl<'a, const D: usize> ArenaMoments<'a, D> {
    /// Those at nodes of the block at offset number `index`, in order.
    pub fn from_block(self, index: usize) -> &'a [Row] {
        &self.values[self.constraints.of_block(index).1..]
    }

    /// Those of a node of the block at offset number `index`.
    pub fn at(self, index: usize, bit: u32) -> Moments<D> {
        let (nodes, first) = self.constraints.of_block(index);
        moments::read(&self.values[first..], nodes, bit)
    }
}
