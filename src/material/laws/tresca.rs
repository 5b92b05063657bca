//! Metal and undrained clay: Hencky elasticity with Tresca yield, in Kirchhoff stress: `τ₁ - τ₃ ≤ σ_y`,
//! associated flow; the limit of Mohr-Coulomb without friction, with cohesion `σ_y / 2`.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Model;
use super::mohr_coulomb::{MohrCoulomb, Properties};
use crate::material::parameters::OutOfRange;
use crate::material::solid::Hencky;
use crate::material::strength::hardening::{Curve, Hardening};
use crate::material::{HISTORIES, Law, State, Step};
use crate::simd::Vector;

/// Hencky elasticity with Tresca yield.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Young's modulus, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: f64,
    /// Initial yield stress in uniaxial tension, twice the shear strength, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub yield_stress: f64,
    /// How the yield stress changes with plastic strain: a number is the modulus of linear hardening, Pa.
    #[serde(default)]
    pub hardening: Hardening,
}

/// Tresca solid.
#[derive(Clone, Debug)]
pub struct Tresca(MohrCoulomb);

impl Model for Tresca {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        let cohesion = Curve::new(&p.hardening, p.yield_stress, density).halved();
        Self(MohrCoulomb(Properties::of(p.young, p.poisson, density, cohesion)))
    }

    fn boxed(p: &Parameters, density: f64) -> Box<dyn crate::material::Material> {
        let Self(MohrCoulomb(properties)) = Self::new(p, density);
        properties.boxed()
    }

    fn check(p: &Parameters) -> Result<(), OutOfRange> {
        p.hardening.check(p.yield_stress)
    }

    fn weakened(p: &Parameters, factor: f64) -> Option<Parameters> {
        let hardening = p.hardening.weakened(factor);
        Some(Parameters { yield_stress: p.yield_stress / factor, hardening, ..p.clone() })
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'tresca', young = 1e6, poisson = 0.3, yield_stress = 1e3",
            "model = 'tresca', young = 1e6, poisson = 0.3, yield_stress = 1e3, \
             hardening = {kind = 'ludwik', modulus = 2e4, exponent = 0.5}",
            "model = 'tresca', young = 1e6, poisson = 0.3, yield_stress = 1e3, \
             hardening = {kind = 'johnson_cook', modulus = 3e4, exponent = 0.31, rate_factor = 0.025, \
             thermal_exponent = 1.09, melting_temperature = 1356.0, specific_heat = 383.0}",
        ]
    }
}

impl Law for Tresca {
    const HISTORIES: usize = <MohrCoulomb as Law>::HISTORIES;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        self.0.respond(state, step);
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        Law::energy(&self.0, state, plane)
    }

    fn density(&self) -> f64 {
        Law::density(&self.0)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(&self.0)
    }

    fn history_names(&self) -> &'static [&'static str] {
        Law::history_names(&self.0)
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        Law::initial_history(&self.0)
    }

    fn is_firm(&self) -> bool {
        true
    }

    fn softens(&self) -> bool {
        Law::softens(&self.0)
    }

    fn solid(&self) -> Option<&Hencky> {
        self.0.solid()
    }
}
