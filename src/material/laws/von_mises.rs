//! Hencky elasticity with von Mises yield and linear isotropic hardening; radial return in logarithmic
//! strains (Simo 1992).
//!
//! `f = |dev τ| - √(2/3) (σ_y + H κ)`, closed form: `Δγ = f / (2μ + 2H/3)`, `Δκ = √(2/3) Δγ`.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Model;
use super::hencky::Hencky;
use crate::material::tensor::strain::Strain;
use crate::material::{Law, PLASTIC_STRAIN, State, Step};
use crate::simd::{Vector, VectorMask};

/// Hencky elasticity with von Mises yield and linear isotropic hardening.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// Linear hardening modulus, Pa; 0 is perfect plasticity.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e13))]
    pub hardening: f64,
}

/// Von Mises solid.
#[derive(Clone, Copy, Debug)]
pub struct VonMises {
    solid: Hencky,
    yield_stress: f64,
    hardening: f64,
}

impl Model for VonMises {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        let solid = Hencky::of(p.young, p.poisson, density);
        Self { solid, yield_stress: p.yield_stress, hardening: p.hardening }
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3",
            "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 5e4, hardening = 1e5",
        ]
    }
}

impl Law for VonMises {
    const HISTORIES: usize = PLASTIC_STRAIN + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let root = (2.0_f64 / 3.0).sqrt();
        let mu = self.solid.shear_modulus();
        let trial = Strain::of(&state.elastic, step.plane);
        let radius =
            |kappa: V| kappa.mul_add(V::splat(root * self.hardening), V::splat(root * self.yield_stress));
        let excess = trial.norm.mul_add(V::splat(2.0 * mu), -radius(state.history[PLASTIC_STRAIN]));
        let flows = zero.lt(excess);
        let mut kept = one;
        state.work = zero;
        if flows.any() {
            let flow = excess * (1.0 / (2.0 * mu + 2.0 / 3.0 * self.hardening));
            kept = flows.select(one - flow / trial.norm, one);
            let kappa = flow.mul_add(V::splat(root), state.history[PLASTIC_STRAIN]);
            state.history[PLASTIC_STRAIN] = flows.select(kappa, state.history[PLASTIC_STRAIN]);
            state.work = flows.select(radius(kappa) * flow, zero);
        }
        trial.finish(&self.solid, state, [trial.trace, kept], flows, V::Mask::from_bits(0), step.plane);
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
        &["plastic_strain"]
    }
}
