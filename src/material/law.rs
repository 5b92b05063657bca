//! Constitutive models: the state that they update, the trait that they implement ([`Law`]) and the trait
//! that the solver calls ([`Material`]).
use super::initial::Consolidation;
use super::laws::hencky::Hencky;
use super::shock::{SHOCK_SUMS, Shock};
use super::tangent::{self, Tangent};
use super::tensor::eigen::Symmetric;
use super::{HISTORIES, PLASTIC_STRAIN};
use crate::simd::{Kernel, LANES, Lanes, Vector, widest};

/// State of a batch of particles. Symmetric tensors have components `xx, yy, zz, xy, xz, yz`.
#[derive(Clone, Copy, Debug)]
pub struct State<V = Lanes> {
    /// Elastic left Cauchy-Green tensor: the trial value before, the final one after an update.
    pub elastic: Symmetric<V>,
    /// Kirchhoff stress after an update, Pa.
    pub stress: Symmetric<V>,
    /// History variables: [`PLASTIC_STRAIN`], [`super::PLASTIC_VOLUME`], then those of the model (see
    /// [`Material::history_names`]).
    pub history: [V; HISTORIES],
    /// Plastic work of the update per reference volume, J/m³; not negative.
    pub work: V,
    /// Upper bound of the wave speeds after an update, m/s.
    pub wave_speed: V,
    /// Work of artificial viscosity in the update per reference volume and the part of it that is heat of the
    /// material, J/m³; written only with such viscosity.
    pub shock: [V; SHOCK_SUMS],
}

impl<V: Vector> State<V> {
    /// A batch at rest with `elastic` as trial value and no history.
    pub fn new(elastic: Symmetric<V>) -> Self {
        let zero = V::splat(0.0);
        Self {
            elastic,
            stress: [zero; 6],
            history: [zero; HISTORIES],
            work: zero,
            wave_speed: zero,
            shock: [zero; SHOCK_SUMS],
        }
    }
}

impl State {
    /// In the registers of a kernel, with the first `histories` history variables.
    #[inline(always)]
    fn read<V: Vector>(&self, histories: usize) -> State<V> {
        let mut state = State::new([V::splat(0.0); 6]);
        for c in 0..6 {
            state.elastic[c] = V::load(self.elastic[c].as_array());
            state.stress[c] = V::load(self.stress[c].as_array());
        }
        for h in 0..HISTORIES {
            if h < histories {
                state.history[h] = V::load(self.history[h].as_array());
            }
        }
        state.work = V::load(self.work.as_array());
        state.wave_speed = V::load(self.wave_speed.as_array());
        state
    }

    /// Takes over the registers of a kernel.
    #[inline(always)]
    fn write<V: Vector>(&mut self, state: &State<V>, histories: usize, shock: bool) {
        for c in 0..6 {
            state.elastic[c].store(self.elastic[c].as_array_mut());
            state.stress[c].store(self.stress[c].as_array_mut());
        }
        for h in 0..HISTORIES {
            if h < histories {
                state.history[h].store(self.history[h].as_array_mut());
            }
        }
        state.work.store(self.work.as_array_mut());
        state.wave_speed.store(self.wave_speed.as_array_mut());
        if shock {
            for (own, work) in self.shock.iter_mut().zip(&state.shock) {
                work.store(own.as_array_mut());
            }
        }
    }
}

/// Arguments of a law beside the state.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Length of the step, s; 0 for an update without increment, in which nothing flows by its rate.
    pub dt: f64,
    /// Whether the components xz and yz of all tensors are zero.
    pub plane: bool,
    /// Edge of the cells on which the particles move, m: bounds the step of viscous flow.
    pub cell: f64,
    /// Edge of the cells that each particle was made for, m: regularises softening. 0: no cells. Set only for
    /// models that ask for it ([`Material::softens`]).
    pub size: [f64; LANES],
    /// Artificial viscosity; `None`: there is none.
    pub shock: Option<Shock>,
}

impl Step {
    /// An update without increment and without cells.
    pub fn rest(plane: bool) -> Self {
        Self { dt: 0.0, plane, cell: f64::INFINITY, size: [0.0; LANES], shock: None }
    }
}

/// A constitutive model for the registers of any instruction set. [`Material`] follows from it.
///
/// Each lane is computed from that lane alone, so the bits of a particle do not depend on its neighbours in
/// the batch.
pub trait Law: std::fmt::Debug + Send + Sync {
    /// History columns that it reads and writes; 0 for laws without history.
    const HISTORIES: usize = 0;

    /// See [`Material::update`]. To be marked `inline(always)`.
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step);

    /// See [`Material::energy`]. To be marked `inline(always)`.
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V;

    /// Takes up heat (J/m³, per reference volume) after an update: that of artificial viscosity. Returns the
    /// part that its energy has then; by default none. To be marked `inline(always)`.
    #[inline(always)]
    fn take_heat<V: Vector>(&self, _state: &mut State<V>, _heat: V) -> V {
        V::splat(0.0)
    }

    /// All of an update: [`Law::respond`] and artificial viscosity.
    #[inline(always)]
    fn advance<V: Vector>(&self, state: &mut State<V>, step: &Step)
    where
        Self: Sized,
    {
        self.respond(state, step);
        if let Some(shock) = &step.shock {
            shock.press(self, state, step);
        }
    }

    /// See [`Material::density`].
    fn density(&self) -> f64;

    /// See [`Material::wave_speed`].
    fn wave_speed(&self) -> f64;

    /// See [`Material::viscous_speed`].
    fn viscous_speed(&self, _cell: f64) -> f64 {
        0.0
    }

    /// See [`Material::rest_pressure`].
    fn rest_pressure(&self) -> f64 {
        0.0
    }

    /// See [`Material::history_names`].
    fn history_names(&self) -> &'static [&'static str] {
        &[]
    }

    /// See [`Material::initial_history`].
    fn initial_history(&self) -> [f64; HISTORIES] {
        [0.0; HISTORIES]
    }

    /// See [`Material::place_history`].
    fn place_history(&self, _place: &[f64], _time: f64, _history: &mut [f64; HISTORIES]) {}

    /// See [`Material::softens`].
    fn softens(&self) -> bool {
        false
    }

    /// See [`Material::is_fluid`].
    fn is_fluid(&self) -> bool {
        false
    }

    /// See [`Material::bears_tension`].
    fn bears_tension(&self) -> bool {
        true
    }

    /// The elastic part of the law, where it is that of Hencky.
    fn solid(&self) -> Option<&Hencky> {
        None
    }

    /// See [`Material::strain_under`]. By default that of [`Law::solid`]; without either, no body of this law
    /// can start under stress.
    fn strain_under(
        &self,
        stress: [f64; 3],
        consolidation: Option<Consolidation>,
        history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        Law::strain_under(self.solid()?, stress, consolidation, history)
    }

    /// See [`Material::consolidates`].
    fn consolidates(&self) -> bool {
        false
    }

    /// See [`Material::alike`].
    fn alike(&self, _a: &[f64; HISTORIES], _b: &[f64; HISTORIES]) -> bool {
        true
    }

    /// See [`Material::has_failed`].
    fn has_failed(&self, _history: &[f64; HISTORIES]) -> bool {
        false
    }
}

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
        law.advance(&mut own, step);
        state.write(&own, L::HISTORIES, step.shock.is_some());
    }
}
