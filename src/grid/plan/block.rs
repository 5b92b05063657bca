//! Blocks and bins of a plan.
use partition::Octant;

use crate::grid::mask::{bit_of_node, node_of_bit, offset, offset_count};
use crate::kernel::ARENA_EDGE;

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

impl<const D: usize> Block<D> {
    /// Real nodes whose velocity this rank needs.
    pub fn real_nodes(&self) -> u64 {
        self.needs_velocity & !self.constrained
    }
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
    /// Its constrained nodes among [`super::GridPlan::constraints`], if it has any.
    pub touched: Option<u32>,
}

impl<const D: usize> Bin<D> {
    /// The blocks around, in order.
    pub fn reached(&self) -> impl Iterator<Item = usize> {
        let around = &self.around[..offset_count(D)];
        around.iter().filter(|block| **block != NO_BLOCK).map(|block| *block as usize)
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
