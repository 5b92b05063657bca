//! Boxes of leaves and their cells, and the leaf of a position.
use partition::{MAX_LEVEL, Octant};

use crate::kernel::BLOCK;

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

/// The cells of a leaf.
#[derive(Clone, Copy, Debug)]
pub struct LeafCells<const D: usize> {
    lower: [f64; D],
    cells_per_metre: f64,
}

impl<const D: usize> LeafCells<D> {
    /// Of a leaf with these lower and upper corners, m.
    pub fn new((lower, upper): &([f64; D], [f64; D])) -> Self {
        Self { lower: *lower, cells_per_metre: BLOCK as f64 / (upper[0] - lower[0]) }
    }

    /// Number of the cell that holds a point of the leaf.
    #[inline]
    pub fn cell_of(&self, x: &[f64; D]) -> usize {
        (0..D).rev().fold(0, |number, axis| {
            let place = ((x[axis] - self.lower[axis]) * self.cells_per_metre) as usize;
            number * BLOCK + place.min(BLOCK - 1)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_belong_to_cells() {
        let cells = LeafCells::new(&([1.0, 2.0, 3.0], [3.0, 4.0, 5.0]));
        assert_eq!(cells.cell_of(&[1.0, 2.0, 3.0]), 0);
        assert_eq!(cells.cell_of(&[1.6, 2.0, 3.0]), 1);
        assert_eq!(cells.cell_of(&[1.0, 3.1, 4.9]), 2 * 4 + 3 * 16);
    }
}
