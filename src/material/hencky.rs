//! Hencky elasticity: `W = μ Σ ε² + λ/2 (Σ ε)²`, `τ = 2μ ε + λ tr(ε) I` with the logarithmic strain
//! `ε = ½ ln b`. Also the elastic part of the plastic models.
use super::eigen::{Eigen, decompose, greatest_bound};
use super::{Lame, Material, State, Symmetric};
use crate::kernel::math::ln;
use crate::kernel::simd::Lanes;

/// Hencky solid.
#[derive(Clone, Copy, Debug)]
pub struct Hencky {
    lame: Lame,
    density: f64,
}

impl Hencky {
    /// From elastic constants and density, kg/m³.
    pub fn new(lame: Lame, density: f64) -> Self {
        Self { lame, density }
    }
}

/// Principal logarithmic strains of `b`, with its decomposition.
#[inline(always)]
pub(super) fn principal_strains(b: &Symmetric, plane: bool) -> (Eigen, [Lanes; 3]) {
    let eigen = decompose(b, plane);
    (eigen, eigen.value.map(|value| ln(value) * 0.5))
}

/// Principal Kirchhoff stresses.
#[inline(always)]
pub(super) fn principal_stresses(lame: &Lame, strain: &[Lanes; 3]) -> [Lanes; 3] {
    let pressure = (strain[0] + strain[1] + strain[2]) * lame.lambda;
    strain.map(|e| e.mul_add(Lanes::splat(2.0 * lame.mu), pressure))
}

/// Elastic energy per reference volume.
#[inline(always)]
pub(super) fn energy(lame: &Lame, b: &Symmetric, plane: bool) -> Lanes {
    let (_, e) = principal_strains(b, plane);
    let trace = e[0] + e[1] + e[2];
    (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) * lame.mu + trace * trace * (0.5 * lame.lambda)
}

/// Bound of the wave speeds: along a principal direction `ρ₀ c² = s² ∂P/∂F = λ + 2μ - τ`, greatest
/// where the stress is most compressive.
#[inline(always)]
pub(super) fn wave_speed(lame: &Lame, density: f64, stress: &Symmetric) -> Lanes {
    let compression = greatest_bound(&stress.map(|s| -s)).max(Lanes::splat(0.0));
    ((compression + Lanes::splat(lame.pressure_wave())) * (1.0 / density)).sqrt()
}

impl Material for Hencky {
    fn update(&self, state: &mut State, plane: bool) {
        let (eigen, strain) = principal_strains(&state.elastic, plane);
        state.stress = eigen.compose(&principal_stresses(&self.lame, &strain), plane);
        state.wave_speed = wave_speed(&self.lame, self.density, &state.stress);
        state.work = Lanes::splat(0.0);
    }

    fn energy(&self, b: &Symmetric, plane: bool) -> Lanes {
        energy(&self.lame, b, plane)
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.lame.pressure_wave() / self.density).sqrt()
    }
}
