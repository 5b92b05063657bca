//! Pressure of the water in the pores of particles.
use crate::load::{Load, Water};
use crate::particle::chunk::Chunk;
use crate::particle::pores::{excess_pressure, given_pressure};
use crate::solver::state::Solver;

/// Origin of the pressure in pores at a time.
pub(super) struct Pores<'a, const D: usize> {
    water: Option<(&'a Load<D>, &'a Water)>,
    head: Option<usize>,
    gravity: [f64; D],
    /// Lower corner of the domain, m.
    origin: [f64; D],
    time: f64,
    /// Stiffness of the water that cannot leave, by material, Pa.
    moduli: Vec<f64>,
}

impl<'a, const D: usize> Pores<'a, D> {
    /// Those of the present state.
    pub(super) fn of(solver: &'a Solver<D>) -> Self {
        let (physics, time) = (&solver.physics, solver.clock.time);
        Self {
            water: physics.water_at(time),
            head: physics.followed_columns().head,
            gravity: physics.gravity.at(time),
            origin: physics.origin,
            time,
            moduli: physics.materials.iter().map(|material| material.water_modulus()).collect(),
        }
    }

    /// Pressure in the pores of a particle, Pa: that of the water table or of seepage, and the excess in
    /// undrained ground.
    pub(super) fn pressure(&self, chunk: &Chunk<D>, p: usize) -> f64 {
        let given = self.water.map_or(0.0, |(load, water)| {
            let carried = (self.head, &self.origin);
            given_pressure(water, self.time - load.start, &self.gravity, carried, chunk, p)
        });
        given + excess_pressure(&self.moduli, chunk, p)
    }
}
