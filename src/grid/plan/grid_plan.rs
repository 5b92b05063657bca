//! The plan, and what it answers.
use std::sync::Arc;

use super::arena_tables::ArenaConstraints;
use super::bins_by_block::BinsByBlock;
use super::block::{Bin, Block};
use super::ghost_layer::KnownTree;
use super::links::Links;
use super::pieces::{Part, Piece};
use crate::csr::Csr;
use crate::geometry::Aabb;
use crate::grid::constraints::moments::rows_of;
use crate::grid::constraints::parents::node_coord;
use crate::grid::mask::block_nodes;
use crate::kernel::Frame;
use crate::kernel::constrained_nodes::ConstrainedNodes;

/// The grid of one rank. Valid for one revision of the forest.
pub struct GridPlan<const D: usize> {
    /// Revision of the forest it was made for.
    pub revision: u64,
    /// Own leaves and ghost layer.
    pub tree: KnownTree<D>,
    /// Edge of a root octant, m.
    pub root_edge: f64,
    /// Blocks, by level and then along the curve.
    pub blocks: Vec<Block<D>>,
    /// First block of each level, and the number of blocks at the end.
    pub level_start: Vec<usize>,
    /// Bins of this rank, leaf by leaf.
    pub bins: Vec<Bin<D>>,
    /// First bin of each own leaf, and the number of bins at the end.
    pub leaf_start: Vec<u32>,
    /// Which own bins reach each block.
    pub bins_by_block: BinsByBlock,
    /// Sums that this rank needs of others, by rank.
    pub pieces: Vec<Piece>,
    pub(in crate::grid) parts: Csr<Part>,
    /// Per level, links to the parents of its constrained nodes.
    pub links: Vec<Links>,
    /// Needed real nodes on faces of the domain: node and face bits (`1 << 2 axis` lower, `2 << 2 axis`
    /// upper).
    pub face_nodes: Vec<(u32, u8)>,
    /// Number of rows of first moments.
    pub moments: usize,
    /// Constrained nodes of arenas, for [`Bin::touched`].
    pub constraints: Arc<Vec<ArenaConstraints<D>>>,
    /// Rounds of requests until the ghost layer was complete.
    pub rounds: usize,
}

impl<const D: usize> GridPlan<D> {
    /// Upper corner of the domain, m.
    pub fn extent(&self) -> [f64; D] {
        self.tree.brick().roots.map(|n| f64::from(n) * self.root_edge)
    }

    /// Edge of a cell of `level`, m.
    pub fn cell(&self, level: u8) -> f64 {
        self.root_edge / f64::from(4u32 << level)
    }

    /// Place of the node of a bit of a block, m from the lower corner of the domain.
    pub fn node_place(&self, block: &Block<D>, bit: usize) -> [f64; D] {
        node_coord(block.coord, bit as u32).map(|x| f64::from(x) * self.cell(block.level))
    }

    /// The box from the first node of a block to its last, m from the lower corner of the domain.
    pub fn nodes_box(&self, block: &Block<D>) -> Aabb<D> {
        Aabb::new(self.node_place(block, 0), self.node_place(block, block_nodes(D) - 1))
    }

    /// Number of levels, the deepest included.
    pub fn levels(&self) -> usize {
        self.level_start.len() - 1
    }

    /// Blocks of `level`.
    pub fn level_blocks(&self, level: usize) -> std::ops::Range<usize> {
        self.level_start[level]..self.level_start[level + 1]
    }

    /// Bins of own leaf `leaf`.
    pub fn leaf_bins(&self, leaf: usize) -> std::ops::Range<usize> {
        self.leaf_start[leaf] as usize..self.leaf_start[leaf + 1] as usize
    }

    /// Level of the finest bins of an own leaf.
    pub fn finest_level(&self, leaf: usize) -> u8 {
        self.bins[self.leaf_bins(leaf)].iter().map(|bin| bin.block.level).max().unwrap_or(0)
    }

    /// Edge of a cell of the finest bins of an own leaf, m.
    pub fn finest_cell(&self, leaf: usize) -> f64 {
        self.cell(self.finest_level(leaf))
    }

    /// The block of cells of a bin.
    pub fn frame(&self, bin: &Bin<D>) -> Frame<D> {
        let cell = self.cell(bin.block.level);
        Frame { corner: bin.block.coord.map(|c| f64::from(4 * c) * cell), cell, extent: self.extent() }
    }

    /// Constrained nodes in the arena of a bin, if there are any.
    pub fn constrained(&self, bin: &Bin<D>) -> Option<&ConstrainedNodes> {
        Some(&self.constraints[bin.touched? as usize].nodes)
    }

    /// Position of a node relative to the domain's lower corner, m.
    pub fn node_position(&self, node: u32) -> [f64; D] {
        let block = &self.blocks[node as usize / block_nodes(D)];
        let coord = node_coord(block.coord, node % block_nodes(D) as u32);
        let cell = self.cell(block.level);
        coord.map(|c| f64::from(c) * cell)
    }

    /// Faces of the domain that a needed real node is on, as in [`GridPlan::face_nodes`].
    pub fn faces_at(&self, node: usize) -> u8 {
        let place = self.face_nodes.binary_search_by_key(&(node as u32), |(node, _)| *node);
        place.map_or(0, |place| self.face_nodes[place].1)
    }

    /// Heap bytes held by the larger tables.
    pub fn heap_bytes(&self) -> usize {
        self.tree.heap_bytes()
            + self.blocks.capacity() * size_of::<Block<D>>()
            + self.bins.capacity() * size_of::<Bin<D>>()
            + self.bins_by_block.heap_bytes()
            + self.pieces.capacity() * size_of::<Piece>()
            + self.parts.heap_bytes()
            + self.constraints.iter().map(ArenaConstraints::heap_bytes).sum::<usize>()
    }

    /// The first moments of a block among those of all.
    pub(in crate::grid) fn moments_of(&self, block: usize) -> std::ops::Range<usize> {
        let Block { with_moments, first_moment, .. } = self.blocks[block];
        let first = first_moment as usize;
        first..first + rows_of::<D>(with_moments)
    }

    /// First row of the first moments of a level.
    pub(in crate::grid) fn first_moment(&self, level: usize) -> usize {
        self.blocks.get(self.level_start[level]).map_or(self.moments, |block| block.first_moment as usize)
    }
}
