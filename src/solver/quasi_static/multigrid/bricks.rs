//! Cells as finite elements: their mean tangents, and their stiffness.
//!
//! A particle shares its tangent out to the cells that its box overlaps, by volume; the parts may belong to
//! other leaves and ranks. Sums over ranks are sums of whole numbers, so their order does not matter.
use partition::comm::Comm;
use partition::{Forest, MAX_LEVEL};
use rayon::prelude::*;

use super::everywhere::{all_of, whole_unit};
use super::lattice::{Cell, overlaps, slope, weight};
use crate::grid::plan::GridPlan;
use crate::grid::plan::ghost_layer::Cover;
use crate::kernel::{BLOCK, Coordinates, Scheme, Select, domain};
use crate::particle::Chunk;
use crate::particle::chunk::Layout;
use crate::particle::volume::box_volume;
use crate::simd::{LANES, Lanes, Vector};
use crate::solver::quasi_static::points::{Matrix, Points};

/// A part of the box of a particle.
struct Part {
    particle: u32,
    /// Of the cells of its leaf.
    cell: u32,
    /// Undeformed volume, m³.
    volume: f64,
}

/// The cells that the boxes of a leaf overlap.
struct LeafParts {
    parts: Vec<Part>,
    /// Numbers among the cells of all ranks.
    cells: Vec<u32>,
}

/// All cells with material, of all ranks.
pub(super) struct Bricks<const D: usize> {
    pub(super) cells: Vec<Cell<D>>,
    leaves: Vec<LeafParts>,
    coordinates: Coordinates,
    has_mean_dilation: bool,
    /// Edge of a finest cell, m.
    unit: f64,
    /// [`Self::points`] away from the axis.
    of_unit_cell: Vec<f64>,
    /// Of each cell: the lower triangle of the tangent times the volume, Pa m³.
    tangents: Vec<f64>,
}

impl<const D: usize> Bricks<D> {
    /// Collective. The cells that the particles of all ranks overlap.
    pub(super) fn new(
        comm: &Comm,
        forest: &Forest<D>,
        chunks: &[Chunk<D>],
        plan: &GridPlan<D>,
        scheme: &Scheme<'_>,
    ) -> Self {
        let unit = plan.cell(MAX_LEVEL);
        let leaves = chunks.par_iter().zip(forest.leaves()).map(|(chunk, leaf)| {
            let (mut half, mut parts, mut cells) = (Vec::new(), Vec::new(), Vec::<Cell<D>>::new());
            if chunk.is_empty() {
                return (parts, cells);
            }
            let cell = plan.cell(leaf.level);
            domain::full_half_widths(chunk, Select::All, cell, &plan.extent(), scheme, &mut half);
            let is_beside_finer = plan.tree.is_beside_finer(leaf.level, leaf.coord);
            let is_finer = |level: u8, at: &[i64; D]| {
                let block = || at.map(|x| x as u32 / BLOCK as u32);
                is_beside_finer && matches!(plan.tree.cover(level, block()), Cover::Finer(_))
            };
            for (p, half) in half.iter().enumerate() {
                let x = chunk.position(p);
                let [reference] = chunk.read(Layout::<D>::HALF, p);
                overlaps(&(x, *half), (leaf.level, cell), &is_finer, &mut |level, at, share| {
                    let edge = 1_i64 << (MAX_LEVEL - level);
                    let found = Cell { edge, lower: at.map(|x| edge * x) };
                    let known = cells.iter().rposition(|cell| *cell == found);
                    let number = known.unwrap_or_else(|| {
                        cells.push(found);
                        cells.len() - 1
                    });
                    let volume = share * box_volume::<D>(reference);
                    parts.push(Part { particle: p as u32, cell: number as u32, volume });
                });
            }
            (parts, cells)
        });
        let leaves: Vec<(Vec<Part>, Vec<Cell<D>>)> = leaves.collect();
        let mut own: Vec<Cell<D>> = leaves.iter().flat_map(|(_, cells)| cells).copied().collect();
        own.sort_unstable();
        own.dedup();
        let words: Vec<i64> =
            own.iter().flat_map(|cell| std::iter::once(cell.edge).chain(cell.lower)).collect();
        let words = all_of(comm, &words);
        let all = words
            .chunks_exact(1 + D)
            .map(|words| Cell { edge: words[0], lower: std::array::from_fn(|a| words[1 + a]) });
        let mut cells: Vec<Cell<D>> = all.collect();
        cells.sort_unstable();
        cells.dedup();
        let number = |cell: &Cell<D>| cells.binary_search(cell).map_or(0, |number| number as u32);
        let leaves = leaves
            .into_iter()
            .map(|(parts, own)| LeafParts { parts, cells: own.iter().map(number).collect() });
        let (leaves, coordinates) = (leaves.collect(), scheme.coordinates);
        let has_mean_dilation = scheme.f_bar;
        let (of_unit_cell, tangents) = (Vec::new(), Vec::new());
        let mut bricks = Self { leaves, cells, coordinates, has_mean_dilation, unit, of_unit_cell, tangents };
        bricks.of_unit_cell = bricks.points(0.0);
        bricks
    }

