//! Sets of nodes of one block as bit masks, and the offsets between blocks.
//!
//! A block of level `l` at `coord` owns the `4^D` nodes `4 coord + k`, `k` in `0..4` per axis. Node `k` is
//! bit `k_x + 4 k_y (+ 16 k_z)`.
use crate::kernel::BLOCK;

/// Nodes of one block.
pub const fn block_nodes(d: usize) -> usize {
    BLOCK.pow(d as u32)
}

/// Number of offsets in `{-1, 0, 1}^D`.
pub const fn offset_count(d: usize) -> usize {
    3usize.pow(d as u32)
}

/// All of `{-1, 0, 1}^3`; the first nine hold `{-1, 0, 1}^2`. Grid plans look them up very often.
const OFFSETS: [[i32; 3]; 27] = {
    let mut offsets = [[0; 3]; 27];
    let mut index = 0;
    while index < 27 {
        offsets[index] = [index as i32 % 3 - 1, index as i32 / 3 % 3 - 1, index as i32 / 9 - 1];
        index += 1;
    }
    offsets
};

/// Offset number `index` of `{-1, 0, 1}^D`, first axis fastest.
pub fn offset<const D: usize>(index: usize) -> [i32; D] {
    std::array::from_fn(|axis| OFFSETS[index][axis])
}

/// Number of an offset in `{-1, 0, 1}^D`; inverse of [`offset`].
pub fn offset_index<const D: usize>(offset: [i32; D]) -> usize {
    (0..D).map(|axis| (offset[axis] + 1) as usize * 3usize.pow(axis as u32)).sum()
}

/// The opposite of offset number `index`.
pub const fn opposite(d: usize, index: usize) -> usize {
    offset_count(d) - 1 - index
}

/// All offsets in `{-reach, …, reach}^D`, first axis fastest.
pub fn box_offsets<const D: usize>(reach: u32) -> impl Iterator<Item = [i32; D]> {
    let edge = 2 * reach as usize + 1;
    (0..edge.pow(D as u32)).map(move |index| {
        std::array::from_fn(|axis| (index / edge.pow(axis as u32) % edge) as i32 - reach as i32)
    })
}

/// `coord + offset`, or `None` below zero.
pub fn shifted<const D: usize>(coord: [u32; D], offset: [i32; D]) -> Option<[u32; D]> {
    let mut shifted = coord;
    for axis in 0..D {
        shifted[axis] = coord[axis].checked_add_signed(offset[axis])?;
    }
    Some(shifted)
}

/// Coordinates `k` of node bit `bit` inside its block.
pub fn node_of_bit<const D: usize>(bit: u32) -> [u32; D] {
    std::array::from_fn(|axis| bit >> (2 * axis as u32) & 3)
}

/// Bit number of node `k` of a block.
pub fn bit_of_node<const D: usize>(node: [u32; D]) -> u32 {
    (0..D).map(|axis| node[axis] << (2 * axis)).sum()
}

/// Product of one set of coordinates per axis (bit `k` of `sets[axis]` allows coordinate `k`).
pub fn product<const D: usize>(sets: [u8; D]) -> u64 {
    let full = if D == 2 { 0xffff } else { u64::MAX };
    (0..D).fold(full, |mask, axis| mask & ALONG[axis][usize::from(sets[axis] & 0b1111)])
}

/// Nodes whose coordinate along an axis is in a set.
const ALONG: [[u64; 16]; 3] = {
    // Nodes whose coordinate along each axis is 0.
    let slice = [0x1111_1111_1111_1111, 0x000f_000f_000f_000f, 0xffff];
    let mut along = [[0; 16]; 3];
    let mut entry = 0;
    while entry < 3 * 16 * 4 {
        let (axis, set, k) = (entry / 64, entry / 4 % 16, entry % 4);
        if set >> k & 1 == 1 {
            along[axis][set] |= slice[axis] << (k << (2 * axis));
        }
        entry += 1;
    }
    along
};

/// The nodes of `mask` with coordinate `k` along an axis, moved to all coordinates along it that are in
/// `set`.
#[inline(always)]
pub fn moved_along(mask: u64, axis: usize, k: usize, set: u8) -> u64 {
    // Nodes on the axis itself. A product with them moves nodes of coordinate 0 to each of them, without
    // carries.
    let line = LINES[axis][usize::from(set & 0b1111)];
    (mask >> (k << (2 * axis)) & ALONG[axis][1]).wrapping_mul(line)
}

/// Nodes on an axis whose coordinate is in a set.
const LINES: [[u64; 16]; 3] = {
    let mut lines = [[0; 16]; 3];
    let mut entry = 0;
    while entry < 3 * 16 * 4 {
        let (axis, set, k) = (entry / 64, entry / 4 % 16, entry % 4);
        lines[axis][set] |= (set as u64 >> k & 1) << (k << (2 * axis));
        entry += 1;
    }
    lines
};

/// The nodes of block `bin + offset` that lie in the arena of `bin`: the arena reaches from one node below
/// the block to the second node above it.
pub fn arena_overlap<const D: usize>(offset: [i32; D]) -> u64 {
    product::<D>(offset.map(|o| match o {
        -1 => 0b1000,
        0 => 0b1111,
        _ => 0b0011,
    }))
}

/// The nodes of a block that lie on its lower faces across the axes where `below[axis]` is set: the nodes
/// that the closed octant `block - below` shares with the block.
pub fn lower_face<const D: usize>(below: [bool; D]) -> u64 {
    product::<D>(below.map(|b| if b { 0b0001 } else { 0b1111 }))
}

/// Bits set in `mask`, lowest first.
pub fn bits(mut mask: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        if mask == 0 {
            return None;
        }
        let bit = mask.trailing_zeros();
        mask &= mask - 1;
        Some(bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_round_trip() {
        for index in 0..27 {
            let o = offset::<3>(index);
            assert_eq!(offset_index(o), index);
            assert_eq!(offset::<3>(opposite(3, index)), o.map(|x| -x));
        }
    }

    #[test]
    fn arena_covers_seven_nodes_per_axis() {
        let total: u32 = (0..27).map(|i| arena_overlap::<3>(offset(i)).count_ones()).sum();
        assert_eq!(total, 343);
        let total: u32 = (0..9).map(|i| arena_overlap::<2>(offset(i)).count_ones()).sum();
        assert_eq!(total, 49);
    }

    #[test]
    fn lower_faces() {
        assert_eq!(lower_face::<2>([false, false]), 0xffff);
        assert_eq!(lower_face::<2>([true, false]), 0x1111);
        assert_eq!(lower_face::<2>([true, true]), 1);
        assert_eq!(bits(0x1111).collect::<Vec<_>>(), [0, 4, 8, 12]);
    }
}
