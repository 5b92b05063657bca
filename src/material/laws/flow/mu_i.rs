//! Dense granular flow: Hencky elasticity with a friction that grows with the inertial number (Jop, Forterre
//! and Pouliquen 2006; Dunatunga and Kamrin 2015).
//!
//! While it flows `|dev τ|/√2 = μ(I) p` with `μ = μ_s + (μ_2 - μ_s)/(1 + I_0/I)`, `I = γ̇ d/√(p/ρ_s)` and
//! `γ̇ = √2 |dev d_p|`; flow keeps the volume. The implicit step is a quadratic equation for the stress.
//! Where the grains come apart, there is no stress, and the volume gained is stored; the material gives it
//! back before it carries stress again.
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::laws::Model;
use crate::material::parameters::{Lame, OutOfRange};
use crate::material::solid::Hencky;
use crate::material::tensor::strain::Strain;
use crate::material::{Law, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step};
use crate::simd::{Vector, VectorMask};

/// Hencky elasticity with μ(I) friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Young's modulus, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: f64,
    /// Coefficient of friction μ_s of slow flow.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub static_friction: f64,
    /// Coefficient of friction μ_2 of fast flow; at least the static one.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub limit_friction: f64,
    /// Inertial number I_0 at which friction is half way between.
    #[schemars(range(max = 1e3), extend("exclusiveMinimum" = 0.0))]
    pub inertial_number: f64,
    /// Diameter d of the grains, m.
    #[schemars(range(max = 1e3), extend("exclusiveMinimum" = 0.0))]
    pub grain_diameter: f64,
    /// Density ρ_s of the grains, kg/m³: that of the material without its pores.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    pub grain_density: f64,
}

/// Law of dense granular flow.
#[derive(Clone, Copy, Debug)]
pub struct MuI {
    solid: Hencky,
    bulk: f64,
    /// μ_s and μ_2.
    friction: [f64; 2],
    /// `I_0 / (d √ρ_s)`: the rate at which friction is half way between, per root of the pressure.
    rate: f64,
}

impl Model for MuI {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        let lame = Lame::new(p.young, p.poisson);
        Self {
            solid: Hencky::of(p.young, p.poisson, density),
            bulk: lame.lambda + 2.0 / 3.0 * lame.mu,
            friction: [p.static_friction, p.limit_friction],
            rate: p.inertial_number / (p.grain_diameter * p.grain_density.sqrt()),
        }
    }

    fn check(p: &Parameters) -> Result<(), OutOfRange> {
        if p.limit_friction < p.static_friction {
            let range = format!("at least static_friction, {}", p.static_friction);
            return Err(OutOfRange { key: "limit_friction".into(), value: p.limit_friction, range });
        }
        Ok(())
    }

    fn examples() -> &'static [&'static str] {
        &["model = 'mu_i', young = 1e6, poisson = 0.3, static_friction = 0.38, limit_friction = 0.64, \
           inertial_number = 0.279, grain_diameter = 5e-4, grain_density = 2450"]
    }
}

impl Law for MuI {
    const HISTORIES: usize = PLASTIC_VOLUME + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let modulus = self.solid.shear_modulus();
        let (shear, gain) = (state.history[PLASTIC_STRAIN], state.history[PLASTIC_VOLUME]);
        let trial = Strain::of(&state.elastic, step.plane);
        let trace = trial.trace + gain;
        let norm = trial.norm;
        // An unstrained particle is elastic, so that it keeps its bits.
        let apart = zero.lt(trace) | (zero.le(trace) & zero.lt(norm));
        let pressure = (trace * -self.bulk).max(zero);
        let stress = norm * (SQRT_2 * modulus);
        let still = pressure * self.friction[0];
        let flows = !apart & still.lt(stress);
        let returns = zero.lt(gain.abs()) & !apart;
        let changed = apart | flows | returns;
        let mut kept = one;
        state.work = zero;
        if changed.any() {
            // x = |dev τ|/√2 solves γ̇ = b/(G Δt) (x - μ_s p)/(μ_2 p - x) with γ̇ G Δt = x_trial - x.
            let limit = pressure * self.friction[1];
            let b = pressure.sqrt() * (self.rate * modulus * step.dt);
            let distance = stress - limit + b;
            let root = distance.mul_add(distance, b * (limit - still) * 4.0).sqrt();
            let end = (stress * limit + b * still) * 2.0 / (stress + limit + b + root);
            kept = apart.select(zero, flows.select(end / stress, one));
            let slip = apart.select(norm, flows.select((stress - end) * (FRAC_1_SQRT_2 / modulus), zero));
            state.history[PLASTIC_STRAIN] = shear + slip;
            // Once the material is closed no gain is left.
            let opened = apart.select(gain + trial.trace, zero);
            state.history[PLASTIC_VOLUME] = changed.select(opened, gain);
            state.work = flows.select(end * slip * SQRT_2, zero).max(zero);
        }
        let trace = apart.select(zero, trace);
        trial.finish(&self.solid, state, [trace, kept], changed, apart, step.plane);
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        self.solid.energy(state, plane)
    }

    fn density(&self) -> f64 {
        Law::density(&self.solid)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(&self.solid)
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["plastic_shear_strain", "volume_gain"]
    }

    fn solid(&self) -> Option<&Hencky> {
        Some(&self.solid)
    }
}
