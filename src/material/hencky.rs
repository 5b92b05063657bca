//! Hencky elasticity: `W = μ Σ ε² + λ/2 (Σ ε)²`, `τ = 2μ ε + λ tr(ε) I` with the logarithmic strain
//! `ε = ½ ln b`. Also the elastic part of the plastic models.
use super::eigen::greatest_bound;
use super::strain::Strain;
use super::{Lame, Law, Material, Response, State, Symmetric};
use crate::simd::{Lanes, Vector, each, widest};

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

    /// Writes Kirchhoff stress and wave speed of a strain with this trace and this deviator.
    #[inline(always)]
    pub(super) fn load<V: Vector>(&self, state: &mut State<V>, trace: V, deviator: &Symmetric<V>) {
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
        ((compression + V::splat(self.lame.pressure_wave())) * (1.0 / self.density)).sqrt()
    }
}

impl Law for Hencky {
    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, plane: bool) {
        let strain = Strain::of(&state.elastic, plane);
        self.load(state, strain.trace, &strain.deviator);
        state.work = V::splat(0.0);
    }
}

impl Material for Hencky {
    fn update(&self, state: &mut State, plane: bool) {
        widest(Response(self, state, plane));
    }

    fn energy(&self, b: &Symmetric, plane: bool) -> Lanes {
        let Strain { trace, norm, .. } = Strain::of(b, plane);
        norm * norm * self.lame.mu + trace * trace * (0.5 * self.lame.lambda + self.lame.mu / 3.0)
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.lame.pressure_wave() / self.density).sqrt()
    }
}
