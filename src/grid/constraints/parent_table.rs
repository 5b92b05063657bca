//! Parents of the nodes of fine blocks, in one table for all blocks.
//!
//! Where the parents of a node lie follows from its place in its block and the parity of the block's
//! coordinates.
use std::sync::LazyLock;

use super::parents::{block_and_bit, node_coord, parents_of};
use crate::grid::mask::{block_nodes, moved_along, offset, offset_index};

/// A parent of a node of a fine block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParentNode {
    /// The parent's block: bit `k` says whether it is the upper one along axis `k` of those that hold
    /// parents.
    pub corner: u8,
    /// The parent in its block.
    pub bit: u8,
    /// Offset number of parent minus node, in cells of the finer level. The weight follows from it, see
    /// [`weight_of`].
    pub offset: u8,
}

/// Parents of the nodes of fine blocks, by parity of the blocks' coordinates.
pub struct ParentTable {
    parents: Vec<ParentNode>,
    /// First parent of each node, by parity.
    start: Vec<u16>,
    /// Nodes that have a parent in the block at each corner, by parity.
    having: Vec<[u64; 8]>,
}

/// By offset of a fine block from the coarse one (both along an axis, the coarse coordinate doubled) and node
/// of the coarse one: its children, a bit each, along the axis.
const CHILDREN: [[u8; 4]; 3] = relatives(false);
/// The same by node of the fine block: its parents.
const PARENTS: [[u8; 4]; 3] = relatives(true);

/// Where a node of the one block has relatives in the other: nodes of a fine block at most a fine cell from
/// one of a coarse block have it as parent.
const fn relatives(is_upwards: bool) -> [[u8; 4]; 3] {
    let mut relatives = [[0; 4]; 3];
    let mut entry = 0;
    while entry < 3 * 16 {
        let (place, fine, coarse) = (entry / 16, entry / 4 % 4, entry % 4);
        let way = 2 * coarse as i32 - (4 * (place as i32 - 1) + fine as i32);
        if -1 <= way && way <= 1 {
            let (from, to) = if is_upwards { (fine, coarse) } else { (coarse, fine) };
            relatives[place][from] |= 1 << to;
        }
        entry += 1;
    }
    relatives
}

/// Relatives of the nodes in `mask` in the other block, axis by axis.
#[inline(always)]
fn related<const D: usize>(along: &[[u8; 4]; 3], place: usize, mask: u64) -> u64 {
    let place = offset::<D>(place);
    (0..D).fold(mask, |mask, axis| {
        let sets = along[(place[axis] + 1) as usize];
        (0..4).fold(0, |all, k| all | moved_along(mask, axis, k, sets[k]))
    })
}

static TWO: LazyLock<ParentTable> = LazyLock::new(ParentTable::new::<2>);
static THREE: LazyLock<ParentTable> = LazyLock::new(ParentTable::new::<3>);

impl ParentTable {
    /// The table for `D` dimensions.
    pub fn of<const D: usize>() -> &'static Self {
        if D == 2 { &TWO } else { &THREE }
    }

    fn new<const D: usize>() -> Self {
        let (mut parents, mut start, mut having) = (Vec::new(), Vec::new(), Vec::new());
        for parity in 0..1u32 << D {
            let mut corners = [0; 8];
            // Any block of this parity away from the lower faces has the pattern.
            let block: [u32; D] = std::array::from_fn(|axis| 2 + (parity >> axis & 1));
            for bit in 0..block_nodes(D) as u32 {
                start.push(parents.len() as u16);
                for parent in parents_of::<D>(node_coord(block, bit)) {
                    let (coarse, parent_bit) = block_and_bit(parent.node);
                    let corner = (0..D).fold(0, |corner, axis| corner | (coarse[axis] - 1) << axis);
                    corners[corner as usize] |= 1 << bit;
                    let offset = offset_index(parent.offset) as u8;
                    debug_assert_eq!(parent.weight, weight_of(parent.offset));
                    parents.push(ParentNode { corner: corner as u8, bit: parent_bit as u8, offset });
                }
            }
            having.push(corners);
        }
        start.push(parents.len() as u16);
        Self { parents, start, having }
    }

    /// Parents of node `bit` of a block of some parity, in lexicographic order.
    #[inline(always)]
    pub fn of_node<const D: usize>(&self, parity: usize, bit: u32) -> &[ParentNode] {
        let node = parity * block_nodes(D) + bit as usize;
        &self.parents[usize::from(self.start[node])..usize::from(self.start[node + 1])]
    }

    /// Nodes of blocks of some parity that have a parent in the block at a corner.
    pub fn having(&self, parity: usize, corner: u8) -> u64 {
        self.having[parity][usize::from(corner)]
    }
}

