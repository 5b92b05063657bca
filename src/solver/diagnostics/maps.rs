//! Depths and speeds over rasters in plan.
use crate::kernel::Coordinates;
use crate::particle::chunk::{Layout, Tag};
use crate::particle::volume::measured_volume;
use crate::probe::Map;
use crate::solver::state::Solver;

/// Bits of each of the two pieces of a volume. Sums of 4 million particles in a cell have room.
const PIECE: f64 = (1_u64 << 40) as f64;

impl<const D: usize> Solver<D> {
    /// Collective. Takes over depths and speeds of the present state where they are larger than those so far.
    /// Volumes are cut to whole multiples of 2^-80 of the domain, so that sums are exact.
    pub fn note_maps(&mut self, maps: &[Map]) {
        let roots = self.forest.brick().roots;
        let (coordinates, root_edge) = (self.physics.coordinates, self.physics.root_edge);
        let domain = roots.iter().map(|&n| f64::from(n) * root_edge).product::<f64>()
            * coordinates.around(0.5 * f64::from(roots[0]) * root_edge);
        for (map, maxima) in maps.iter().zip(&mut self.measured.maxima) {
            let mut pieces = vec![0_i64; 2 * map.len()];
            let mut speeds = vec![0.0_f64; map.len()];
            for chunk in &self.chunks {
                for p in 0..chunk.len() {
                    let Some(cell) = map.cell_of(&chunk.position(p)) else { continue };
                    let body = Tag::unpack(chunk.tags()[p]).body;
                    if map.bodies.as_ref().is_some_and(|bodies| !bodies.contains(&body)) {
                        continue;
                    }
                    let share = measured_volume(chunk, p) / domain * PIECE;
                    pieces[2 * cell] += share.floor() as i64;
                    pieces[2 * cell + 1] += (share.fract() * PIECE) as i64;
                    let velocity: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
                    let speed = velocity.iter().fold(0.0, |sum: f64, v| v.mul_add(*v, sum)).sqrt();
                    speeds[cell] = speeds[cell].max(speed);
                }
            }
            self.comm.sum_i64(&mut pieces);
            self.comm.max_f64s(&mut speeds);
            for (cell, pieces) in pieces.chunks_exact(2).enumerate() {
                let height = domain / area::<D>(map, cell, coordinates);
                let depth = (pieces[1] as f64 / PIECE + pieces[0] as f64) / PIECE * height;
                maxima.depth[cell] = maxima.depth[cell].max(depth);
                maxima.speed[cell] = maxima.speed[cell].max(speeds[cell]);
            }
        }
    }
}

/// Area of a cell of a map, m²; in axisymmetry of the part of its ring beyond the axis.
fn area<const D: usize>(map: &Map, cell: usize, coordinates: Coordinates) -> f64 {
    match coordinates {
        Coordinates::Cartesian => map.area(D),
        Coordinates::Axisymmetric => {
            let edge = |number: usize| map.cell.mul_add(number as f64, map.corner[0]).max(0.0);
            let (inner, outer) = (edge(cell), edge(cell + 1));
            // Cells before the axis have no material.
            (coordinates.around(0.5 * (inner + outer)) * (outer - inner)).max(f64::MIN_POSITIVE)
        }
    }
}
