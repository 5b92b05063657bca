//! Sums over the material about the points of lines.
use rayon::prelude::*;

use super::probes::{Wanted, of_leaf, reduced};
use crate::grid::leaf_geometry::leaf_box;
use crate::kernel::{BLOCK, Coordinates};
use crate::particle::chunk::Tag;
use crate::probe::line::{Line, Sample, weight};
use crate::solver::state::Solver;

impl<const D: usize> Solver<D> {
    /// Collective. The material about each point of each line, in their order.
    pub fn read_lines(&self, lines: &[Line<D>]) -> Vec<Vec<Sample<D>>> {
        if lines.is_empty() {
            return Vec::new();
        }
        let (physics, chunks, root_edge) = (&self.physics, &self.chunks, self.physics.root_edge);
        let (leaves, coordinates) = (self.forest.leaves(), physics.coordinates);
        let boxes: Vec<([f64; D], [f64; D])> = leaves.iter().map(|leaf| leaf_box(leaf, root_edge)).collect();
        let near = |leaf: usize, point: &[f64; D], reach: f64| {
            let (lower, upper) = &boxes[leaf];
            (0..D).all(|a| lower[a] - reach <= point[a] && point[a] <= upper[a] + reach)
        };
        let points: Vec<(&Line<D>, &[f64; D])> =
            lines.iter().flat_map(|line| line.points.iter().map(move |point| (line, point))).collect();
        let own = points.par_iter().map(|(_, point)| {
            let holding = (0..boxes.len()).filter(|&leaf| near(leaf, point, 0.0));
            holding.map(|leaf| u64::from(leaves[leaf].level)).max().unwrap_or(0)
        });
        let mut levels: Vec<u64> = own.collect();
        self.comm.max_u64(&mut levels);
        let cells: Vec<f64> =
            levels.iter().map(|&level| root_edge / f64::from(1_u32 << level) / BLOCK as f64).collect();
        let wanted = Wanted::of(self, &lines.iter().flat_map(Line::measured).collect::<Vec<_>>());
        let about = |(&(line, point), &cell): (&(&Line<D>, &[f64; D]), &f64)| {
            let leaves = (0..boxes.len()).filter(|&leaf| near(leaf, point, cell));
            let partials = leaves.map(|leaf| {
                let chunk = &chunks[leaf];
                let counts = |p: usize| {
                    let body = Tag::unpack(chunk.tags()[p]).body;
                    line.bodies.as_ref().is_none_or(|bodies| bodies.contains(&body))
                };
                let of = |p: usize| {
                    let x = chunk.position(p);
                    // Rings count by their sections: a mean by volumes would lie further out than the point.
                    if counts(p) { weight(point, &x, cell) / coordinates.around(x[0]) } else { 0.0 }
                };
                of_leaf(physics, chunk, &wanted, of)
            });
            partials.collect::<Vec<_>>()
        };
        let partials: Vec<_> = points.par_iter().zip(&cells).map(about).collect();
        let sums = reduced(&self.comm, partials.into_iter());
        // Share of the weight that lies on this side of the axis.
        let share = |cells: f64| match coordinates {
            Coordinates::Axisymmetric if cells < 1.0 => 0.5 + cells * (1.0 - 0.5 * cells),
            _ => 1.0,
        };
        let all = sums.into_iter().zip(levels).zip(cells).zip(&points);
        let samples = all.map(|(((sums, level), cell), (_, point))| Sample {
            level: level as u8,
            cell: cell.powi(D as i32) * share(point[0] / cell),
            sums,
        });
        let mut samples = samples.collect::<Vec<_>>().into_iter();
        lines.iter().map(|line| samples.by_ref().take(line.points.len()).collect()).collect()
    }
}
