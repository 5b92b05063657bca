//! Boxes of leaves, and the leaf of a position.
use partition::{MAX_LEVEL, Octant};

/// Key of the finest-level octant that contains a position inside the domain. Leaf membership of particles
/// is defined by this function alone.
pub fn position_key<const D: usize>(position: [f64; D], roots: [u32; D], root_edge: f64) -> u64 {
    let scale = f64::from(1u32 << MAX_LEVEL) / root_edge;
    let coord: [u32; D] = std::array::from_fn(|axis| {
        let last = (roots[axis] << MAX_LEVEL) - 1;
        ((position[axis] * scale) as u32).min(last)
    });
    Octant { level: MAX_LEVEL, coord }.key()
}

/// Lower and upper corner of a leaf relative to the domain's lower corner, m.
pub fn leaf_box<const D: usize>(leaf: &Octant<D>, root_edge: f64) -> ([f64; D], [f64; D]) {
    let edge = root_edge / f64::from(1u32 << leaf.level);
    (leaf.coord.map(|c| f64::from(c) * edge), leaf.coord.map(|c| f64::from(c + 1) * edge))
}
