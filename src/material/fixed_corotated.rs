//! Fixed corotated elasticity: `W = μ Σ (s - 1)² + λ/2 (J - 1)²` with principal stretches s,
//! `τ = 2μ (V² - V) + λ (J - 1) J I` (Stomakhin et al. 2012).
use super::eigen::{decompose, greatest_bound};
use super::{Lame, Law, Material, Response, State, Symmetric};
use crate::simd::{Lanes, Vector, each, widest};

/// Fixed corotated solid.
#[derive(Clone, Copy, Debug)]
pub struct FixedCorotated {
    lame: Lame,
    density: f64,
}

impl FixedCorotated {
    /// From elastic constants and density, kg/m³.
    pub fn new(lame: Lame, density: f64) -> Self {
        Self { lame, density }
    }
}

impl Law for FixedCorotated {
    /// Along a principal direction, `ρ₀ c² = s² ∂P/∂F = 2μ s² + λ J²`.
    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, plane: bool) {
        let Lame { lambda, mu } = self.lame;
        let one = V::splat(1.0);
        let eigen = decompose(&state.elastic, plane);
        let stretch = each(eigen.value, V::sqrt);
        let volume = stretch[0] * stretch[1] * stretch[2];
        let pressure = (volume - one) * volume * lambda;
        let principal = each(stretch, |s| (s * (s - one)).mul_add(V::splat(2.0 * mu), pressure));
        state.stress = eigen.compose(&principal, plane);
        let modulus = greatest_bound(&state.elastic) * (2.0 * mu) + volume * volume * lambda;
        state.wave_speed = (modulus * (1.0 / self.density)).sqrt();
        state.work = V::splat(0.0);
    }
}

impl Material for FixedCorotated {
    fn update(&self, state: &mut State, plane: bool) {
        widest(Response(self, state, plane));
    }

    fn energy(&self, b: &Symmetric, plane: bool) -> Lanes {
        let Lame { lambda, mu } = self.lame;
        let one = Lanes::splat(1.0);
        let stretch = decompose(b, plane).value.map(Lanes::sqrt);
        let excess = stretch.map(|s| (s - one) * (s - one));
        let volume = stretch[0] * stretch[1] * stretch[2] - one;
        (excess[0] + excess[1] + excess[2]) * mu + volume * volume * (0.5 * lambda)
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.lame.pressure_wave() / self.density).sqrt()
    }
}
