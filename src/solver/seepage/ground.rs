//! The ground in which water flows: permeabilities of the cells of own leaves, and edges that conduct.
use rayon::prelude::*;

use crate::grid::GridPlan;
use crate::grid::leaf_geometry::{LeafCells, leaf_box};
use crate::kernel::{ARENA_EDGE, BLOCK, Coordinates};
use crate::load::Seepage;
use crate::particle::chunk::{Chunk, Tag};
use crate::particle::volume::volume;

/// Share of a cell from which on it counts as full: boxes of ground that has moved do not tile its cells.
const FULL: f64 = 0.75;
/// Part of its permeability that ground keeps without water.
const DRY: f64 = 1e-4;

/// Cells with ground of own leaves.
pub(super) struct Ground<const D: usize> {
    /// Leaves with ground, ascending.
    pub(super) leaves: Vec<GroundLeaf<D>>,
    /// By own leaf its number among these.
    pub(super) number: Vec<u32>,
}

/// Cells of a leaf, x fastest.
pub(super) struct GroundLeaf<const D: usize> {
    /// Number of the own leaf.
    pub(super) leaf: usize,
    /// Its bin with the block of its own cells.
    pub(super) bin: usize,
    /// Lower corner, m.
    pub(super) corner: [f64; D],
    /// Edge of a cell, m.
    pub(super) cell: f64,
    /// Permeability of the material in each cell times the share of the cell that it fills, m/s; 0 without.
    pub(super) permeability: Vec<f64>,
    /// Part of it that conducts, by the share of the cell below the free surface.
    pub(super) wet: Vec<f64>,
    pub(super) coordinates: Coordinates,
}

/// Distance of the nodes of an arena along an axis.
pub(super) const fn stride(axis: usize) -> usize {
    ARENA_EDGE.pow(axis as u32)
}

/// Node of an arena at the lower corner of a cell.
pub(super) fn first_node<const D: usize>(cell: usize) -> usize {
    (0..D).map(|a| (cell / BLOCK.pow(a as u32) % BLOCK + 1) * stride(a)).sum()
}

/// Distance of a corner of a cell, bit `2^a` above along the axis a, from the lower one.
pub(super) fn to_corner<const D: usize>(corner: usize) -> usize {
    (0..D).filter(|a| corner >> a & 1 == 1).map(stride).sum()
}

impl<const D: usize> Ground<D> {
    /// Not collective. That of the particles of own leaves.
    pub(super) fn of(
        plan: &GridPlan<D>,
        seepage: &Seepage<D>,
        chunks: &[Chunk<D>],
        coordinates: Coordinates,
    ) -> Self {
        let filled = chunks.par_iter().enumerate().filter(|(_, chunk)| !chunk.is_empty());
        let leaves = filled.map(|(leaf, chunk)| GroundLeaf::of(plan, seepage, leaf, chunk, coordinates));
        let leaves: Vec<GroundLeaf<D>> = leaves.collect();
        let mut number = vec![u32::MAX; chunks.len()];
        (0..).zip(&leaves).for_each(|(n, leaf)| number[leaf.leaf] = n);
        Self { leaves, number }
    }
}

impl<const D: usize> GroundLeaf<D> {
    fn of(
        plan: &GridPlan<D>,
        seepage: &Seepage<D>,
        leaf: usize,
        chunk: &Chunk<D>,
        coordinates: Coordinates,
    ) -> Self {
        let octant = &plan.tree.leaves()[plan.tree.first_own() + leaf];
        let bins = plan.leaf_bins(leaf);
        // Every leaf has a bin of its own level.
        let bin = bins.clone().find(|&bin| plan.bins[bin].block == *octant).unwrap_or(bins.start);
        let corners = leaf_box(octant, plan.root_edge);
        let (cells, cell) = (LeafCells::new(&corners), plan.cell(octant.level));
        let mut sums = vec![[0.0; 2]; BLOCK.pow(D as u32)];
        for (p, &tag) in chunk.tags().iter().enumerate() {
            let (material, volume) = (usize::from(Tag::unpack(tag).material), volume(chunk, p));
            let [volumes, products] = &mut sums[cells.cell_of(&chunk.position(p))];
            *volumes += volume;
            *products = volume.mul_add(seepage.permeabilities[material], *products);
        }
        let whole = FULL * cell.powi(D as i32);
        let permeability = |(number, &[volume, product]): (usize, &[f64; 2])| {
            let middle = ((number % BLOCK) as f64 + 0.5).mul_add(cell, corners.0[0]);
            let whole = whole * coordinates.around(middle);
            if volume > 0.0 { product / volume.max(whole) } else { 0.0 }
        };
        Self {
            leaf,
            bin,
            corner: corners.0,
            cell,
            wet: vec![1.0; sums.len()],
            permeability: sums.iter().enumerate().map(permeability).collect(),
            coordinates,
        }
    }