    /// Components of a displacement gradient: row and column.
    fn components(&self) -> Vec<[usize; 2]> {
        let mut components: Vec<_> = (0..D).flat_map(|m| (0..D).map(move |n| [m, n])).collect();
        if self.coordinates == Coordinates::Axisymmetric {
            components.push([2, 2]);
        }
        components
    }

    /// Collective, with two reductions. Takes the tangents of the particles.
    pub(super) fn collect(&mut self, comm: &Comm, points: &[Vec<Points>]) {
        let components = self.components();
        let size = components.len() * (components.len() + 1) / 2;
        let leaves = self.leaves.par_iter().zip(points).map(|(leaf, points)| {
            let mut sums = vec![0.0; leaf.cells.len() * size];
            let mut tangents: Vec<f64> = Vec::new();
            let mut batch = usize::MAX;
            for part in &leaf.parts {
                let p = part.particle as usize;
                if p / LANES != batch {
                    batch = p / LANES;
                    tangents_of(&points[batch], &components, &mut tangents);
                }
                let own = &tangents[p % LANES * size..][..size];
                let sums = &mut sums[part.cell as usize * size..][..size];
                sums.iter_mut().zip(own).for_each(|(sum, own)| *sum = part.volume.mul_add(*own, *sum));
            }
            sums
        });
        let leaves: Vec<Vec<f64>> = leaves.collect();
        let greatest = leaves.iter().flatten().fold(0.0, |most: f64, value| most.max(value.abs()));
        let unit = whole_unit(comm.max_f64(greatest));
        let mut words = vec![0_i64; self.cells.len() * size];
        for (leaf, sums) in self.leaves.iter().zip(&leaves) {
            for (&cell, sums) in leaf.cells.iter().zip(sums.chunks_exact(size)) {
                let words = &mut words[cell as usize * size..][..size];
                words.iter_mut().zip(sums).for_each(|(word, sum)| *word += (sum * unit) as i64);
            }
        }
        comm.sum_i64(&mut words);
        self.tangents = words.into_iter().map(|word| word as f64 / unit).collect();
    }

