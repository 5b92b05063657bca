//! Hencky elasticity: `W = μ Σ ε² + λ/2 (Σ ε)²`, `τ = 2μ ε + λ tr(ε) I` with the logarithmic strain
//! `ε = ½ ln b`. Also the elastic part of the plastic models.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Model;
use crate::material::damage::{Brittle, Damage};
use crate::material::parameters::Lame;
use crate::material::root::increasing_root;
use crate::material::solid::Hencky;
use crate::material::tensor::strain::Strain;
use crate::material::{Consolidation, HISTORIES, Law, State, Step};
use crate::simd::Vector;

/// Hencky elasticity, with or without damage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Young's modulus, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: f64,
    /// Cracks that open beyond a strength; by default there are none.
    #[serde(default)]
    pub damage: Option<Damage>,
}

impl Model for Hencky {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        Self::of(p.young, p.poisson, density)
    }

    fn boxed(p: &Parameters, density: f64) -> Box<dyn crate::material::Material> {
        let solid = Self::new(p, density);
        match &p.damage {
            Some(damage) => Box::new(Brittle::new(solid, p.young, damage)),
            None => Box::new(solid),
        }
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'hencky', young = 1e6, poisson = 0.3",
            "model = 'hencky', young = 1e6, poisson = 0.3, \
             damage = {kind = 'rankine', strength = 2e4, fracture_energy = 1e3}",
            "model = 'hencky', young = 1e6, poisson = 0.3, damage = {kind = 'strain', onset = 0.02, \
             fracture_energy = 1e3, softening = 'exponential_crack_opening', tension_only = false}",
        ]
    }
}

impl Law for Hencky {
    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let strain = Strain::of(&state.elastic, step.plane);
        self.load(state, strain.trace, &strain.deviator);
        state.work = V::splat(0.0);
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        let Strain { trace, norm, .. } = Strain::of(&state.elastic, plane);
        norm * norm * self.lame.mu + trace * trace * (0.5 * self.lame.lambda + self.lame.mu / 3.0)
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.lame.pressure_wave() / self.density).sqrt()
    }

    fn strain_under(
        &self,
        stress: [f64; 3],
        _consolidation: Option<Consolidation>,
        _history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        // 3K θ = exp(θ) tr σ, then dev ε = exp(θ) dev σ / 2μ; in tension up to tr σ = 3K / e.
        let Lame { lambda, mu } = self.lame;
        let three_bulk = 3.0 * lambda + 2.0 * mu;
        let trace = stress.iter().sum::<f64>();
        let range = if trace > 0.0 { [0.0, 1.0] } else { [trace.min(0.0) / three_bulk, 0.0] };
        let volume_log = increasing_root(|log| three_bulk * log - libm::exp(log) * trace, range)?;
        let volume = libm::exp(volume_log);
        Some(stress.map(|s| volume * (s - trace / 3.0) / (2.0 * mu) + volume_log / 3.0))
    }
}
