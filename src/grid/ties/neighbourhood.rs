//! Blocks and leaves around a block, for cells and nodes up to a block away.
use partition::Octant;

use crate::grid::mask::{offset, offset_count, offset_index, shifted};
use crate::grid::plan::ghost_layer::{Cover, KnownTree};
use crate::grid::plan::{GridPlan, NO_BLOCK};
use crate::kernel::BLOCK;

/// No leaf of the block's level: outside the domain, or on another level.
const NO_LEAF: u32 = u32::MAX;

/// Sets of cells or nodes of the blocks around a block, by offset number.
pub(super) type Around = [u64; 27];

/// Blocks and leaves around a block, by offset number.
#[derive(Clone, Debug)]
pub(super) struct Neighbourhood {
    /// Blocks of the plan; [`NO_BLOCK`] where the plan has none.
    blocks: [u32; 27],
    /// Known leaves of the level of the block; [`NO_LEAF`] elsewhere.
    leaves: [u32; 27],
}

/// Offset number of the block around that contains a cell or node at a place counted from the lower corner of
/// the block, and the number of the cell or node in it.
fn split<const D: usize>(place: [i32; D]) -> (usize, u32) {
    let edge = BLOCK as i32;
    let index = offset_index(place.map(|x| x.div_euclid(edge)));
    let bit = (0..D).fold(0, |bit, axis| bit | (place[axis].rem_euclid(edge) as u32) << (2 * axis));
    (index, bit)
}

impl Neighbourhood {
    /// Neighbourhood of a block of a plan.
    pub(super) fn of<const D: usize>(plan: &GridPlan<D>, block: usize) -> Self {
        let (level, coord) = (plan.blocks[block].level, plan.blocks[block].coord);
        let place = |level: u8, coord: [u32; D]| (level, Octant { level, coord }.key(), coord);
        let (mut blocks, mut leaves) = ([NO_BLOCK; 27], [NO_LEAF; 27]);
        for index in 0..offset_count(D) {
            let Some(beside) = shifted(coord, offset::<D>(index)) else { continue };
            let found = plan.blocks.binary_search_by_key(&place(level, beside), |b| place(b.level, b.coord));
            found.into_iter().for_each(|found| blocks[index] = found as u32);
            leaves[index] = leaf_at(&plan.tree, level, beside);
        }
        Self { blocks, leaves }
    }

    /// Offset number of the block itself.
    pub(super) const fn centre<const D: usize>() -> usize {
        offset_count(D) / 2
    }

    /// The well filled cells around, given those of all known leaves.
    pub(super) fn words(&self, filled: &[u64]) -> Around {
        self.leaves.map(|leaf| if leaf == NO_LEAF { 0 } else { filled[leaf as usize] })
    }

    /// The sets of nodes around, given those of all blocks.
    pub(super) fn of_blocks(&self, sets: &[u64]) -> Around {
        self.blocks.map(|block| if block == NO_BLOCK { 0 } else { sets[block as usize] })
    }

    /// Whether a cell is well filled, given the well filled cells around; `None` where no leaf of the level
    /// of the block has the cell. `place` counts cells from the lower corner of the block.
    pub(super) fn is_filled<const D: usize>(&self, filled: &Around, place: [i32; D]) -> Option<bool> {
        let (index, bit) = split(place);
        (self.leaves[index] != NO_LEAF).then(|| filled[index] >> bit & 1 == 1)
    }

    /// Whether sets of nodes around have the node at a place.
    pub(super) fn has_node<const D: usize>(nodes: &Around, place: [i32; D]) -> bool {
        let (index, bit) = split(place);
        nodes[index] >> bit & 1 == 1
    }

    /// Number of the block, and bit, of the node at a place.
    pub(super) fn node<const D: usize>(&self, place: [i32; D]) -> Option<(usize, u32)> {
        let (index, bit) = split(place);
        let block = self.blocks[index];
        (block != NO_BLOCK).then_some((block as usize, bit))
    }

    /// Blocks around, itself among them.
    pub(super) fn blocks(&self) -> impl Iterator<Item = usize> {
        self.blocks.iter().filter(|block| **block != NO_BLOCK).map(|block| *block as usize)
    }

    /// Whether all cells that touch a node of the block are well filled.
    pub(super) fn is_full<const D: usize>(&self, filled: &[u64]) -> bool {
        let full = if D == 2 { 0xffff } else { u64::MAX };
        let mut below = (0..offset_count(D)).filter(|&index| offset::<D>(index).iter().all(|&o| o <= 0));
        below.all(|index| self.leaves[index] != NO_LEAF && filled[self.leaves[index] as usize] == full)
    }

    /// Whether no cell around is well filled.
    pub(super) fn is_empty(&self, filled: &[u64]) -> bool {
        self.leaves.iter().all(|&leaf| leaf == NO_LEAF || filled[leaf as usize] == 0)
    }
}

/// The known leaf that is an octant.
fn leaf_at<const D: usize>(tree: &KnownTree<D>, level: u8, coord: [u32; D]) -> u32 {
    match tree.cover(level, coord) {
        Cover::Leaf(leaf) if tree.leaves()[leaf].level == level => leaf as u32,
        _ => NO_LEAF,
    }
}
