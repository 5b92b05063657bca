//! How full the pores of particles are: weight and inertia change as the water table passes through them.
//!
//! A particle has the mean density of the parts of its box below and above the table. Water that comes or
//! goes has the velocity of the particle, which stays: what it brings is booked.
use rayon::prelude::*;

use crate::exact_sum::ExactSum;
use crate::grid::GridPlan;
use crate::load::{Load, Water};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::followed::head;
use crate::solver::physics::Physics;
use crate::solver::sorting::box_bounds::Widths;
use crate::solver::state::Solver;
use crate::solver::state::phases::Phase;

/// Change of a share below which it is a rounding.
const ROUNDING: f64 = 1e-12;

/// Water that has come into the pores of a particle.
struct Come<const D: usize> {
    place: [f64; D],
    velocity: [f64; D],
    /// Its mass, kg.
    mass: f64,
}

/// The water at a time, and the boxes that it passes through.
struct Table<'a, const D: usize> {
    physics: &'a Physics<D>,
    widths: Widths<'a, D>,
    water: Option<(&'a Load<D>, &'a Water)>,
    head: Option<usize>,
    time: f64,
}

impl<'a, const D: usize> Table<'a, D> {
    fn at(physics: &'a Physics<D>, plan: &'a GridPlan<D>, time: f64) -> Self {
        let (widths, water) = (physics.widths(plan), physics.water_at(time));
        Self { physics, widths, water, head: physics.followed_columns().head, time }
    }

    /// Half widths (m) of the boxes in a leaf with cells of this edge (m), if there is water.
    fn boxes(&self, chunk: &Chunk<D>, cell: f64) -> Vec<[f64; D]> {
        if self.water.is_some() { self.widths.of_leaf(chunk, cell) } else { Vec::new() }
    }

    /// Share of the box of a particle below the table.
    fn share(&self, chunk: &Chunk<D>, p: usize, boxes: &[[f64; D]]) -> f64 {
        let Some((load, water)) = self.water else { return 0.0 };
        let about = water.about(head(chunk, self.head, p, &self.physics.origin));
        let half = boxes[p][water.up.axis];
        let place = load.place(&chunk.position(p), &[0.0; D]).now;
        about.share_below(place, half, self.time - load.start)
    }

    /// Density of the material of a particle with full pores over that without water.
    fn saturated(&self, chunk: &Chunk<D>, p: usize) -> f64 {
        self.physics.saturated[usize::from(Tag::unpack(chunk.tags()[p]).material)]
    }
}

impl<const D: usize> Solver<D> {
    /// Not collective. Notes how full the pores of new particles are, whose masses say so already; the first
    /// ones in each own leaf, as many as `known`, know that. Water that seeps has not come yet.
    pub fn begin_saturation(&mut self, known: &[usize]) {
        let Some(column) = self.physics.followed_columns().saturation else {
            return;
        };
        let table = Table::at(&self.physics, &self.grid.plan, self.clock.time);
        let seeps = self.physics.seepage.is_some();
        let shares = self.chunks.par_iter().zip(known).enumerate().map(|(leaf, (chunk, &known))| {
            let boxes = table.boxes(chunk, self.grid.plan.finest_cell(leaf));
            let share = |p: usize| if seeps { 0.0 } else { table.share(chunk, p, &boxes) };
            (known..chunk.len()).map(share).collect()
        });
        let shares: Vec<Vec<f64>> = shares.collect();
        let carried = self.physics.carried_columns();
        for ((chunk, &known), shares) in self.chunks.iter_mut().zip(known).zip(shares) {
            chunk.carry(carried);
            chunk.carried_mut(column)[known..].copy_from_slice(&shares);
        }
    }

    /// Not collective. Gives particles the masses that they have with the water at a time, s, and books what
    /// has come; not at the start of a run, which begins with it.
    pub fn wet_particles(&mut self, time: f64) {
        let Some(column) = self.physics.followed_columns().saturation else {
            return;
        };
        let table = Table::at(&self.physics, &self.grid.plan, time);
        let (chunks, plan) = (&self.chunks, &self.grid.plan);
        let changes = chunks.par_iter().enumerate().with_min_len(16).map(|(leaf, chunk)| {
            let boxes = table.boxes(chunk, plan.finest_cell(leaf));
            let change = |p: usize| {
                let saturated = table.saturated(chunk, p);
                if saturated == 1.0 {
                    return None;
                }
                let was = chunk.carried(column).get(p).copied().unwrap_or(0.0);
                let share = table.share(chunk, p, &boxes);
                let density = |share: f64| share.mul_add(saturated - 1.0, 1.0);
                ((share - was).abs() > ROUNDING).then(|| (p, share, density(share) / density(was)))
            };
            (0..chunk.len()).filter_map(change).collect()
        });
        let changes: Vec<Vec<(usize, f64, f64)>> = self.phases.time(Phase::Scatter, || changes.collect());
        let (gravity, carried) = (self.physics.gravity.at(time), self.physics.carried_columns());
        for (chunk, changes) in self.chunks.iter_mut().zip(changes) {
            for (p, share, ratio) in changes {
                chunk.carry(carried);
                chunk.carried_mut(column)[p] = share;
                let [mass] = chunk.read::<1>(Layout::<D>::MASS, p);
                chunk.write(Layout::<D>::MASS, p, &[mass * ratio]);
                let (place, velocity) = (chunk.position(p), chunk.read(Layout::<D>::VELOCITY, p));
                let come = Come { place, velocity, mass: mass * ratio - mass };
                self.measured.crossings.fluxes.book_fed(&come.place, come.mass);
                if self.clock.step > 0 {
                    come.book(&mut self.sums.pores.of[0], &gravity);
                }
            }
        }
    }
}

impl<const D: usize> Come<D> {
    /// Adds its mass, momentum and energy to sums.
    fn book(&self, sums: &mut [ExactSum], gravity: &[f64; D]) {
        let Self { place, velocity, mass } = self;
        sums[0].add(*mass);
        let mut energy = 0.0;
        for a in 0..D {
            sums[1 + a].add(mass * velocity[a]);
            energy = (0.5 * velocity[a]).mul_add(velocity[a], energy);
            energy = (-gravity[a]).mul_add(place[a], energy);
        }
        sums[4].add(mass * energy);
    }
}
