//! Water that cannot leave the pores: a law in which it bears a share of the stress.
//!
//! The law of the model sees the effective stress σ'. Water with the bulk modulus K in pores of the porosity
//! n has the excess pressure `u = -(K/n) ln J_c`, with the volume ratio J_c since the ground was
//! consolidated: since the start, or under the initial stress of its body. The total stress is
//! `σ = σ' - u I`, so
//! ```text
//! τ = τ' + (K/n) J ln(J_c) I,   W = W' + (K/n) J/J_c (J_c ln J_c - J_c + 1)
//! ```
//! and along any direction `s² ∂P/∂F` gains `(K/n) J`: `ρ₀ c² = ρ₀ c'² + (K/n) J`.
//!
//! The logarithm of the volume ratio is that of the elastic state and of the plastic volume in the history;
//! its value at consolidation is the history variable that the model leaves free.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::consolidation::Consolidation;
use super::laws::Model;
use super::laws::drucker_prager::DruckerPrager;
use super::laws::mohr_coulomb::MohrCoulomb;
use super::parameters::{OutOfRange, Parameters, ranges};
use super::tensor::eigen::determinant;
use super::{HISTORIES, Material, OWN, PLASTIC_VOLUME, State, Step, Tangent};
use crate::simd::math::{exp, ln};
use crate::simd::{Lanes, Vector};

/// Water in the pores that cannot leave.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Undrained {
    /// Bulk modulus of the water, Pa; 2.2e9 without air.
    #[serde(default = "water")]
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub bulk_modulus: f64,
    /// Porosity, the share of the volume that is pores; above 0 and below 1.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub porosity: f64,
}

fn water() -> f64 {
    2.2e9
}

impl Undrained {
    /// Stiffness K/n of the water, Pa.
    pub fn modulus(&self) -> f64 {
        self.bulk_modulus / self.porosity
    }

    /// Checks the ranges of its keys.
    ///
    /// # Errors
    /// The first key that is out of range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        ranges::check_table(self, "undrained")
    }

    /// Checks that a model, whose parameters are in range, can have water in its pores.
    ///
    /// # Errors
    /// The reason, and what would be right.
    pub fn check_model(model: &Parameters) -> Result<(), &'static str> {
        let skeleton = skeleton(model, 1.0);
        if skeleton.is_fluid() {
            return Err("found it for a fluid, which has no pores; expected it for a solid model: remove it");
        }
        if skeleton.history_names().len() > OWN {
            return Err(
                "found it for a model with three history variables of its own, by heat or consolidation; expected a model that leaves one for the water, such as mohr_coulomb, drucker_prager, tresca, cam_clay or von_mises without johnson_cook",
            );
        }
        Ok(())
    }
}

/// The model with these parameters and the density of the undeformed material, kg/m³, with water in its pores
/// where it is undrained; then the density is that of skeleton and water.
pub fn build(parameters: &Parameters, undrained: Option<&Undrained>, density: f64) -> Box<dyn Material> {
    match undrained {
        None => parameters.build(density),
        Some(water) => {
            Box::new(Saturated { modulus: water.modulus(), skeleton: skeleton(parameters, density) })
        }
    }
}

/// The law of the skeleton of undrained ground. It books no opened volume: where pores are full of water, no
/// gap opens that could close without stress.
pub fn skeleton(parameters: &Parameters, density: f64) -> Box<dyn Material> {
    match parameters {
        Parameters::MohrCoulomb(own) => {
            let own = super::laws::mohr_coulomb::Parameters { volume_correction: false, ..own.clone() };
            MohrCoulomb::boxed(&own, density)
        }
        Parameters::DruckerPrager(own) => {
            let own = super::laws::drucker_prager::Parameters { volume_correction: false, ..own.clone() };
            DruckerPrager::boxed(&own, density)
        }
        other => other.build(density),
    }
}

/// Names of its history variables, by the number of those of the skeleton.
const NAMES: [&[&str]; 2] = [
    &["plastic_strain", "plastic_volume", "consolidation_volume"],
    &["plastic_shear_strain", "plastic_volume", "consolidation_volume"],
];

/// The history variable that is the logarithm of the volume ratio at consolidation.
const CONSOLIDATED: usize = OWN;

/// A solid with water in its pores.
#[derive(Debug)]
struct Saturated {
    /// K/n, Pa.
    modulus: f64,
    skeleton: Box<dyn Material>,
}

