//! Regions: the nodes of a block that the same bins reach, and the order of these bins.
//!
//! Along one axis nodes 0 and 1 of a block lie in the arenas of the bins below it and at it, node 2 in that
//! of the bin at it alone, node 3 in those at it and above it. So a block has `3^D` regions, each reached by
//! the bins of up to `2^D` blocks, a cube of them. Region `i` has along each axis the part that digit `axis`
//! of `i` in base 3 names. A bin's *position* is the offset number (see [`crate::grid::mask::offset`]) of its
//! block from the block of nodes.
//!
//! The binary tree of Morton keys (see [`crate::grid::order`]) parts the two blocks along an axis at the
//! highest bit in which their coordinates differ, so the cube falls apart along one axis after the other.
//! Which axis comes when depends on the block's coordinate alone, in so few ways that tables hold them all.
use std::sync::LazyLock;

use crate::grid::mask::{arena_overlap, bits, node_of_bit};
use crate::grid::mask::{offset, offset_count, offset_index, opposite, product};
use crate::kernel::ARENA_EDGE;

/// One of the three parts of a block along an axis.
struct Part {
    /// First node.
    node: u8,
    /// Number of nodes.
    len: usize,
    /// Bins that reach it: offset along the axis, and the arena's first node in the part.
    bins: &'static [(i32, usize)],
}

const PARTS: [Part; 3] = [
    Part { node: 0, len: 2, bins: &[(-1, 5), (0, 1)] },
    Part { node: 2, len: 1, bins: &[(0, 3)] },
    Part { node: 3, len: 1, bins: &[(0, 4), (1, 0)] },
];

/// Number of nodes of part `part` along its axis.
pub const fn part_len(part: usize) -> usize {
    PARTS[part].len
}

/// Number of bins that reach part `part` along its axis.
pub const fn part_bins(part: usize) -> usize {
    PARTS[part].bins.len()
}

/// Most bins of a region.
pub const MOST_BINS: usize = 8;
/// Most arena nodes from the first to the last of a region.
pub const SPAN: usize = 2 + ARENA_EDGE * (1 + ARENA_EDGE);
/// Most regions of a block.
pub const MOST_REGIONS: usize = 27;

/// A bin that reaches a region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Slot {
    /// Position of the bin.
    pub position: u8,
    /// Node of its arena that is the region's first.
    pub start: u16,
}

/// The bins that reach each region, in the order of the tree: neighbours `2 i` and `2 i + 1` come together
/// first.
pub type Order = [[Slot; MOST_BINS]; MOST_REGIONS];

/// Tables of all regions in 2D or 3D.
pub struct Regions {
    /// Nodes of each region.
    pub nodes: [u64; MOST_REGIONS],
    /// Positions of the bins that reach each region, as bits.
    pub positions: [u32; MOST_REGIONS],
    /// Number of bins that reach each region.
    pub bins: [usize; MOST_REGIONS],
    /// Nodes of the block in the arena of the bin at each position.
    pub overlap: [u64; 32],
    orders: Vec<Order>,
}

static TWO: LazyLock<Regions> = LazyLock::new(Regions::new::<2>);
static THREE: LazyLock<Regions> = LazyLock::new(Regions::new::<3>);

/// The part of a region along `axis`.
fn part(region: usize, axis: usize) -> usize {
    region / 3usize.pow(axis as u32) % 3
}

impl Regions {
    /// The tables for `D` dimensions.
    pub fn of<const D: usize>() -> &'static Self {
        if D == 2 { &TWO } else { &THREE }
    }

    /// The order of bins around the block at `coord`.
    pub fn order<const D: usize>(&self, coord: [u32; D]) -> &Order {
        &self.orders[order_number(coord)]
    }

    /// Regions that have a node among `nodes`, as bits.
    pub fn meeting<const D: usize>(&self, nodes: u64) -> u32 {
        let meets = |region: &usize| self.nodes[*region] & nodes != 0;
        (0..offset_count(D)).filter(meets).fold(0, |all, region| all | 1 << region)
    }

    /// Nodes of some regions, given as bits.
    pub fn nodes_in(&self, regions: u32) -> u64 {
        bits(u64::from(regions)).fold(0, |nodes, region| nodes | self.nodes[region as usize])
    }

    fn new<const D: usize>() -> Self {
        let mut tables = Self {
            nodes: [0; MOST_REGIONS],
            positions: [0; MOST_REGIONS],
            bins: [0; MOST_REGIONS],
            overlap: [0; 32],
            orders: vec![[[Slot::default(); MOST_BINS]; MOST_REGIONS]; 1 << (D + D * (D - 1) / 2)],
        };
        for region in 0..offset_count(D) {
            let parts: [&Part; D] = std::array::from_fn(|axis| &PARTS[part(region, axis)]);
            tables.nodes[region] = product::<D>(parts.map(|part| (((1 << part.len) - 1) << part.node) as u8));
            tables.bins[region] = parts.iter().map(|part| part.bins.len()).product();
            tables.overlap[region] = arena_overlap::<D>(offset(opposite(D, region)));
            for number in 0..tables.orders.len() {
                for i in 0..tables.bins[region] {
                    let slot = slot(&parts, number, i);
                    tables.orders[number][region][i] = slot;
                    tables.positions[region] |= 1 << slot.position;
                }
            }
        }
        tables
    }
}

