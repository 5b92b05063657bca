//! The plane through the corners of the cells next to a node.
/// Reach of the search for the nearest cells: their farthest corner, in cells along each axis.
pub(super) const REACH: i32 = 2;
/// Nodes along an axis at most [`REACH`] away.
const EDGE: usize = 2 * REACH as usize + 1;
/// Nodes in reach, most of which no plane needs.
const WINDOW: usize = EDGE * EDGE * EDGE;

/// Lower corners of the cells in reach of a node that do not touch it, counted from the node, by distance;
/// those of the same distance together.
pub(super) fn rings<const D: usize>() -> Vec<Vec<[i32; D]>> {
    let edge = 2 * REACH;
    let mut all: Vec<(i32, [i32; D])> = (0..edge.pow(D as u32))
        .map(|number| {
            let cell: [i32; D] = std::array::from_fn(|axis| number / edge.pow(axis as u32) % edge - REACH);
            // Twice the distance of the centre, squared.
            (cell.iter().map(|k| (2 * k + 1) * (2 * k + 1)).sum(), cell)
        })
        .filter(|(distance, _)| *distance > D as i32)
        .collect();
    all.sort_unstable();
    all.chunk_by(|a, b| a.0 == b.0).map(|ring| ring.iter().map(|(_, cell)| *cell).collect()).collect()
}

/// Weights of nodes around a node.
pub(super) struct Plane<const D: usize> {
    weights: [f64; WINDOW],
}

impl<const D: usize> Plane<D> {
    /// The mean over some cells, given by their lower corners, of the plane that fits the values at their
    /// corners best: `P_r = 2^-D (1 + 2 Σ_k s_k t_k)`, where s = ±1 says on which side of the cell the corner
    /// lies and t is the place of the node from the cell's centre, in cells. The weights add up to 1 and
    /// their mean place is the node.
    pub(super) fn of(cells: &[[i32; D]]) -> Self {
        let mut weights = [0.0; WINDOW];
        let share = 1.0 / (cells.len() << D) as f64;
        for cell in cells {
            for corner in 0..1usize << D {
                let mut sum = 1.0;
                for (axis, &lower) in cell.iter().enumerate() {
                    let from_centre = -(f64::from(lower) + 0.5);
                    sum += if corner >> axis & 1 == 1 { 2.0 * from_centre } else { -2.0 * from_centre };
                }
                let at = |axis: usize| (cell[axis] + REACH) as usize + (corner >> axis & 1);
                let place: usize = (0..D).map(|axis| at(axis) * EDGE.pow(axis as u32)).sum();
                weights[place] += share * sum;
            }
        }
        Self { weights }
    }

    /// The nodes that have weights, counted from the node, in a fixed order.
    pub(super) fn nodes(&self) -> impl Iterator<Item = ([i32; D], f64)> {
        let used = self.weights.iter().enumerate().filter(|(_, weight)| **weight != 0.0);
        used.map(|(place, &weight)| {
            let along = |axis: usize| (place / EDGE.pow(axis as u32) % EDGE) as i32 - REACH;
            (std::array::from_fn(along), weight)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For any set of cells, values of an affine field reproduce its value at the node.
    fn check_affine<const D: usize>() {
        let rings = rings::<D>();
        assert_eq!(rings.len(), D);
        for cells in rings.iter().flat_map(|ring| (1..=ring.len()).map(|n| &ring[..n])) {
            let plane = Plane::of(cells);
            let sum: f64 = plane.nodes().map(|(_, weight)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-14, "{cells:?}: {sum}");
            for axis in 0..D {
                let mean: f64 = plane.nodes().map(|(node, weight)| weight * f64::from(node[axis])).sum();
                assert!(mean.abs() < 1e-14, "{cells:?}: {mean}");
            }
        }
    }

    #[test]
    fn planes_are_exact_for_affine_fields() {
        check_affine::<2>();
        check_affine::<3>();
    }
}
