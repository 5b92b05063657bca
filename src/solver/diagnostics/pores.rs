//! Pressure of the water in the pores of particles.
use crate::load::{Load, Water};
use crate::material::undrained::excess_pressure;
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::followed::head;
use crate::quantity::in_job;
use crate::solver::state::Solver;

/// What the pressure in pores follows from, at a time.
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
            let water = water.about(head(chunk, self.head, p, &self.origin));
            let place = in_job(&self.origin, &chunk.position(p));
            water.pressure(place, self.time - load.start, &self.gravity)
        });
        let modulus = self.moduli[usize::from(Tag::unpack(chunk.tags()[p]).material)];
        if modulus == 0.0 {
            return given;
        }
        let component = |c: usize| chunk.column(Layout::<D>::LEFT_CAUCHY_GREEN + c)[p];
        let elastic = std::array::from_fn(|c| if c < Layout::<D>::SYMMETRIC { component(c) } else { 0.0 });
        given + excess_pressure(modulus, &elastic, &chunk.read(Layout::<D>::HISTORY, p))
    }
}
