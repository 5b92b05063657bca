//! The constrained nodes of an arena by block, and the first moments that a bin has for them.
use rustc_hash::FxHashMap;

use super::{Block, NO_BLOCK, arena_index};
use crate::grid::constraints::columns::{Columns, Moments};
use crate::grid::mask::{arena_overlap, bits, offset, offset_count};
use crate::kernel::constrained::{Column, ConstrainedNodes};
use crate::kernel::hanging::HangingNodes;
use crate::kernel::{Row, arena_nodes};

/// Columns of first moments in the arena of a bin: numbered block by block around the bin, each in the order of [`Columns`].
#[derive(Clone, Debug)]
pub struct ArenaConstraints<const D: usize> {
    /// What the kernels need of them.
    pub nodes: ConstrainedNodes,
    /// Per offset number of a block, its columns in the arena and the number of the first.
    parts: Vec<(Columns<D>, u16)>,
    /// By number, the place of the column among those of its block.
    places: Vec<u8>,
}

/// The columns that the blocks around a bin share with its arena, by offset number.
fn shared<const D: usize>(
    blocks: &[Block<D>],
    around: &[u32; 27],
) -> impl Iterator<Item = (usize, u32, Columns<D>)> {
    let around = around.iter().copied().enumerate().take(offset_count(D));
    around.filter(|(_, block)| *block != NO_BLOCK).map(|(index, block)| {
        let Block { columns, chained, .. } = &blocks[block as usize];
        (index, block, columns.within(chained & arena_overlap::<D>(offset(index))))
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
    /// Second moments of all columns.
    second: Vec<f64>,
    /// By block; blocks with equal nodes, columns and second moments have the same number.
    kinds: Vec<u32>,
    /// By kinds of the blocks around a bin.
    of_kinds: FxHashMap<[u32; 27], u32>,
    /// By what a table is made from: parts of different kinds of blocks may be equal.
    of_content: FxHashMap<Vec<u64>, u32>,
    tables: Vec<ArenaConstraints<D>>,
}

impl<'a, const D: usize> Tables<'a, D> {
    /// `second` holds the second moments of all columns of the blocks.
    pub fn new(blocks: &'a [Block<D>], second: Vec<f64>) -> Self {
        let mut known: FxHashMap<Vec<u64>, u32> = FxHashMap::default();
        let kinds = blocks.iter().map(|block| {
            let own = &second[block.moments as usize..][..block.columns.len()];
            let nodes = [block.constrained, block.chained].into_iter().chain(block.columns.along());
            let content = nodes.chain(own.iter().map(|second| second.to_bits()));
            let next = known.len() as u32;
            *known.entry(content.collect()).or_insert(next)
        });
        let kinds = kinds.collect();
        let (of_kinds, of_content, tables) = Default::default();
        Self { blocks, second, kinds, of_kinds, of_content, tables }
    }

    /// Number of the table for the columns around a bin.
    pub fn number(&mut self, around: &[u32; 27]) -> u32 {
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
        let mut parts = vec![(Columns::NONE, 0); offset_count(D)];
        let (mut all, mut places): (Vec<Column>, Vec<u8>) = Default::default();
        let mut hanging = vec![0; offset_count(D)];
        for (index, block, columns) in shared(blocks, around) {
            parts[index] = (columns, all.len() as u16);
            let block = &blocks[block as usize];
            hanging[index] = block.constrained & !block.chained & arena_overlap::<D>(offset(index));
            let of_block = block.columns.iter().enumerate();
            for (place, (bit, axis)) in of_block.filter(|(_, (bit, _))| columns.nodes() >> bit & 1 == 1) {
                let second = second[block.moments as usize + place];
                all.push(Column { node: arena_index::<D>(index, bit), axis, second });
                places.push(place as u8);
            }
        }
        let columns = parts.iter().flat_map(|(columns, _)| columns.along());
        let seconds = all.iter().map(|column| column.second.to_bits());
        let content = columns.chain(seconds).chain(places.iter().map(|&place| place.into()));
        let next = self.tables.len() as u32;
        let number = *self.of_content.entry(content.chain(hanging.iter().copied()).collect()).or_insert(next);
        if number == next {
            let nodes = ConstrainedNodes::new::<D>(all, hanging_nodes::<D>(&hanging));
            self.tables.push(ArenaConstraints { nodes, parts, places });
        }
        number
    }

    /// The tables by number.
    pub fn finish(self) -> Vec<ArenaConstraints<D>> {
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
    /// Columns in the arena of the block at offset number `index`, and the number of the first.
    #[inline(always)]
    pub fn of_block(&self, index: usize) -> (Columns<D>, usize) {
        let (columns, first) = self.parts[index];
        (columns, usize::from(first))
    }

    /// Copies the columns in the arena of the block at offset number `index` from all moments of that block.
    #[inline(always)]
    pub fn copy_block(&self, index: usize, from: &[Row], arena: &mut [Row]) {
        let (columns, first) = self.of_block(index);
        let here = first..first + columns.len();
        let to = arena[here.clone()].iter_mut().zip(&self.places[here]);
        to.for_each(|(to, &place)| *to = from[usize::from(place)]);
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        let parts = self.parts.capacity() * size_of::<(Columns<D>, u16)>();
        self.nodes.heap_bytes() + parts + self.places.capacity()
    }
}

/// First moments in the arena of a bin.
#[derive(Clone, Copy, Debug)]
pub struct ArenaMoments<'a, const D: usize> {
    /// By number of the column.
    pub values: &'a [Row],
    /// The columns.
    pub constraints: &'a ArenaConstraints<D>,
}

impl<'a, const D: usize> ArenaMoments<'a, D> {
    /// Those at nodes of the block at offset number `index`, in order.
    pub fn from_block(self, index: usize) -> &'a [Row] {
        &self.values[self.constraints.of_block(index).1..]
    }

    /// Those of a node of the block at offset number `index`.
    pub fn at(self, index: usize, bit: u32) -> Moments<D> {
        let (columns, first) = self.constraints.of_block(index);
        columns.read(&self.values[first..], bit)
    }
}