/// Logarithm of the volume ratio.
fn volume_log(state: &State) -> Lanes {
    ln(determinant(&state.elastic)).mul_add(Lanes::splat(0.5), state.history[PLASTIC_VOLUME])
}

/// Lets the water of a particle flow until its pressure has no excess: consolidation in the state that it
/// has.
pub fn consolidate(elastic: &[f64; 6], history: &mut [f64; HISTORIES]) {
    let mut state = State::new(elastic.map(Lanes::splat));
    state.history = history.map(Lanes::splat);
    history[CONSOLIDATED] = volume_log(&state).to_array()[0];
}

/// The same with the volume of another history at consolidation.
pub(super) fn consolidate_as(other: &[f64; HISTORIES], history: &mut [f64; HISTORIES]) {
    history[CONSOLIDATED] = other[CONSOLIDATED];
}

/// Excess pore pressure u, Pa, of a particle with this elastic tensor and history, and the stiffness K/n of
/// the water, Pa.
pub fn excess_pressure(modulus: f64, elastic: &[f64; 6], history: &[f64; HISTORIES]) -> f64 {
    let mut state = State::new(elastic.map(Lanes::splat));
    state.history = history.map(Lanes::splat);
    modulus * (history[CONSOLIDATED] - volume_log(&state).to_array()[0])
}

impl Material for Saturated {
    fn update(&self, state: &mut State, step: &Step) {
        let consolidated = state.history[CONSOLIDATED];
        self.skeleton.update(state, step);
        state.history[CONSOLIDATED] = consolidated;
        let log = volume_log(state);
        let stiffness = exp(log) * self.modulus;
        let tension = (log - consolidated) * stiffness;
        for normal in &mut state.stress[..3] {
            *normal += tension;
        }
        let square =
            stiffness.mul_add(Lanes::splat(1.0 / self.density()), state.wave_speed * state.wave_speed);
        state.wave_speed = square.sqrt();
    }

    /// The skeleton keeps the sum of elastic and plastic volume, so the logarithm of J grows with the trace.
    fn tangent(&self, trial: &State, step: &Step) -> Tangent {
        let log = volume_log(trial);
        let ratio_log = log - trial.history[CONSOLIDATED];
        let bulk = (ratio_log + Lanes::splat(1.0)) * exp(log) * self.modulus;
        self.skeleton.tangent(trial, step).with_bulk(bulk)
    }

    fn energy(&self, state: &State, plane: bool) -> Lanes {
        let log = volume_log(state);
        let ratio_log = log - state.history[CONSOLIDATED];
        let one = Lanes::splat(1.0);
        let work = exp(ratio_log).mul_add(ratio_log - one, one) * self.modulus;
        exp(state.history[CONSOLIDATED]).mul_add(work, self.skeleton.energy(state, plane))
    }

    fn density(&self) -> f64 {
        self.skeleton.density()
    }

    fn wave_speed(&self) -> f64 {
        let own = self.skeleton.wave_speed();
        (own * own + self.modulus / self.density()).sqrt()
    }

    fn viscous_speed(&self, cell: f64) -> f64 {
        self.skeleton.viscous_speed(cell)
    }

    fn history_names(&self) -> &'static [&'static str] {
        let is_shear = self.skeleton.history_names().first() == Some(&"plastic_shear_strain");
        NAMES[usize::from(is_shear)]
    }

    fn skeleton_history(&self) -> &'static [&'static str] {
        self.skeleton.history_names()
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        self.skeleton.initial_history()
    }

    fn softens(&self) -> bool {
        self.skeleton.softens()
    }

    fn is_fluid(&self) -> bool {
        false
    }

    fn is_firm(&self) -> bool {
        self.skeleton.is_firm()
    }

    fn bears_tension(&self) -> bool {
        self.skeleton.bears_tension()
    }

    fn strain_under(
        &self,
        stress: [f64; 3],
        consolidation: Option<Consolidation>,
        history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        let strain = self.skeleton.strain_under(stress, consolidation, history)?;
        history[CONSOLIDATED] = strain.iter().sum::<f64>() + history[PLASTIC_VOLUME];
        Some(strain)
    }

    fn consolidates(&self) -> bool {
        self.skeleton.consolidates()
    }

    fn alike(&self, a: &[f64; HISTORIES], b: &[f64; HISTORIES]) -> bool {
        self.skeleton.alike(a, b)
    }

    fn has_failed(&self, history: &[f64; HISTORIES]) -> bool {
        self.skeleton.has_failed(history)
    }

    fn water_modulus(&self) -> f64 {
        self.modulus
    }
}
