//! Weakly compressible Newtonian fluid: pressure of Tait's equation `p = K/γ (J^-γ - 1)` and viscous stress
//! `2 η dev D`.
//!
//! The elastic tensor is `J^(2/3) I`, so the deviator of the trial strain is that of the step alone,
//! `Δt dev D`. The viscous stress is explicit in time: a cell of edge h lets a velocity diffuse in
//! `3 h² / (8 ν)`, which bounds the step as if waves were faster by `8 ν / (3 h)`.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::forget_shear;
use crate::material::consolidation::{Consolidation, even_pressure};
use crate::material::laws::Model;
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, PLASTIC_STRAIN, State, Step, eigen};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask, each};

/// Weakly compressible Newtonian fluid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Bulk modulus K at rest, Pa; above 0. Sound travels at `sqrt(K / density)`; ten times the greatest
    /// velocity keeps changes of density near one percent.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub bulk_modulus: f64,
    /// Exponent γ of Tait's equation.
    #[serde(default = "seven")]
    #[schemars(range(max = 20.0), extend("exclusiveMinimum" = 1.0))]
    pub gamma: f64,
    /// Dynamic viscosity η, Pa s.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e9))]
    pub viscosity: f64,
    /// Whether the fluid carries tension. Without, pressure is 0 where it has expanded, as in spray.
    #[serde(default)]
    pub tension: bool,
}

fn seven() -> f64 {
    7.0
}

/// Law of a fluid.
#[derive(Clone, Copy, Debug)]
pub struct Fluid {
    parameters: Parameters,
    density: f64,
}

impl Model for Fluid {
    type Parameters = Parameters;

    fn new(parameters: &Parameters, density: f64) -> Self {
        Self { parameters: *parameters, density }
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'fluid', bulk_modulus = 1e5, viscosity = 0.1",
            "model = 'fluid', bulk_modulus = 1e6, gamma = 4, tension = true",
        ]
    }
}

impl Law for Fluid {
    const HISTORIES: usize = PLASTIC_STRAIN + 1;

    /// Along any direction `ρ₀ c² = J² ∂²W/∂J² = K J^(1-γ)`.
    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let Parameters { bulk_modulus, gamma, viscosity, tension } = self.parameters;
        let zero = V::splat(0.0);
        let strain = Strain::of(&state.elastic, step.plane);
        let volume = exp(strain.trace);
        let stiffness = exp(strain.trace * (1.0 - gamma)) * bulk_modulus;
        let mut pressure = (stiffness - volume * bulk_modulus) * (1.0 / gamma);
        if !tension {
            pressure = pressure.max(zero);
        }
        let rate = if step.dt > 0.0 { 1.0 / step.dt } else { 0.0 };
        let viscous = volume * (2.0 * viscosity * rate);
        state.stress = each(strain.deviator, |component| component * viscous);
        for normal in &mut state.stress[..3] {
            *normal = *normal - pressure;
        }
        forget_shear(state, strain.trace, strain.norm);
        let shear = state.history[PLASTIC_STRAIN];
        state.history[PLASTIC_STRAIN] = strain.norm.mul_add(V::splat(2.0_f64.sqrt()), shear);
        state.work = viscous * strain.norm * strain.norm;
        let sound = (stiffness * (1.0 / self.density)).sqrt();
        state.wave_speed = volume.mul_add(V::splat(Law::viscous_speed(self, step.cell)), sound);
    }

    /// `W = K/γ (J^(1-γ)/(γ-1) + J - γ/(γ-1))`
    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, _plane: bool) -> V {
        let Parameters { bulk_modulus, gamma, tension, .. } = self.parameters;
        let zero = V::splat(0.0);
        let trace = ln(eigen::determinant(&state.elastic)) * 0.5;
        let compressed = exp(trace * (1.0 - gamma)) * (1.0 / (gamma - 1.0));
        let sum = compressed + exp(trace) - V::splat(gamma / (gamma - 1.0));
        let energy = sum.max(zero) * (bulk_modulus / gamma);
        if tension { energy } else { trace.lt(zero).select(energy, zero) }
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.parameters.bulk_modulus / self.density).sqrt()
    }

    fn is_fluid(&self) -> bool {
        true
    }

    fn bears_tension(&self) -> bool {
        self.parameters.tension
    }

    fn viscous_speed(&self, cell: f64) -> f64 {
        8.0 / 3.0 * self.parameters.viscosity / (self.density * cell)
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["shear_strain"]
    }

    fn strain_under(
        &self,
        stress: [f64; 3],
        _consolidation: Option<Consolidation>,
        _history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        // p = K/γ (J^-γ - 1), the same along all directions.
        let pressure = even_pressure(stress)?;
        let Parameters { bulk_modulus, gamma, .. } = self.parameters;
        Some([-libm::log1p(gamma * pressure / bulk_modulus) / (3.0 * gamma); 3])
    }
}
