//! The grid of one rank: blocks, bins and constraints, for one tree and one partition.
//!
//! | file | what it holds |
//! |---|---|
//! | [`ghost_layer`] | the leaves of this rank and its ghost layer |
//! | [`bin_reach`] | which leaves feed a bin |
//! | [`needed_nodes`] | which nodes this rank needs |
//! | [`bins_by_block`] | bins by the blocks that they reach |
//! | [`remote_sums`] | sums requested from other ranks |
//! | [`block_links`] | pairs of blocks of two levels |
//! | [`arena_tables`] | constrained nodes in the arena of a bin |
use std::sync::Arc;

use partition::comm::Comm;
use partition::{Forest, MAX_LEVEL, Octant};
use rustc_hash::FxHashMap;

use self::arena_tables::{ArenaConstraints, Tables, has_constrained};
use self::bins_by_block::BinsByBlock;
use self::block_links::Links;
use self::ghost_layer::{Allowance, Cover, KnownTree};
use self::needed_nodes::{Closure, NodeSets, nodes_in_domain};
use self::remote_sums::{Part, Piece};
use super::constraints::moments::rows_of;
use super::constraints::parents::node_coord;
use super::mask::{bit_of_node, bits, block_nodes, node_of_bit, offset, offset_count, shifted};
use crate::csr::Csr;
use crate::geometry::Aabb;
use crate::kernel::constrained_nodes::ConstrainedNodes;
use crate::kernel::{ARENA_EDGE, Frame};

pub mod arena_tables;
pub mod bin_reach;
pub mod bins_by_block;
pub mod block_links;
pub mod ghost_layer;
pub mod needed_nodes;
pub mod remote_sums;

/// No block: outside the domain, or not needed by this rank.
pub const NO_BLOCK: u32 = u32::MAX;

/// A block of `4^D` nodes.
#[derive(Clone, Copy, Debug)]
pub struct Block<const D: usize> {
    /// Level of its nodes.
    pub level: u8,
    /// Coordinate in blocks; one past the last octant for nodes on the upper faces of the domain.
    pub coord: [u32; D],
    /// Nodes whose velocity this rank needs.
    pub needs_velocity: u64,
    /// Nodes whose complete sum this rank needs.
    pub needs_sum: u64,
    /// Nodes that touch a coarser leaf.
    pub constrained: u64,
    /// Nodes needed that have constrained parents.
    pub chained: u64,
    /// Real nodes that this rank counts when it sums over the grid.
    pub owned: u64,
    /// Nodes with first moments: those that are chained, and those that moments of finer ones pass through.
    pub with_moments: u64,
    /// First row of their moments among those of all blocks.
    pub first_moment: u32,
}

/// A bin: the particles of one leaf, or parts of their boxes, that scatter on one level into the arena of one
/// block. Blocks inside the leaf come first; parts of boxes may also reach blocks of other leaves.
#[derive(Clone, Debug)]
pub struct Bin<const D: usize> {
    /// Own leaf whose particles it takes.
    pub leaf: u32,
    /// Level and block coordinate of the arena.
    pub block: Octant<D>,
    /// Whether the block lies in the leaf.
    pub is_inner: bool,
    /// Blocks around, by offset number; [`NO_BLOCK`] outside the domain.
    pub around: [u32; 27],
    /// Its constrained nodes among [`GridPlan::constraints`], if it has any.
    pub touched: Option<u32>,
}

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
    pub(super) parts: Csr<Part>,
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

impl<const D: usize> Block<D> {
    /// Real nodes whose velocity this rank needs.
    pub fn real_nodes(&self) -> u64 {
        self.needs_velocity & !self.constrained
    }
}

impl<const D: usize> Bin<D> {
    /// The blocks around, in order.
    pub fn reached(&self) -> impl Iterator<Item = usize> {
        let around = &self.around[..offset_count(D)];
        around.iter().filter(|block| **block != NO_BLOCK).map(|block| *block as usize)
    }
}

impl<const D: usize> GridPlan<D> {
    /// Collective. Builds the ghost layer and the grid of each rank.
    pub fn build(comm: &Comm, forest: &Forest<D>, root_edge: f64, allowance: Allowance) -> Self {
        let mut tree = KnownTree::own(forest, comm.rank(), allowance);
        let mut rounds = 0;
        let (needed, bins) = loop {
            let closure = Closure::compute(&tree);
            if !comm.any(!closure.missing.is_empty()) {
                break (closure.blocks, closure.bins);
            }
            rounds += 1;
            tree.add(&forest.leaves_in(comm, &closure.missing));
        };
        let mut plan = Self {
            revision: forest.revision(),
            root_edge,
            blocks: Vec::new(),
            level_start: Vec::new(),
            bins: Vec::new(),
            leaf_start: Vec::new(),
            bins_by_block: BinsByBlock::default(),
            pieces: Vec::new(),
            parts: Csr::default(),
            links: Vec::new(),
            face_nodes: Vec::new(),
            moments: 0,
            constraints: Arc::default(),
            rounds,
            tree,
        };
        plan.list_blocks(&needed);
        let number: FxHashMap<(u8, [u32; D]), u32> =
            plan.blocks.iter().enumerate().map(|(i, b)| ((b.level, b.coord), i as u32)).collect();
        plan.link_levels(&number);
        plan.list_bins(&number, &bins);
        plan.bins_by_block = BinsByBlock::new(&plan.bins, plan.blocks.len());
        plan.list_pieces(comm.rank());
        plan.find_face_nodes();
        let mut tables = Tables::new(&plan.blocks, plan.constraint_spread());
        let mut number = Vec::new();
        for bin in &mut plan.bins {
            if let Some(of_block) = bin.touched {
                // Here blocks are numbered in the order of the first bin that has them.
                if of_block as usize == number.len() {
                    number.push(tables.number(&bin.around));
                }
                bin.touched = Some(number[of_block as usize]);
            }
        }
        plan.constraints = Arc::new(tables.finish());
        plan
    }

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

