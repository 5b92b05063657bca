//! Constraints between the nodes of two levels.
//!
//! A constrained node of level `l` takes the multilinear interpolation of the level `l-1` nodes around it
//! (Gao et al. 2017, section 4.2): along an axis where its coordinate is even it coincides with the parent
//! `x/2`; where it is odd the parents `(x ± 1)/2` take part with one half each. Restriction is the
//! transpose. Parents may be constrained themselves; chains over several levels follow by recursion.
use crate::grid::mask::{bit_of_node, node_of_bit};

/// One parent of a constrained node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parent<const D: usize> {
    /// Coordinate of the parent on the lattice of its level.
    pub node: [u32; D],
    /// Interpolation weight, `0.5^|offset|_1`.
    pub weight: f64,
    /// Parent minus constrained node, in cells of the finer level; each in {-1, 0, 1}.
    pub offset: [i32; D],
}

/// Parents of the constrained node at lattice coordinate `node`, in lexicographic order, last axis slowest.
pub fn parents_of<const D: usize>(node: [u32; D]) -> impl Iterator<Item = Parent<D>> {
    let odd: u32 = (0..D).filter(|&axis| node[axis] & 1 == 1).map(|axis| 1 << axis).sum();
    let count = odd.count_ones();
    let weight = 0.5f64.powi(count as i32);
    (0..1u32 << D).filter(move |corner| corner & !odd == 0).map(move |corner| {
        let offset = std::array::from_fn(|axis| match (odd >> axis & 1, corner >> axis & 1) {
            (0, _) => 0,
            (_, 0) => -1,
            _ => 1,
        });
        let parent = std::array::from_fn(|axis| node[axis].wrapping_add_signed(offset[axis]) / 2);
        Parent { node: parent, weight, offset }
    })
}

/// Lattice coordinate of node `bit` of the block at `coord`.
pub fn node_coord<const D: usize>(coord: [u32; D], bit: u32) -> [u32; D] {
    let local = node_of_bit::<D>(bit);
    std::array::from_fn(|axis| 4 * coord[axis] + local[axis])
}

/// Block of a node and its bit there.
pub fn block_and_bit<const D: usize>(node: [u32; D]) -> ([u32; D], u32) {
    (node.map(|x| x / 4), bit_of_node::<D>(node.map(|x| x % 4)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_parents_sum_to_one_and_reproduce_the_node() {
        for node in [[4u32, 6, 8], [5, 6, 8], [5, 7, 8], [5, 7, 9]] {
            let parents: Vec<_> = parents_of::<3>(node).collect();
            assert_eq!(parents.iter().map(|p| p.weight).sum::<f64>(), 1.0);
            for axis in 0..3 {
                let x: f64 = parents.iter().map(|p| p.weight * 2.0 * f64::from(p.node[axis])).sum();
                assert_eq!(x, f64::from(node[axis]));
                for p in &parents {
                    assert_eq!(2 * p.node[axis] as i32 - node[axis] as i32, p.offset[axis]);
                }
            }
        }
    }
}
