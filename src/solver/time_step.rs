//! Choice of the time step.
use rayon::prelude::*;

use super::{Physics, Solver};
use crate::kernel::simd::{LANES, Lanes};
use crate::particle::chunk::{Chunk, Layout, Tag};

/// Limits on the time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepControl {
    /// Courant number: share of a cell that a wave may cross in a step.
    pub cfl: f64,
    /// Longest step, s.
    pub dt_max: Option<f64>,
    /// Most that a step may exceed the one before, as a factor.
    pub growth: f64,
}

impl<const D: usize> Solver<D> {
    /// Length of the next step: the bound from all particles, the job's limits, and `limit`.
    pub(super) fn choose_dt(&self, limit: f64) -> f64 {
        let control = &self.physics.control;
        let mut dt = self.clock.bound.min(control.dt_max.unwrap_or(f64::INFINITY));
        if self.clock.dt > 0.0 {
            dt = dt.min(control.growth * self.clock.dt);
        }
        dt.min(limit)
    }

    /// Courant bound of this rank's particles: the finest cell that the particles of a leaf touch, over
    /// the sum of wave speed and particle speed. Colliders bound it as well.
    pub(super) fn local_bound(&self) -> f64 {
        let plan = &self.grid.plan;
        let particles = self.signal.iter().enumerate().filter(|(_, signal)| **signal > 0.0).fold(
            f64::INFINITY,
            |bound, (leaf, signal)| {
                let finest = plan.bins[plan.leaf_bins(leaf)].iter().map(|bin| bin.block.level).max();
                bound.min(self.physics.control.cfl * plan.cell(finest.unwrap_or(0)) / signal)
            },
        );
        particles.min(self.collider_bound())
    }

    /// Not collective. Greatest sum of wave speed and particle speed in each own leaf, from the materials at rest.
    pub(super) fn signals_at_rest(&self) -> Vec<f64> {
        let physics = &self.physics;
        self.chunks.par_iter().with_min_len(64).map(|chunk| physics.signal_at_rest(chunk)).collect()
    }
}

impl<const D: usize> Physics<D> {
    fn signal_at_rest(&self, chunk: &Chunk<D>) -> f64 {
        let material = |tag: u64| usize::from(Tag::unpack(tag).material);
        let (mut signal, mut first) = (0.0, 0);
        // One root for each run of particles of one material.
        while let Some(&tag) = chunk.tags().get(first) {
            let own = material(tag);
            let rest = &chunk.tags()[first..];
            // Mostly all, which is seen without a branch for each.
            let run = match rest.iter().fold(true, |all, &tag| all & (material(tag) == own)) {
                true => rest.len(),
                false => rest.iter().take_while(|&&tag| material(tag) == own).count(),
            };
            let end = first + run;
            let greatest = greatest_square::<D>(std::array::from_fn(|axis| {
                &chunk.column(Layout::<D>::VELOCITY + axis)[first..end]
            }));
            signal = f64::max(signal, self.materials[own].wave_speed() + greatest.sqrt());
            first = end;
        }
        signal
    }
}

/// Greatest square of some vectors, whose components come axis by axis.
fn greatest_square<const D: usize>(vectors: [&[f64]; D]) -> f64 {
    let columns = vectors.map(|column| column.as_chunks::<LANES>());
    let mut most = Lanes::splat(0.0);
    for batch in 0..columns[0].0.len() {
        let square = columns.iter().fold(Lanes::splat(0.0), |sum, (batches, _)| {
            let along = Lanes::load(&batches[batch]);
            along.mul_add(along, sum)
        });
        most = square.max(most);
    }
    let rest = (0..columns[0].1.len())
        .map(|p| columns.iter().fold(0.0, |sum, (_, rest)| f64::mul_add(rest[p], rest[p], sum)));
    most.to_array().into_iter().chain(rest).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greatest_squares_of_any_number() {
        for count in 0..40 {
            let along = |factor: usize| (0..count).map(|i| ((i * factor + 3) % 40) as f64 - 20.0).collect();
            let [x, y]: [Vec<f64>; 2] = [7, 11].map(along);
            let squares = x.iter().zip(&y).map(|(x, y)| x * x + y * y);
            assert_eq!(greatest_square([&x, &y]), squares.fold(0.0, f64::max));
        }
    }
}
