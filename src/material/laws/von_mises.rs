//! Metal: Hencky elasticity with von Mises yield, isotropic hardening and, if asked for, viscous overstress;
//! radial return in logarithmic strains (Simo 1992).
//!
//! `f = q - σ_y(κ)` with `q = √(3/2) |dev τ|` and `κ̇ = √(2/3) |d_p|`. Linear hardening has the closed form
//! `Δκ = f / (3μ + H)`; otherwise `q - 3μ Δκ = σ_y(κ + Δκ, Δκ/Δt, T)` is solved for `Δκ`.
//!
//! Overstress (Perzyna 1966): `|dev τ| = √(2/3) σ_y + η |d_p|^h` while it flows.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Model;
use super::metal::{Overstress, VonMises};
use crate::material::damage::{Ductile, Failure};
use crate::material::parameters::OutOfRange;
use crate::material::shock::eos::{Eos, Shocked};
use crate::material::solid::Hencky;
use crate::material::strength::hardening::{Curve, Hardening};

/// Hencky elasticity with von Mises yield, isotropic hardening and viscous overstress.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Young's modulus, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: f64,
    /// Initial yield stress in uniaxial tension, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub yield_stress: f64,
    /// How the yield stress changes with plastic strain: a number is the modulus of linear hardening, Pa; 0
    /// is perfect plasticity.
    #[serde(default)]
    pub hardening: Hardening,
    /// Viscosity η of the overstress, Pa s^h: `|dev τ|` exceeds its value at yield by `η |d_p|^h` (Perzyna
    /// 1966). 0: no overstress.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e13))]
    pub viscosity: f64,
    /// Exponent h of the rate in the overstress.
    #[serde(default = "one")]
    #[schemars(range(min = 0.05, max = 10.0))]
    pub rate_exponent: f64,
    /// Equation of state for the pressure, with the heat that shocks make; by default pressure is linear in
    /// the logarithm of the volume.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eos: Option<Eos>,
    /// Failure by plastic strain; by default there is none.
    #[serde(default)]
    pub damage: Option<Failure>,
}

fn one() -> f64 {
    1.0
}

impl Model for VonMises {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        let solid = Hencky::of(p.young, p.poisson, density);
        let curve = Curve::new(&p.hardening, p.yield_stress, density);
        Self::of(solid, curve, Overstress::new(p.viscosity, p.rate_exponent))
    }

    fn boxed(p: &Parameters, density: f64) -> Box<dyn crate::material::Material> {
        let metal = Self::new(p, density);
        match (&p.damage, &p.eos) {
            (Some(failure), _) => Box::new(Ductile::new(metal, failure, &p.hardening)),
            (None, Some(eos)) => Box::new(Shocked::new(metal, eos, &p.hardening)),
            (None, None) => Box::new(metal),
        }
    }

    fn check(p: &Parameters) -> Result<(), OutOfRange> {
        p.hardening.check(p.yield_stress)?;
        p.eos.map_or(Ok(()), |eos| eos.check(p.damage.is_some()))?;
        p.damage.map_or(Ok(()), |failure| failure.check(&p.hardening))
    }

    fn weakened(p: &Parameters, factor: f64) -> Option<Parameters> {
        let hardening = p.hardening.weakened(factor);
        Some(Parameters { yield_stress: p.yield_stress / factor, hardening, ..p.clone() })
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 5e4, hardening = 1e5",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3, hardening = {kind = 'none'}, viscosity = 20.0",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3, viscosity = 30.0, rate_exponent = 0.5",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3, \
             hardening = {kind = 'voce', saturation = 5e3, rate = 10.0, modulus = 1e3}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3, \
             hardening = {kind = 'ludwik', modulus = 2e4, exponent = 0.3}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3, \
             hardening = {kind = 'swift', strain = 0.004, exponent = 0.22}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3, \
             hardening = {kind = 'table', points = [[0.01, 3e3], [0.05, 4e3], [0.2, 4.5e3]]}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 4e4, \
             hardening = {kind = 'linear_softening', residual = 1e4, strain = 0.2}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 4e4, \
             hardening = {kind = 'exponential_softening', residual = 1e4, strain = 0.1, length = 0.2}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3, \
             hardening = {kind = 'johnson_cook', modulus = 3e4, exponent = 0.31, rate_factor = 0.025, \
             thermal_exponent = 1.09, melting_temperature = 1356.0, specific_heat = 383.0}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e4, \
             hardening = {kind = 'ludwik', modulus = 2e4, exponent = 0.3}, \
             damage = {kind = 'johnson_cook', d1 = 0.05, d2 = 0.2, d3 = -2.0, d4 = 0.01}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e4, \
             eos = {kind = 'mie_gruneisen', sound_speed = 30.0, slope = 1.5, gruneisen = 2.0, tension_limit = 3e4}",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e4, \
             hardening = {kind = 'johnson_cook', modulus = 3e4, exponent = 0.31, melting_temperature = 1356.0, specific_heat = 383.0}, \
             eos = {kind = 'mie_gruneisen', sound_speed = 30.0, slope = 1.5, gruneisen = 2.0}",
        ]
    }
}