/// Nodes of a fine block that have a parent in `mask`. `place` is the offset number from twice the coordinate
/// of the coarse block to the fine one.
pub fn children<const D: usize>(place: usize, mask: u64) -> u64 {
    related::<D>(&CHILDREN, place, mask)
}

/// Nodes of the coarse block that are parents of `mask` in the fine block at a place, as in [`children`].
pub fn parents<const D: usize>(place: usize, mask: u64) -> u64 {
    related::<D>(&PARENTS, place, mask)
}

/// Parity of coordinates, a bit for each axis.
pub fn parity<const D: usize>(coord: [u32; D]) -> usize {
    (0..D).fold(0, |parity, axis| parity | (coord[axis] as usize & 1) << axis)
}

/// Coordinate of the coarser block at a corner of a fine one: `corner` has a bit for each axis.
pub fn coarser_at<const D: usize>(coord: [u32; D], corner: u8) -> [u32; D] {
    std::array::from_fn(|axis| coord[axis] / 2 + u32::from(corner >> axis & 1))
}

/// Offset number from twice the coordinate of a coarser block to a fine block that has parents in it.
pub fn place_beside<const D: usize>(fine: [u32; D], coarse: [u32; D]) -> usize {
    offset_index::<D>(std::array::from_fn(|axis| fine[axis] as i32 - 2 * coarse[axis] as i32))
}

/// Weight of a parent at an offset from the constrained node: one half for each axis along which they differ.
pub fn weight_of<const D: usize>(offset: [i32; D]) -> f64 {
    offset.iter().filter(|along| **along != 0).fold(1.0, |weight, _| 0.5 * weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_the_parents_of_every_node() {
        let table = ParentTable::of::<3>();
        for coord in [[2, 4, 6], [3, 4, 6], [3, 5, 7], [8, 9, 1]] {
            for bit in 0..64 {
                let found: Vec<_> = table
                    .of_node::<3>(parity(coord), bit)
                    .iter()
                    .map(|parent| {
                        let block = coarser_at(coord, parent.corner);
                        assert_eq!(table.having(parity(coord), parent.corner) >> bit & 1, 1);
                        (node_coord(block, parent.bit.into()), offset::<3>(parent.offset.into()))
                    })
                    .collect();
                let expected: Vec<_> =
                    parents_of(node_coord(coord, bit)).map(|parent| (parent.node, parent.offset)).collect();
                assert_eq!(found, expected);
            }
        }
        // Blocks with even coordinates have all parents in one block.
        assert_eq!((1..8).map(|corner| table.having(0, corner)).max(), Some(0));
    }

    #[test]
    fn children_are_the_nodes_that_name_the_block_as_parent() {
        let table = ParentTable::of::<3>();
        for place in 0..27 {
            for mask in [1, 1 << 63, 0x8421_1248_8421_1248, 0xf0f0_0000_1234_5678, u64::MAX] {
                let coord: [u32; 3] = offset::<3>(place).map(|o| (4 + o) as u32);
                let is_parent = |parent: &&ParentNode| {
                    coarser_at(coord, parent.corner) == [2; 3] && mask >> parent.bit & 1 == 1
                };
                let named = (0..64)
                    .filter(|&bit| table.of_node::<3>(parity(coord), bit).iter().any(|p| is_parent(&p)));
                assert_eq!(children::<3>(place, mask), named.fold(0, |all, bit| all | 1 << bit));
                let of_mask = (0..64).filter(|bit| mask >> bit & 1 == 1).flat_map(|bit| {
                    table
                        .of_node::<3>(parity(coord), bit)
                        .iter()
                        .filter(|p| coarser_at(coord, p.corner) == [2; 3])
                });
                assert_eq!(parents::<3>(place, mask), of_mask.fold(0, |all, parent| all | 1 << parent.bit));
            }
        }
        let number = |offset: [i32; 2]| offset_index(offset);
        assert_eq!(children::<2>(number([0, 0]), 1), 0b0000_0000_0011_0011);
        assert_eq!(children::<2>(number([-1, -1]), 1), 1 << 15);
        assert_eq!(children::<2>(number([1, 1]), 1), 0);
        assert_eq!(parents::<2>(number([0, 0]), 0b11), 0b11);
        assert_eq!(parents::<2>(number([-1, -1]), 1 << 15), 1);
    }
}