/// Bin `i` of the region of these parts, in order number `number`.
fn slot<const D: usize>(parts: &[&Part; D], number: usize, i: usize) -> Slot {
    let mut start = 0;
    let towards = std::array::from_fn(|axis| {
        // Axes with two bins that part them later in the tree.
        let below = (0..D).filter(|&other| {
            other != axis && parts[other].bins.len() == 2 && comes_first(parts, number, other, axis)
        });
        let (towards, first) = match parts[axis].bins {
            [alone] => *alone,
            two => two[i >> below.count() & 1],
        };
        start += first * ARENA_EDGE.pow(axis as u32);
        towards
    });
    Slot { position: offset_index::<D>(towards) as u8, start: start as u16 }
}

/// Number of the order of bins around a block. Its bits: whether each coordinate is odd, and, for each two
/// axes, along which of them the bins on the even side of the block and beyond are parted first.
fn order_number<const D: usize>(coord: [u32; D]) -> usize {
    let mut number = 0;
    // A block and its neighbour within the same parent differ in the lowest bit only, those across the
    // parent's face in all bits up to this one.
    let highest: [u32; D] =
        std::array::from_fn(|axis| D as u32 * ((coord[axis] + 1) & !1).trailing_zeros() + axis as u32);
    for axis in 0..D {
        number |= (coord[axis] as usize & 1) << axis;
        for other in axis + 1..D {
            number |= usize::from(highest[axis] < highest[other]) << pair_bit::<D>(axis, other);
        }
    }
    number
}

/// Bit of an order's number that belongs to two axes.
fn pair_bit<const D: usize>(axis: usize, other: usize) -> usize {
    D + axis + other - 1
}

/// Whether bins that differ along axis `a` come together before those that differ along axis `b`.
fn comes_first<const D: usize>(parts: &[&Part; D], number: usize, a: usize, b: usize) -> bool {
    // Within one parent: below an odd block, above an even one.
    let within = |axis: usize| (parts[axis].node == 0) == (number >> axis & 1 == 1);
    match (within(a), within(b)) {
        (true, true) => a < b,
        (false, false) => (number >> pair_bit::<D>(a.min(b), a.max(b)) & 1 == 1) == (a < b),
        (a_within, _) => a_within,
    }
}

/// Node of the arena of the bin at `position` that is node `bit` of the block.
pub fn arena_node<const D: usize>(position: usize, bit: u32) -> usize {
    let (from, node) = (offset::<D>(position), node_of_bit::<D>(bit));
    let along = |axis: usize| (node[axis] as i32 + 1 - 4 * from[axis]) as usize;
    (0..D).map(|axis| along(axis) * ARENA_EDGE.pow(axis as u32)).sum()
}

#[cfg(test)]
mod tests {
    use partition::Octant;

    use super::*;
    use crate::grid::mask::shifted;
    use crate::grid::order::separation;

    fn check<const D: usize>(coord: [u32; D]) {
        let regions = Regions::of::<D>();
        let order = regions.order(coord);
        for region in 0..offset_count(D) {
            let slots = &order[region][..regions.bins[region]];
            let first_node = regions.nodes[region].trailing_zeros();
            for slot in slots {
                assert_eq!(slot.start as usize, arena_node::<D>(slot.position as usize, first_node));
                assert_eq!(regions.nodes[region] & !regions.overlap[slot.position as usize], 0);
            }
            let all = (0..offset_count(D)).filter(|&p| regions.overlap[p] & regions.nodes[region] != 0);
            assert_eq!(all.fold(0, |bits, p| bits | 1u32 << p), regions.positions[region]);
            let keys: Vec<Option<u64>> = slots
                .iter()
                .map(|slot| {
                    let coord = shifted(coord, offset::<D>(slot.position as usize))?;
                    Some(Octant { level: 9, coord }.key())
                })
                .collect();
            let Some(keys) = keys.into_iter().collect::<Option<Vec<u64>>>() else { continue };
            assert!(keys.is_sorted());
            // Halves are further apart than what is in them, on all levels of the tree.
            for i in 1..keys.len() {
                let width = 1 << i.trailing_zeros();
                let apart = separation(keys[i - 1], keys[i]);
                let inside = &keys[i - width..i + width];
                assert_eq!(separation(inside[0], inside[inside.len() - 1]), apart);
                assert!(separation(inside[0], keys[i - 1]) < apart);
            }
        }
    }

    #[test]
    fn order_is_that_of_the_keys() {
        for x in 0..18 {
            for y in 0..18 {
                check([x, y]);
                for z in [0, 1, 2, 7, 8, 11, 12, 15, 16] {
                    check([x, y, z]);
                }
            }
        }
    }

    #[test]
    fn regions_fill_the_block() {
        for (regions, count, nodes) in [(Regions::of::<2>(), 9, 16), (Regions::of::<3>(), 27, 64)] {
            let total: u32 = regions.nodes[..count].iter().map(|nodes| nodes.count_ones()).sum();
            let all = regions.nodes[..count].iter().fold(0, |all, nodes| all | nodes);
            assert_eq!((total, bits(all).count()), (nodes, nodes as usize));
        }
    }
}