    fn list_blocks(&mut self, needed: &[(Octant<D>, NodeSets)]) {
        let mut blocks: Vec<Block<D>> = needed
            .iter()
            .map(|&(Octant { level, coord }, sets)| Block {
                level,
                coord,
                needs_velocity: sets.needs_velocity,
                needs_sum: sets.needs_sum,
                constrained: sets.constrained,
                chained: 0,
                owned: self.owned_nodes(level, coord, sets.needs_velocity & !sets.constrained),
                with_moments: 0,
                first_moment: 0,
            })
            .collect();
        blocks.sort_unstable_by_key(|b| (b.level, Octant { level: b.level, coord: b.coord }.key(), b.coord));
        let deepest = blocks.last().map_or(0, |block| block.level as usize);
        self.level_start = (0..=deepest + 1)
            .map(|level| blocks.partition_point(|block| (block.level as usize) < level))
            .collect();
        self.blocks = blocks;
    }

    /// The real nodes among `real` that lie in an own leaf; nodes on upper faces of the domain belong to
    /// the leaf below them.
    fn owned_nodes(&self, level: u8, coord: [u32; D], real: u64) -> u64 {
        if let Cover::Leaf(leaf) = self.tree.cover(level, coord) {
            return if self.tree.local(leaf).is_some() { real } else { 0 };
        }
        bits(real)
            .filter(|&bit| {
                let node = node_coord(coord, bit);
                let position: [u32; D] = std::array::from_fn(|axis| {
                    let end = self.tree.brick().roots[axis] << MAX_LEVEL;
                    // Node coordinates count cells, of which an octant of the level has four per edge.
                    let lattice = (u64::from(node[axis]) << MAX_LEVEL >> (level + 2)) as u32;
                    lattice.min(end - 1)
                });
                let finest = Octant { level: MAX_LEVEL, coord: position };
                self.tree.locate(finest.key()).is_some_and(|leaf| self.tree.local(leaf).is_some())
            })
            .fold(0, |mask, bit| mask | 1 << bit)
    }

    fn list_bins(&mut self, number: &FxHashMap<(u8, [u32; D]), u32>, bins: &[Vec<Octant<D>>]) {
        // Bins of several leaves may have one block; the parts that depend on the block are made once.
        let mut of_block: FxHashMap<Octant<D>, u32> = FxHashMap::default();
        let mut tables = 0;
        for (leaf, blocks) in bins.iter().enumerate() {
            self.leaf_start.push(self.bins.len() as u32);
            for &block in blocks {
                let is_inner = self.tree.leaves()[self.tree.first_own() + leaf].contains(&block);
                if let Some(&same) = of_block.get(&block) {
                    let same = self.bins[same as usize].clone();
                    self.bins.push(Bin { leaf: leaf as u32, is_inner, ..same });
                    continue;
                }
                of_block.insert(block, self.bins.len() as u32);
                let mut around = [NO_BLOCK; 27];
                for (index, slot) in around.iter_mut().enumerate().take(offset_count(D)) {
                    if let Some(coord) = shifted(block.coord, offset::<D>(index))
                        && let Some(&found) = number.get(&(block.level, coord))
                    {
                        *slot = found;
                    }
                }
                let touched = has_constrained(&self.blocks, &around).then_some(tables);
                tables += u32::from(touched.is_some());
                self.bins.push(Bin { leaf: leaf as u32, block, is_inner, around, touched });
            }
        }
        self.leaf_start.push(self.bins.len() as u32);
    }

    fn find_face_nodes(&mut self) {
        let roots = self.tree.brick().roots;
        for (index, block) in self.blocks.iter().enumerate() {
            // Blocks one past the last octant hold the nodes on upper faces.
            if (0..D).all(|axis| ![0, roots[axis] << block.level].contains(&block.coord[axis])) {
                continue;
            }
            let real = block.real_nodes() & nodes_in_domain(&self.tree, block.level, block.coord);
            for bit in bits(real) {
                let node = node_coord(block.coord, bit);
                let mut faces = 0u8;
                for axis in 0..D {
                    let last = 4 * (roots[axis] << block.level);
                    faces |= u8::from(node[axis] == 0) << (2 * axis);
                    faces |= u8::from(node[axis] == last) << (2 * axis + 1);
                }
                if faces != 0 {
                    self.face_nodes.push((index as u32 * block_nodes(D) as u32 + bit, faces));
                }
            }
        }
    }

    /// The first moments of a block among those of all.
    pub(super) fn moments_of(&self, block: usize) -> std::ops::Range<usize> {
        let Block { with_moments, first_moment, .. } = self.blocks[block];
        let first = first_moment as usize;
        first..first + rows_of::<D>(with_moments)
    }

    /// First row of the first moments of a level.
    pub(super) fn first_moment(&self, level: usize) -> usize {
        self.blocks.get(self.level_start[level]).map_or(self.moments, |block| block.first_moment as usize)
    }
}

/// Index in a bin's arena of node `bit` of the block at offset number `index` from the bin.
pub fn arena_index<const D: usize>(index: usize, bit: u32) -> usize {
    let (towards, node) = (offset::<D>(index), node_of_bit::<D>(bit));
    debug_assert_eq!(bit_of_node(node), bit);
    (0..D)
        .map(|axis| {
            let at = (4 * towards[axis] + node[axis] as i32 + 1) as usize;
            at * ARENA_EDGE.pow(axis as u32)
        })
        .sum()
}
