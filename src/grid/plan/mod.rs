//! The grid of one rank: blocks, bins and constraints, for one tree and one partition.
//!
//! | file | what it holds |
//! |---|---|
//! | `block`, `grid_plan` | blocks and bins; the plan and what it answers |
//! | this | how it is made |
//! | [`ghost_layer`] | the leaves of this rank and its ghost layer |
//! | [`bin_reach`] | which leaves feed a bin |
//! | [`needed_nodes`] | which nodes this rank needs |
//! | [`bins_by_block`] | bins by the blocks that they reach |
//! | [`pieces`], [`remote_sums`] | sums requested from other ranks, and which these are |
//! | [`links`], `block_links` | pairs of blocks of two levels, and which these are |
//! | [`arena_tables`] | constrained nodes in the arena of a bin |
use std::sync::Arc;

use partition::comm::Comm;
use partition::{Forest, MAX_LEVEL, Octant};
use rustc_hash::FxHashMap;

use self::arena_tables::{Tables, has_constrained};
use self::bins_by_block::BinsByBlock;
pub use self::block::{Bin, Block, NO_BLOCK, arena_index};
use self::ghost_layer::{Allowance, Cover, KnownTree};
pub use self::grid_plan::GridPlan;
use self::needed_nodes::{Closure, NodeSets, nodes_in_domain};
use super::constraints::parents::node_coord;
use super::mask::{bits, block_nodes, offset, offset_count, shifted};
use crate::csr::Csr;

pub mod arena_tables;
pub mod bin_reach;
pub mod bins_by_block;
mod block;
mod block_links;
pub mod ghost_layer;
mod grid_plan;
pub mod links;
pub mod needed_nodes;
pub mod pieces;
pub mod remote_sums;

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
}
