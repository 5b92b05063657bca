//! Choice of the time step.
use rayon::prelude::*;

use crate::material::{self, HISTORIES, State, Step};
use crate::particle::chunk::{Chunk, Layout, TILE, Tag};
use crate::simd::{Lanes, Vector};
use crate::solver::physics::Physics;
use crate::solver::state::Solver;
use crate::source::Source;

impl<const D: usize> Solver<D> {
    /// Length of the next step: the bound from all particles, the job's limits, and `limit`.
    pub(in crate::solver) fn choose_dt(&self, limit: f64) -> f64 {
        let control = &self.physics.control;
        if self.physics.quasi_static.is_some() {
            // Equal steps up to what is due, and none that only rounding has left over.
            let bound = self.clock.bound.min(control.dt_max.unwrap_or(f64::INFINITY));
            return limit / (limit / bound - 1e-9).ceil().max(1.0);
        }
        let bound = if self.clock.bound.is_finite() { self.clock.bound } else { self.free_bound() };
        let bound = bound.min(self.physics.source_bound(self.clock.time));
        let mut dt = bound.min(control.dt_max.unwrap_or(f64::INFINITY));
        // Without a bound from material, a longer step disturbs nothing.
        if self.clock.dt > 0.0 && self.clock.bound.is_finite() {
            dt = dt.min(control.growth * self.clock.dt);
        }
        dt.min(limit)
    }

    /// Courant bound of this rank's particles: the finest cell that the particles of a leaf touch, over the
    /// sum of wave speed and particle speed; also, gravity may move a particle at rest by at most that share
    /// of a cell, `g Δt² ≤ cfl h`. Colliders bound the step as well. With mass scaling by s, waves and falls
    /// are slower by √s.
    pub(in crate::solver) fn local_bound(&self) -> f64 {
        if self.physics.quasi_static.is_some() {
            return self.equilibrium.next_load_step;
        }
        let plan = &self.grid.plan;
        // Scaled so that no square overflows.
        let gravity = self.physics.gravity.at(self.clock.time);
        let greatest = gravity.iter().fold(0.0, |greatest: f64, g| greatest.max(g.abs()));
        let gravity = match greatest > 0.0 {
            true => greatest * gravity.iter().map(|g| (g / greatest) * (g / greatest)).sum::<f64>().sqrt(),
            false => 0.0,
        };
        let particles = self.leaf_data.signal.iter().enumerate().filter(|(_, signal)| **signal > 0.0).fold(
            f64::INFINITY,
            |bound, (leaf, signal)| {
                let length = self.physics.control.cfl * plan.finest_cell(leaf);
                let slowed = self.physics.mass_scale(plan.finest_level(leaf)).map_or(1.0, f64::sqrt);
                bound.min(slowed * length / signal).min(slowed * (length / gravity).sqrt())
            },
        );
        particles.min(self.collider_bound())
    }

    /// Not collective. Greatest sum of wave speed and particle speed in each own leaf, m/s, from the
    /// materials at rest: quick, for each change of the tree.
    pub(in crate::solver) fn signals_at_rest(&self) -> Vec<f64> {
        let (physics, plan) = (&self.physics, &self.grid.plan);
        let signal = |(leaf, chunk): (usize, _)| physics.signal_at_rest(chunk, plan.finest_cell(leaf));
        self.chunks.par_iter().enumerate().with_min_len(64).map(signal).collect()
    }

    /// Not collective. The same with the wave speeds under the stress that the particles have, where these
    /// are greater: for the first step of bodies that begin under stress.
    pub(in crate::solver) fn signals_under_stress(&self) -> Vec<f64> {
        let (physics, plan) = (&self.physics, &self.grid.plan);
        let signal = |(leaf, chunk): (usize, _)| {
            let cell = plan.finest_cell(leaf);
            physics.signal_at_rest(chunk, cell).max(physics.signal_under_stress(chunk, cell))
        };
        self.chunks.par_iter().enumerate().with_min_len(64).map(signal).collect()
    }
}

