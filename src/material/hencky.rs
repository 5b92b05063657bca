//! Hencky elasticity: `W = μ Σ ε² + λ/2 (Σ ε)²`, `τ = 2μ ε + λ tr(ε) I` with the logarithmic strain
//! `ε = ½ ln b`. Also the elastic part of the plastic models.
use super::eigen::greatest_bound;
use super::spectral::principal_strains;
use super::{Lame, Law, Material, Response, State, Symmetric};
use crate::kernel::simd::{Lanes, each, widest};

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

impl Hencky {
    /// Shear modulus, Pa.
    pub(super) fn shear_modulus(&self) -> f64 {
        self.lame.mu
    }

    /// Principal Kirchhoff stresses.
    #[inline(always)]
    pub(super) fn principal_stresses(&self, strain: &[Lanes; 3]) -> [Lanes; 3] {
        let pressure = (strain[0] + strain[1] + strain[2]) * self.lame.lambda;
        each(*strain, |e| e.mul_add(Lanes::splat(2.0 * self.lame.mu), pressure))
    }

    /// Bound of the wave speeds: along a principal direction `ρ₀ c² = s² ∂P/∂F = λ + 2μ - τ`, greatest
    /// where the stress is most compressive.
    #[inline(always)]
    pub(super) fn wave_speed_under(&self, stress: &Symmetric) -> Lanes {
        let compression = greatest_bound(&each(*stress, |s| -s)).max(Lanes::splat(0.0));
        ((compression + Lanes::splat(self.lame.pressure_wave())) * (1.0 / self.density)).sqrt()
    }
}

impl Law for Hencky {
    #[inline(always)]
    fn respond(&self, state: &mut State, plane: bool) {
        let (eigen, strain) = principal_strains(&state.elastic, plane);
        state.stress = eigen.compose(&self.principal_stresses(&strain), plane);
        state.wave_speed = self.wave_speed_under(&state.stress);
        state.work = Lanes::splat(0.0);
    }
}

impl Material for Hencky {
    fn update(&self, state: &mut State, plane: bool) {
        widest(Response(self, state, plane));
    }

    fn energy(&self, b: &Symmetric, plane: bool) -> Lanes {
        let (_, e) = principal_strains(b, plane);
        let trace = e[0] + e[1] + e[2];
        (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) * self.lame.mu + trace * trace * (0.5 * self.lame.lambda)
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.lame.pressure_wave() / self.density).sqrt()
    }
}
