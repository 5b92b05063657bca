//! Fixed corotated elasticity: `W = μ Σ (s - 1)² + λ/2 (J - 1)²` with principal stretches s,
//! `τ = 2μ (V² - V) + λ (J - 1) J I` (Stomakhin et al. 2012).
use super::Model;
use crate::material::Consolidation;
use crate::material::eigen::{decompose, greatest_bound};
use crate::material::parameters::{Elastic, Lame};
use crate::material::root::increasing_root;
use crate::material::{HISTORIES, Law, State, Step};
use crate::simd::{Vector, each};

/// Fixed corotated solid.
#[derive(Clone, Copy, Debug)]
pub struct FixedCorotated {
    lame: Lame,
    density: f64,
}

impl Model for FixedCorotated {
    type Parameters = Elastic;

    fn new(p: &Elastic, density: f64) -> Self {
        Self { lame: Lame::new(p.young, p.poisson), density }
    }

    fn examples() -> &'static [&'static str] {
        &["model = 'fixed_corotated', young = 1e6, poisson = 0.3"]
    }
}

/// Principal logarithmic strains of this elasticity under principal Cauchy stresses, Pa.
///
/// `s² - s = (J σ - λ (J - 1) J) / 2μ` along each direction, and J is the product of the stretches s.
pub(super) fn strain_of_stretches(lame: &Lame, stress: [f64; 3]) -> Option<[f64; 3]> {
    let stretches = |volume: f64| {
        stress.map(|s| {
            let part = volume * (s - lame.lambda * (volume - 1.0)) / (2.0 * lame.mu);
            0.5 + (0.25 + part).max(0.0).sqrt()
        })
    };
    let volume = increasing_root(|volume| volume - stretches(volume).iter().product::<f64>(), [0.2, 3.0])?;
    // A stretch of a half and less is on the other branch.
    let stretch = stretches(volume);
    stretch.iter().all(|&s| s > 0.5).then(|| stretch.map(libm::log))
}

impl Law for FixedCorotated {
    /// Along a principal direction, `ρ₀ c² = s² ∂P/∂F = 2μ s² + λ J²`.
    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let Lame { lambda, mu } = self.lame;
        let one = V::splat(1.0);
        let eigen = decompose(&state.elastic, step.plane);
        let stretch = each(eigen.value, V::sqrt);
        let volume = stretch[0] * stretch[1] * stretch[2];
        let pressure = (volume - one) * volume * lambda;
        let principal = each(stretch, |s| (s * (s - one)).mul_add(V::splat(2.0 * mu), pressure));
        state.stress = eigen.compose(&principal, step.plane);
        let modulus = greatest_bound(&state.elastic) * (2.0 * mu) + volume * volume * lambda;
        state.wave_speed = (modulus * (1.0 / self.density)).sqrt();
        state.work = V::splat(0.0);
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        let Lame { lambda, mu } = self.lame;
        let one = V::splat(1.0);
        let stretch = each(decompose(&state.elastic, plane).value, V::sqrt);
        let excess = each(stretch, |s| (s - one) * (s - one));
        let volume = stretch[0] * stretch[1] * stretch[2] - one;
        (excess[0] + excess[1] + excess[2]) * mu + volume * volume * (0.5 * lambda)
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
        strain_of_stretches(&self.lame, stress)
    }
}