    /// Cells with ground.
    pub(super) fn cells(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.permeability.len()).filter(|&cell| self.permeability[cell] > 0.0)
    }

    /// Calls `each` with the two nodes of each edge of a cell with ground, the lower first, and what it
    /// conducts, m²/s (in plane strain m/s): the quadrature at the corners of the interpolation in the cell.
    /// Of rings an edge along the axis conducts for the half of the cell next to it, one along the radius
    /// over the circumference at its middle.
    pub(super) fn for_each_edge(&self, mut each: impl FnMut(usize, usize, f64)) {
        let area = self.cell.powi(D as i32 - 2) / f64::from(1u32 << (D - 1));
        for cell in self.cells() {
            let (conducts, first) = (self.permeability[cell] * self.wet[cell] * area, first_node::<D>(cell));
            for axis in 0..D {
                for corner in (0..1usize << D).filter(|corner| corner >> axis & 1 == 0) {
                    let low = first + to_corner::<D>(corner);
                    let middle = if axis == 0 { 0.5 } else { 0.25 + 0.5 * f64::from(corner as u32 & 1) };
                    let radius = ((cell % BLOCK) as f64 + middle).mul_add(self.cell, self.corner[0]);
                    each(low, low + stride(axis), conducts * self.coordinates.around(radius));
                }
            }
        }
    }

    /// Moves the parts of cells that conduct half the way to their shares below the free surface: the means
    /// over their edges along the vertical axis of those of still water, by the pressure heads at the nodes,
    /// m. With one share for the mean of all corners the surface would go on swinging.
    pub(super) fn follow_surface(&mut self, vertical: usize, pressure: impl Fn(usize) -> f64) {
        let cells: Vec<usize> = self.cells().collect();
        for cell in cells {
            let first = first_node::<D>(cell);
            let share = |corner: usize| {
                let low = first + to_corner::<D>(corner);
                let mean = 0.5 * (pressure(low) + pressure(low + stride(vertical)));
                (mean / self.cell + 0.5).clamp(0.0, 1.0)
            };
            let edges = (0..1usize << D).filter(|corner| corner >> vertical & 1 == 0);
            let below = edges.map(share).sum::<f64>() / f64::from(1u32 << (D - 1));
            self.wet[cell] = 0.5 * (self.wet[cell] + below.max(DRY));
        }
    }

    /// Head and its gradient at a point of the leaf, from the heads at the nodes, m.
    pub(super) fn head_at(&self, x: &[f64; D], head: impl Fn(usize) -> f64) -> (f64, [f64; D]) {
        let along = |a: usize| (x[a] - self.corner[a]) / self.cell;
        let lower: [usize; D] = std::array::from_fn(|a| (along(a) as usize).min(BLOCK - 1));
        let share: [f64; D] = std::array::from_fn(|a| along(a) - lower[a] as f64);
        let first: usize = (0..D).map(|a| (lower[a] + 1) * stride(a)).sum();
        let (mut value, mut gradient) = (0.0, [0.0; D]);
        for corner in 0..1usize << D {
            let is_upper = |a: usize| corner >> a & 1 == 1;
            let weight = |a: usize| if is_upper(a) { share[a] } else { 1.0 - share[a] };
            let head = head(first + to_corner::<D>(corner));
            value = (0..D).map(weight).product::<f64>().mul_add(head, value);
            for axis in 0..D {
                let others: f64 = (0..D).filter(|&a| a != axis).map(weight).product();
                let slope = others / self.cell;
                gradient[axis] = (if is_upper(axis) { slope } else { -slope }).mul_add(head, gradient[axis]);
            }
        }
        (value, gradient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf() -> GroundLeaf<3> {
        let cells = BLOCK.pow(3);
        GroundLeaf {
            leaf: 0,
            bin: 0,
            corner: [1.0, 2.0, 3.0],
            cell: 0.25,
            permeability: vec![2.0; cells],
            wet: vec![1.0; cells],
            coordinates: Coordinates::Cartesian,
        }
    }

    /// A head at the nodes of an arena that is linear in the place.
    fn linear(node: usize) -> f64 {
        let place: [f64; 3] = std::array::from_fn(|a| {
            (node / stride(a) % ARENA_EDGE) as f64 * 0.25 - 0.25 + [1.0, 2.0, 3.0][a]
        });
        2.0 * place[0] - place[1] + 0.5 * place[2]
    }

    #[test]
    fn linear_heads_are_interpolated_as_they_are() {
        let (value, gradient) = leaf().head_at(&[1.3, 2.9, 3.99], linear);
        assert!((value - (2.6 - 2.9 + 1.995)).abs() < 1e-14, "{value}");
        for (found, exact) in gradient.iter().zip([2.0, -1.0, 0.5]) {
            assert!((found - exact).abs() < 1e-13, "{gradient:?}");
        }
    }

    /// Under still water cells conduct up to its level, of a cell that it passes through the part below.
    #[test]
    fn cells_conduct_below_the_free_surface() {
        let mut leaf = leaf();
        let level = 3.6;
        for _ in 0..60 {
            leaf.follow_surface(2, |node| level - (3.0 + ((node / stride(2)) as f64 - 1.0) * 0.25));
        }
        for (cell, wet) in leaf.wet.iter().enumerate() {
            let exact = [1.0, 1.0, 0.4, DRY][cell / BLOCK.pow(2)];
            assert!((wet - exact).abs() < 1e-12, "cell {cell}: {wet} for {exact}");
        }
    }

    /// Through a section of the leaf flows permeability times gradient times area.
    #[test]
    fn edges_conduct_as_the_ground_between_them() {
        let mut flow = 0.0;
        leaf().for_each_edge(|low, high, conducts| {
            let is_here = high - low == 1 && low % ARENA_EDGE == 2;
            flow += if is_here { conducts * (linear(high) - linear(low)) } else { 0.0 };
        });
        assert!((flow - 2.0 * 2.0).abs() < 1e-12, "{flow}");
    }
}
