//! The Hencky solid: elastic part of all models in logarithmic strains.
use super::State;
use super::parameters::Lame;
use super::tensor::eigen::{Symmetric, greatest_bound};
use crate::simd::{Vector, each};

/// Hencky solid.
#[derive(Clone, Copy, Debug)]
pub struct Hencky {
    pub(super) lame: Lame,
    pub(super) density: f64,
    /// One over the density, m³/kg.
    pub(super) per_density: f64,
}

impl Hencky {
    /// The elastic part of a plastic model: Young's modulus, Pa, Poisson's ratio and density, kg/m³.
    pub(in crate::material) fn of(young: f64, poisson: f64, density: f64) -> Self {
        Self { lame: Lame::new(young, poisson), density, per_density: 1.0 / density }
    }

    /// Shear modulus, Pa.
    pub(in crate::material) fn shear_modulus(&self) -> f64 {
        self.lame.mu
    }

    /// Bulk modulus, Pa.
    pub(in crate::material) fn bulk_modulus(&self) -> f64 {
        self.lame.lambda + 2.0 / 3.0 * self.lame.mu
    }

    /// Writes Kirchhoff stress and wave speed of a strain with this trace and this deviator.
    #[inline(always)]
    pub(in crate::material) fn load<V: Vector>(
        &self,
        state: &mut State<V>,
        trace: V,
        deviator: &Symmetric<V>,
    ) {
        let pressure = trace * (self.lame.lambda + 2.0 / 3.0 * self.lame.mu);
        state.stress = each(*deviator, |component| component * (2.0 * self.lame.mu));
        for normal in &mut state.stress[..3] {
            *normal += pressure;
        }
        state.wave_speed = self.wave_speed_under(&state.stress);
    }

    /// Bound of the wave speeds: along a principal direction `ρ₀ c² = s² ∂P/∂F = λ + 2μ - τ`, greatest
    /// where the stress is most compressive.
    #[inline(always)]
    fn wave_speed_under<V: Vector>(&self, stress: &Symmetric<V>) -> V {
        let compression = greatest_bound(&each(*stress, |s| -s)).max(V::splat(0.0));
        ((compression + V::splat(self.lame.pressure_wave())) * self.per_density).sqrt()
    }
}
