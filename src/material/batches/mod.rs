//! Laws as the solver calls them: once for each batch of particles.
//!
//! | file | content |
//! |---|---|
//! | `mod.rs` | the trait of materials, for any law |
//! | `advance.rs` | all of an update |
//! | `tangent.rs` | derivatives of the stress by the deformation |
use self::advance::advance;
pub use self::tangent::Tangent;
use super::consolidation::Consolidation;
use super::{HISTORIES, Law, PLASTIC_STRAIN, State, Step};
use crate::simd::{Kernel, Lanes, Vector, widest};

pub(super) mod advance;
mod tangent;

/// A constitutive model with its parameters, called once for each batch of particles.
pub trait Material: std::fmt::Debug + Send + Sync {
    /// From the trial elastic tensor to the final one, stress, history, work and wave speed.
    fn update(&self, state: &mut State, step: &Step);

    /// Derivative of the Kirchhoff stress at the end of an update by the deformation there; arguments as of
    /// [`Material::update`], before it. Without artificial viscosity.
    fn tangent(&self, trial: &State, step: &Step) -> Tangent;

    /// Elastic energy per reference volume, J/m³, of elastic tensor and history. `plane` says that the
    /// components xz and yz of all tensors are zero.
    fn energy(&self, state: &State, plane: bool) -> Lanes;

    /// Density of the undeformed material, kg/m³.
    fn density(&self) -> f64;

    /// Greatest wave speed of the undeformed material, m/s.
    fn wave_speed(&self) -> f64;

    /// Addition to the wave speed of the undeformed material on cells of edge `cell` (m) with which explicit
    /// viscous stress is stable, m/s.
    fn viscous_speed(&self, cell: f64) -> f64;

    /// Pressure of the undeformed material, Pa: that of a gas; 0 for all that is at rest without stress.
    fn rest_pressure(&self) -> f64 {
        0.0
    }

    /// Names of the history variables in use, at most [`HISTORIES`]. The first, if there are any, is a
    /// measure of plastic strain; the second, if there are two, the logarithm of the plastic volume ratio;
    /// more belong to the model.
    fn history_names(&self) -> &'static [&'static str];

    /// As [`Material::history_names`], without that of water in the pores.
    fn skeleton_history(&self) -> &'static [&'static str] {
        self.history_names()
    }

    /// History variables of an undeformed particle.
    fn initial_history(&self) -> [f64; HISTORIES];

    /// Changes the history of an undeformed particle by its place in the job (m) and the time (s) at which it
    /// begins.
    fn place_history(&self, _place: &[f64], _time: f64, _history: &mut [f64; HISTORIES]) {}

    /// Stiffness of water that cannot leave the pores, Pa; 0 where there is none (see [`super::undrained`]).
    fn water_modulus(&self) -> f64 {
        0.0
    }

    /// Whether it asks for the size of cells ([`Step::size`]).
    fn softens(&self) -> bool;

    /// Whether it is a fluid: its particles move freely among each other, and its elastic state is its volume
    /// alone.
    fn is_fluid(&self) -> bool;

    /// Whether it is elastic up to a yield stress that does not depend on the pressure: metals, and clay that
    /// is not drained.
    fn is_firm(&self) -> bool;

    /// Whether a fluid bears tension.
    fn bears_tension(&self) -> bool;

    /// Principal logarithmic strains, elastic, under principal Cauchy stresses (Pa), without yield; `None`
    /// where there are none. The volume is that of these strains and of the plastic volume in `history`,
    /// which holds the initial values; a law that is consolidated changes them to the requested values.
    fn strain_under(
        &self,
        stress: [f64; 3],
        consolidation: Option<Consolidation>,
        history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]>;

    /// Whether it has a preconsolidation pressure that a job may give.
    fn consolidates(&self) -> bool;

    /// Whether particles with these histories may become one, beside the limits of a job for plastic strain
    /// and volume: unlike damage does not mix.
    fn alike(&self, a: &[f64; HISTORIES], b: &[f64; HISTORIES]) -> bool;

    /// Whether a particle with this history has failed: its damage is complete.
    fn has_failed(&self, _history: &[f64; HISTORIES]) -> bool {
        false
    }

    /// True for models that flow: they have history, do plastic work, and their stretch since the
    /// start is unbounded.
    fn is_plastic(&self) -> bool {
        self.history_names().len() > PLASTIC_STRAIN
    }

    /// Whether a body keeps its shape until it yields under its loads: elastic material, metals and clay, not
    /// what flows or breaks.
    fn keeps_its_shape(&self) -> bool {
        !self.is_fluid() && (!self.is_plastic() || self.is_firm())
    }
}

impl<L: Law> Material for L {
    fn update(&self, state: &mut State, step: &Step) {
        widest(Response(self, state, step));
    }

    fn tangent(&self, trial: &State, step: &Step) -> Tangent {
        tangent::of(self, trial, step)
    }

    fn energy(&self, state: &State, plane: bool) -> Lanes {
        Law::energy(self, state, plane)
    }

    fn density(&self) -> f64 {
        Law::density(self)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(self)
    }

    fn viscous_speed(&self, cell: f64) -> f64 {
        Law::viscous_speed(self, cell)
    }

    fn rest_pressure(&self) -> f64 {
        Law::rest_pressure(self)
    }

    fn history_names(&self) -> &'static [&'static str] {
        Law::history_names(self)
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        Law::initial_history(self)
    }

    fn place_history(&self, place: &[f64], time: f64, history: &mut [f64; HISTORIES]) {
        Law::place_history(self, place, time, history);
    }

    fn softens(&self) -> bool {
        Law::softens(self)
    }

    fn is_fluid(&self) -> bool {
        Law::is_fluid(self)
    }

    fn is_firm(&self) -> bool {
        Law::is_firm(self)
    }

    fn bears_tension(&self) -> bool {
        Law::bears_tension(self)
    }

    fn strain_under(
        &self,
        stress: [f64; 3],
        consolidation: Option<Consolidation>,
        history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        Law::strain_under(self, stress, consolidation, history)
    }

    fn consolidates(&self) -> bool {
        Law::consolidates(self)
    }

    fn alike(&self, a: &[f64; HISTORIES], b: &[f64; HISTORIES]) -> bool {
        Law::alike(self, a, b)
    }

    fn has_failed(&self, history: &[f64; HISTORIES]) -> bool {
        Law::has_failed(self, history)
    }
}

/// A [`Law`] with its arguments, to be compiled for several instruction sets.
struct Response<'a, L>(&'a L, &'a mut State, &'a Step);

impl<L: Law> Kernel for Response<'_, L> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self(law, state, step) = self;
        let mut own = state.read::<V>(L::HISTORIES);
        advance(law, &mut own, step);
        state.write(&own, L::HISTORIES, step.shock.is_some());
    }
}
