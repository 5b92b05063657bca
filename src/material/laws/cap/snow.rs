//! Snow (Stomakhin et al. 2013): fixed corotated elasticity whose principal stretches stay between `1 - θ_c`
//! and `1 + θ_s`, and whose moduli grow by `exp(ξ (1 - J_p))` as it is compacted.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::Consolidation;
use crate::material::eigen::{decompose, greatest_bound};
use crate::material::laws::Model;
use crate::material::laws::fixed_corotated::strain_of_stretches;
use crate::material::parameters::Lame;
use crate::material::{HISTORIES, Law, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask, each};

/// Snow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Young's modulus at the start, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: f64,
    /// Part θ_c of its length by which it shortens before it is crushed.
    #[serde(default = "critical_compression")]
    #[schemars(range(max = 0.9), extend("exclusiveMinimum" = 0.0))]
    pub critical_compression: f64,
    /// Part θ_s of its length by which it lengthens before it tears.
    #[serde(default = "critical_stretch")]
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0))]
    pub critical_stretch: f64,
    /// Exponent ξ with which moduli grow by compaction, and fall by loosening.
    #[serde(default = "ten")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub compaction_exponent: f64,
}

fn critical_compression() -> f64 {
    0.025
}

fn critical_stretch() -> f64 {
    0.0075
}

fn ten() -> f64 {
    10.0
}

/// Law of snow.
#[derive(Clone, Copy, Debug)]
pub struct Snow {
    lame: Lame,
    density: f64,
    least: f64,
    greatest: f64,
    exponent: f64,
}

impl Model for Snow {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        Self {
            lame: Lame::new(p.young, p.poisson),
            density,
            least: 1.0 - p.critical_compression,
            greatest: 1.0 + p.critical_stretch,
            exponent: p.compaction_exponent,
        }
    }

    fn examples() -> &'static [&'static str] {
        &["model = 'snow', young = 1.4e5, poisson = 0.2"]
    }
}

impl Snow {
    /// Factor of the elastic moduli, `exp(ξ (1 - J_p))`; `volume_log` is `ln J_p`.
    #[inline(always)]
    fn stiffening<V: Vector>(&self, volume_log: V) -> V {
        exp((V::splat(1.0) - exp(volume_log)) * self.exponent)
    }

    /// `μ Σ (s - 1)² + λ/2 (J - 1)²` with the moduli of the start.
    #[inline(always)]
    fn stored<V: Vector>(&self, stretch: &[V; 3]) -> V {
        let one = V::splat(1.0);
        let excess = each(*stretch, |s| (s - one) * (s - one));
        let volume = stretch[0] * stretch[1] * stretch[2] - one;
        (excess[0] + excess[1] + excess[2]) * self.lame.mu + volume * volume * (0.5 * self.lame.lambda)
    }
}

impl Law for Snow {
    const HISTORIES: usize = PLASTIC_VOLUME + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let Lame { lambda, mu } = self.lame;
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let (least, greatest) = (V::splat(self.least), V::splat(self.greatest));
        let eigen = decompose(&state.elastic, step.plane);
        let trial = each(eigen.value, V::sqrt);
        // NaN stays NaN.
        let stretch = each(trial, |s| s.lt(least).select(least, greatest.lt(s).select(greatest, s)));
        let yields = |k: usize| trial[k].lt(least) | greatest.lt(trial[k]);
        let changed = yields(0) | yields(1) | yields(2);
        state.work = zero;
        if changed.any() {
            let elastic = eigen.compose(&each(stretch, |s| s * s), step.plane);
            for c in 0..6 {
                state.elastic[c] = changed.select(elastic[c], state.elastic[c]);
            }
            let before = state.history[PLASTIC_VOLUME];
            let (mut square, mut gain) = (zero, zero);
            for k in 0..3 {
                let strain = yields(k).select(ln(trial[k] / stretch[k]), zero);
                square = strain.mul_add(strain, square);
                gain += strain;
            }
            state.history[PLASTIC_STRAIN] += square.sqrt();
            state.history[PLASTIC_VOLUME] = before + gain;
            let lost = (self.stored(&trial) - self.stored(&stretch)) * self.stiffening(before);
            state.work = changed.select(lost, zero).max(zero);
        }
        let stiffening = self.stiffening(state.history[PLASTIC_VOLUME]);
        let volume = stretch[0] * stretch[1] * stretch[2];
        let pressure = (volume - one) * volume * lambda;
        let principal = each(stretch, |s| (s * (s - one)).mul_add(V::splat(2.0 * mu), pressure) * stiffening);
        state.stress = eigen.compose(&principal, step.plane);
        let modulus = greatest_bound(&state.elastic) * (2.0 * mu) + volume * volume * lambda;
        state.wave_speed = (modulus * stiffening * (1.0 / self.density)).sqrt();
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        let stretch = each(decompose(&state.elastic, plane).value, V::sqrt);
        self.stored(&stretch) * self.stiffening(state.history[PLASTIC_VOLUME])
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.lame.pressure_wave() / self.density).sqrt()
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["plastic_strain", "plastic_volume"]
    }

    fn strain_under(
        &self,
        stress: [f64; 3],
        _consolidation: Option<Consolidation>,
        history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        let stiffening = libm::exp((1.0 - libm::exp(history[PLASTIC_VOLUME])) * self.exponent);
        strain_of_stretches(&self.lame, stress.map(|s| s / stiffening))
    }
}