impl<const D: usize> Physics<D> {
    /// Bound of the sources on a step from a time (s): the Courant bound of the material that enters, or the
    /// time until the next layer if that is longer.
    fn source_bound(&self, time: f64) -> f64 {
        let of_each = self.sources.iter().map(|source| {
            let cell = self.root_edge / f64::from(4_u32 << source.level);
            (self.control.cfl * cell / self.signal_of(source, cell)).max(source.next_layer(time) - time)
        });
        of_each.fold(f64::INFINITY, f64::min)
    }

    /// `c + |v|` of the material of a source, m/s, on cells of edge `cell` (m).
    pub(in crate::solver) fn signal_of(&self, source: &Source<D>, cell: f64) -> f64 {
        let material = &self.materials[usize::from(source.material)];
        let speed = source.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        material.wave_speed() + material.viscous_speed(cell) + speed
    }

    /// Greatest `c + |v|` of a leaf's particles, m/s, with the wave speed c of their material at rest on
    /// cells of edge `cell` (m).
    fn signal_at_rest(&self, chunk: &Chunk<D>, cell: f64) -> f64 {
        let mut fastest: f64 = 0.0;
        for (tile, tags) in tiles_of(chunk) {
            for (&tag, speed) in tags.iter().zip(speeds::<D>(tile)) {
                let material = &self.materials[usize::from(Tag::unpack(tag).material)];
                fastest = fastest.max(material.wave_speed() + material.viscous_speed(cell) + speed);
            }
        }
        fastest
    }

    /// Greatest `c + |v|` of those of a leaf's particles, eight at a time, that are under stress, m/s, on
    /// cells of edge `cell` (m).
    fn signal_under_stress(&self, chunk: &Chunk<D>, cell: f64) -> f64 {
        let mut fastest: f64 = 0.0;
        for (tile, tags) in tiles_of(chunk) {
            let stresses = &tile[Layout::<D>::STRESS..][..Layout::<D>::SYMMETRIC];
            if stresses.iter().any(|line| line[..tags.len()].iter().any(|&stress| stress != 0.0)) {
                let waves = self.waves_under_stress(tile, tags, cell).to_array();
                for (wave, speed) in waves.into_iter().zip(speeds::<D>(tile)).take(tags.len()) {
                    fastest = fastest.max(wave + speed);
                }
            }
        }
        fastest
    }

    /// Wave speeds of the particles of a tile in their present state on cells of edge `cell` (m), m/s.
    fn waves_under_stress(&self, tile: &[[f64; TILE]], tags: &[u64], cell: f64) -> Lanes {
        let mut state = State::new([Lanes::splat(0.0); 6]);
        for c in 0..Layout::<D>::SYMMETRIC {
            state.elastic[c] = Lanes::load(&tile[Layout::<D>::LEFT_CAUCHY_GREEN + c]);
        }
        for h in 0..HISTORIES {
            state.history[h] = Lanes::load(&tile[Layout::<D>::HISTORY + h]);
        }
        let last = tags.len() - 1;
        let index = std::array::from_fn(|lane| Tag::unpack(tags[lane.min(last)]).material);
        material::update(&self.materials, &index, &mut state, &Step { cell, ..Step::rest(D == 2) });
        state.wave_speed
    }
}

/// The tiles of a chunk with the tags of their particles.
fn tiles_of<const D: usize>(chunk: &Chunk<D>) -> impl Iterator<Item = (&[[f64; TILE]], &[u64])> {
    chunk.tiles().chunks_exact(Layout::<D>::REALS).zip(chunk.tags().chunks(TILE))
}

/// Speeds of the particles of a tile, m/s.
fn speeds<const D: usize>(tile: &[[f64; TILE]]) -> [f64; TILE] {
    let velocity = tile[Layout::<D>::VELOCITY..].iter().take(D).map(Lanes::load);
    velocity.fold(Lanes::splat(0.0), |sum, v| v.mul_add(v, sum)).sqrt().to_array()
}