    /// Stiffness of a cell, N/m, row by row: from its corners and axes.
    pub(super) fn stiffness(&self, number: usize) -> Vec<f64> {
        let count = self.components().len();
        let mut triangle = self.tangents[number * count * (count + 1) / 2..].iter();
        let mut tangent = vec![0.0; count * count];
        for r in 0..count {
            for (c, value) in (0..=r).zip(&mut triangle) {
                tangent[r * count + c] = *value;
                tangent[c * count + r] = *value;
            }
        }
        let cell = &self.cells[number];
        let edge = cell.edge as f64 * self.unit;
        let own;
        let points = match self.coordinates {
            Coordinates::Cartesian => &self.of_unit_cell,
            Coordinates::Axisymmetric => {
                own = self.points(cell.lower[0] as f64 / cell.edge as f64);
                &own
            }
        };
        let axes = D << D;
        let mut matrix = vec![0.0; axes * axes];
        let mut stress = vec![0.0; count];
        let factor = 1.0 / ((1_u32 << D) as f64 * edge * edge);
        for gradients in points.chunks_exact(axes * count) {
            for (column, gradient) in gradients.chunks_exact(count).enumerate() {
                stress.fill(0.0);
                for (value, tangent) in gradient.iter().zip(tangent.chunks_exact(count)) {
                    if *value != 0.0 {
                        let value = factor * value;
                        stress.iter_mut().zip(tangent).for_each(|(sum, own)| *sum += value * own);
                    }
                }
                for (row, gradient) in gradients.chunks_exact(count).enumerate().skip(column) {
                    let work: f64 = gradient.iter().zip(&stress).map(|(value, stress)| value * stress).sum();
                    matrix[row * axes + column] += work;
                }
            }
        }
        for row in 0..axes {
            (0..row).for_each(|column| matrix[column * axes + row] = matrix[row * axes + column]);
        }
        matrix
    }

    /// By point of Gauss's rule and degree of freedom (corner by corner), the components of its gradient in a
    /// cell of edge 1 m with its lower side at this radius.
    fn points(&self, radius: f64) -> Vec<f64> {
        let count = self.components().len();
        let mut points = Vec::new();
        for point in 0..1_usize << D {
            let share = gauss::<D>(point);
            for (corner, axis) in (0..1_usize << D).flat_map(|corner| (0..D).map(move |axis| (corner, axis)))
            {
                let start = points.len();
                points.resize(start + count, 0.0);
                let slope = slope::<D>(corner, &share);
                points[start + axis * D..][..D].copy_from_slice(&slope);
                if axis == 0 && count > D * D {
                    points[start + D * D] = weight::<D>(corner, &share) / (radius + share[0]);
                }
            }
        }
        if self.has_mean_dilation { self.with_mean_dilation(points, count) } else { points }
    }

    /// With the mean of the dilation of all points at each.
    fn with_mean_dilation(&self, mut points: Vec<f64>, count: usize) -> Vec<f64> {
        let mut normals: Vec<usize> = (0..D).map(|a| a * D + a).collect();
        if self.coordinates == Coordinates::Axisymmetric {
            normals.push(D * D);
        }
        let (axes, number) = (D << D, 1_usize << D);
        for dof in 0..axes {
            let at = |point: usize| (point * axes + dof) * count;
            let dilation =
                |points: &[f64], point: usize| normals.iter().map(|n| points[at(point) + n]).sum::<f64>();
            let mean = (0..number).map(|point| dilation(&points, point)).sum::<f64>() / number as f64;
            for point in 0..number {
                let added = (mean - dilation(&points, point)) / normals.len() as f64;
                normals.iter().for_each(|n| points[at(point) + n] += added);
            }
        }
        points
    }
}

/// Place of a point of Gauss's rule with two points along each axis.
fn gauss<const D: usize>(point: usize) -> [f64; D] {
    let off = 0.5 / 3.0_f64.sqrt();
    std::array::from_fn(|a| if point >> a & 1 == 1 { 0.5 + off } else { 0.5 - off })
}

/// Lower triangles of the tangents of the particles of a batch, one after the other, Pa.
fn tangents_of(points: &Points, components: &[[usize; 2]], out: &mut Vec<f64>) {
    let count = components.len();
    let changes: Vec<Matrix> = components
        .iter()
        .map(|&[m, n]| {
            let mut gradient = [[Lanes::splat(0.0); 3]; 3];
            gradient[m][n] = Lanes::splat(1.0);
            points.change(&gradient)
        })
        .collect();
    out.clear();
    out.resize(LANES * count * (count + 1) / 2, 0.0);
    let mut place = 0;
    for r in 0..count {
        for c in 0..=r {
            let ([i, k], [m, n]) = (components[r], components[c]);
            let mean = Lanes::splat(0.5) * (changes[c][i][k] + changes[r][m][n]);
            for (lane, value) in mean.to_array().into_iter().enumerate() {
                out[lane * count * (count + 1) / 2 + place] = value;
            }
            place += 1;
        }
    }
}
