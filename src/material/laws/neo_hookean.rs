//! Compressible neo-Hookean elasticity: `W = μ/2 (tr b - 3) - μ ln J + λ/2 ln² J`,
//! `τ = μ (b - I) + λ ln J I` (Simo & Pister 1984).
use super::Model;
use crate::material::Consolidation;
use crate::material::eigen::{determinant, greatest_bound};
use crate::material::parameters::{Elastic, Lame};
use crate::material::root::increasing_root;
use crate::material::{HISTORIES, Law, State, Step};
use crate::simd::Vector;
use crate::simd::math::ln;

/// Compressible neo-Hookean solid.
#[derive(Clone, Copy, Debug)]
pub struct NeoHookean {
    lame: Lame,
    density: f64,
}

impl Model for NeoHookean {
    type Parameters = Elastic;

    fn new(p: &Elastic, density: f64) -> Self {
        Self { lame: Lame::new(p.young, p.poisson), density }
    }

    fn examples() -> &'static [&'static str] {
        &["model = 'neo_hookean', young = 1e6, poisson = 0.3"]
    }
}

impl Law for NeoHookean {
    /// Along a principal direction of stretch s, `ρ₀ c² = s² ∂P/∂F = μ (s² + 1) + λ (1 - ln J)`.
    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, _step: &Step) {
        let Lame { lambda, mu } = self.lame;
        let one = V::splat(1.0);
        let b = &state.elastic;
        let volume_log = ln(determinant(b)) * 0.5;
        let pressure = volume_log * lambda;
        for i in 0..3 {
            state.stress[i] = (b[i] - one).mul_add(V::splat(mu), pressure);
        }
        for i in 3..6 {
            state.stress[i] = b[i] * mu;
        }
        let modulus = (greatest_bound(b) + one) * mu + (one - volume_log).max(one) * lambda;
        state.wave_speed = (modulus * (1.0 / self.density)).sqrt();
        state.work = V::splat(0.0);
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, _plane: bool) -> V {
        let Lame { lambda, mu } = self.lame;
        let b = &state.elastic;
        let one = V::splat(1.0);
        let volume_log = ln(determinant(b)) * 0.5;
        let trace = (b[0] - one) + (b[1] - one) + (b[2] - one);
        (trace * 0.5 - volume_log) * mu + volume_log * volume_log * (0.5 * lambda)
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
        // b = 1 + (J σ - λ ln J) / μ along each direction, and J² is their product.
        let Lame { lambda, mu } = self.lame;
        let squares = |log: f64| stress.map(|s| 1.0 + (libm::exp(log) * s - lambda * log) / mu);
        let excess = |log: f64| {
            // If a stretch is not positive, J is too large.
            let logs = squares(log).map(|b| if b > 0.0 { libm::log(b) } else { f64::NEG_INFINITY });
            log - 0.5 * logs.iter().sum::<f64>()
        };
        let log = increasing_root(|log| excess(log).min(1e9), [-3.0, 1.0])?;
        Some(squares(log).map(|b| 0.5 * libm::log(b)))
    }
}
