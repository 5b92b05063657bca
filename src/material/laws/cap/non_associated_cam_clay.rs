//! Non-associated Cam-clay (Wolper et al. 2019): matter that softens as it opens and so fractures.
//!
//! `τ = μ J^(-2/3) dev b + κ/2 (J² - 1) I`, `p = -κ/2 (J² - 1)`, `q = √(3/2) |dev τ|`;
//! `y = (1 + 2β) q² + M² (p + β p₀)(p - p₀)` with `p₀ = κ (10⁻⁵ + sinh(ξ max(ε_c, 0)))`, ε_c the strain to
//! which it is consolidated. Beyond the tips of the ellipse the stress returns to them; else its deviator
//! shrinks to the ellipse at constant pressure. ε_c changes by the volume that is lost, as if the stress had
//! moved straight to the centre. p₀ is that of the start of the step.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::Consolidation;
use crate::material::eigen::{determinant, greatest_bound};
use crate::material::laws::Model;
use crate::material::parameters::Lame;
use crate::material::root::increasing_root;
use crate::material::{HISTORIES, Law, OWN, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask};

/// History variable of the strain to which it is consolidated.
const CONSOLIDATION: usize = OWN;

/// Matter that fractures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Young's modulus, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: f64,
    /// Slope M of the critical state line, q over p; `6 sin φ / (3 - sin φ)` of a friction angle φ.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0))]
    pub critical_stress_ratio: f64,
    /// Ratio β of the strengths in isotropic tension and compression.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub cohesion_ratio: f64,
    /// Exponent ξ with which the strength grows by compaction, and falls by loosening.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub compaction_exponent: f64,
    /// Logarithmic strain of volume to which it is consolidated at the start; more is stronger.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub consolidation: f64,
}

/// Law of matter that fractures.
#[derive(Clone, Copy, Debug)]
pub struct NonAssociatedCamClay {
    parameters: Parameters,
    density: f64,
    /// Shear and bulk modulus, Pa.
    mu: f64,
    kappa: f64,
}

impl Model for NonAssociatedCamClay {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        let lame = Lame::new(p.young, p.poisson);
        Self { parameters: *p, density, mu: lame.mu, kappa: lame.lambda + 2.0 / 3.0 * lame.mu }
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'non_associated_cam_clay', young = 1e6, poisson = 0.3, critical_stress_ratio = 1.85, cohesion_ratio = 0.5, \
           compaction_exponent = 3, consolidation = 0.01",
        ]
    }
}

/// Invariants of the elastic tensor.
#[derive(Clone, Copy)]
struct Invariants<V> {
    /// J².
    square: V,
    /// J^(-2/3).
    scale: V,
    /// A third of the trace.
    mean: V,
}

impl<V: Vector> Invariants<V> {
    #[inline(always)]
    fn of(b: &[V; 6]) -> Self {
        let square = determinant(b);
        Self { square, scale: exp(ln(square) * (-1.0 / 3.0)), mean: (b[0] + b[1] + b[2]) * (1.0 / 3.0) }
    }
}

impl NonAssociatedCamClay {
    #[inline(always)]
    fn stored<V: Vector>(&self, parts: &Invariants<V>) -> V {
        let one = V::splat(1.0);
        let isochoric = parts.mean.mul_add(parts.scale, -one) * (1.5 * self.mu);
        isochoric + (parts.square - one - ln(parts.square)) * (0.25 * self.kappa)
    }

    #[inline(always)]
    fn load<V: Vector>(&self, state: &mut State<V>, parts: &Invariants<V>) {
        let one = V::splat(1.0);
        let b = &state.elastic;
        let pressure = (one - parts.square) * (0.5 * self.kappa);
        let shear = parts.scale * self.mu;
        for c in 0..6 {
            let isotropic = if c < 3 { parts.mean } else { V::splat(0.0) };
            state.stress[c] = (b[c] - isotropic) * shear;
            if c < 3 {
                state.stress[c] = state.stress[c] - pressure;
            }
        }
        // Along a principal direction of stretch s, ρ₀ c² = μ J^(-2/3) (5/9 tr b - s²/3) + κ/2 (J² + 1);
        // across it, less than μ J^(-2/3) s².
        let isochoric = (parts.mean * (5.0 / 3.0)).max(greatest_bound(b)) * shear;
        let modulus = (parts.square + one).mul_add(V::splat(0.5 * self.kappa), isochoric);
        state.wave_speed = (modulus * (1.0 / self.density)).sqrt();
    }
}

impl Law for NonAssociatedCamClay {
    const HISTORIES: usize = CONSOLIDATION + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, _step: &Step) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let p = &self.parameters;
        let (beta, slope, kappa) = (p.cohesion_ratio, p.critical_stress_ratio, self.kappa);
        let consolidation = state.history[CONSOLIDATION];
        let trial = Invariants::of(&state.elastic);
        let mut deviator = state.elastic;
        for normal in &mut deviator[..3] {
            *normal = *normal - trial.mean;
        }
        let [xx, yy, zz, xy, xz, yz] = deviator;
        let shear = xy.mul_add(xy, xz.mul_add(xz, yz * yz));
        let norm = xx.mul_add(xx, yy.mul_add(yy, zz.mul_add(zz, shear + shear))).sqrt();
        let size = norm * trial.scale * self.mu;
        let pressure = (one - trial.square) * (0.5 * kappa);
        // The strength is finite for any strain.
        let power = exp((consolidation.max(zero) * p.compaction_exponent).min(V::splat(300.0)));
        let strength = (power - one / power).mul_add(V::splat(0.5 * kappa), V::splat(1e-5 * kappa));
        let tension = strength * -beta;
        let crushed = strength.lt(pressure);
        let torn = pressure.lt(tension);
        // |dev τ|² at this pressure.
        let square =
            (pressure - tension) * (strength - pressure) * (slope * slope / (1.5 * (1.0 + 2.0 * beta)));
        let sheared = !crushed & !torn & square.lt(size * size);
        let changed = crushed | torn | sheared;
        state.work = zero;
        let mut end = trial;
        if changed.any() {
            let tip = crushed | torn;
            let at_tip = one - crushed.select(strength, tension) * (2.0 / kappa);
            let kept = tip.select(zero, (square.max(zero).sqrt() / size).min(one));
            let isotropic = exp(ln(at_tip) * (1.0 / 3.0));
            for c in 0..6 {
                let unit = if c < 3 { trial.mean } else { zero };
                let unit_at_tip = if c < 3 { isotropic } else { zero };
                let own = tip.select(unit_at_tip, kept.mul_add(deviator[c], unit));
                state.elastic[c] = changed.select(own, state.elastic[c]);
            }
            // Where the line from the centre of the ellipse to the trial stress crosses it.
            let radius = strength * (0.5 * (1.0 + beta));
            let centre = strength * (0.5 * (1.0 - beta));
            let apart = pressure - centre;
            let reach =
                (size * size * (1.5 * (1.0 + 2.0 * beta))).mul_add(one, apart * apart * (slope * slope));
            let crossing = (radius * slope / reach.sqrt()).mul_add(apart, centre);
            let at_crossing = (one - crossing * (2.0 / kappa)).abs();
            let lost = ln(trial.square) - ln(tip.select(at_tip, at_crossing));
            state.history[CONSOLIDATION] =
                changed.select(lost.mul_add(V::splat(-0.5), consolidation), consolidation);
            end = Invariants::of(&state.elastic);
            let opened =
                (ln(trial.square) - ln(end.square)).mul_add(V::splat(0.5), state.history[PLASTIC_VOLUME]);
            state.history[PLASTIC_VOLUME] = changed.select(opened, state.history[PLASTIC_VOLUME]);
            let slip = (one - kept) * size * (0.5 / self.mu);
            let strain = state.history[PLASTIC_STRAIN];
            state.history[PLASTIC_STRAIN] = changed.select(strain + slip, strain);
            state.work = changed.select(self.stored(&trial) - self.stored(&end), zero).max(zero);
        }
        self.load(state, &end);
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, _plane: bool) -> V {
        self.stored(&Invariants::of(&state.elastic))
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        ((self.kappa + 5.0 / 3.0 * self.mu) / self.density).sqrt()
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["plastic_shear_strain", "plastic_volume", "consolidation"]
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        let mut history = [0.0; HISTORIES];
        history[CONSOLIDATION] = self.parameters.consolidation;
        history
    }

    fn strain_under(
        &self,
        stress: [f64; 3],
        _consolidation: Option<Consolidation>,
        _history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        // κ/2 (J² - 1) = J σ_m; dev b = J^(5/3) dev σ / μ, and the mean m of b makes the product of m + dev b
        // J².
        let mean = stress.iter().sum::<f64>() / 3.0;
        // The form without a difference of two large numbers.
        let root = (mean * mean + self.kappa * self.kappa).sqrt();
        let volume = if mean > 0.0 { (mean + root) / self.kappa } else { self.kappa / (root - mean) };
        let size = libm::pow(volume, 5.0 / 3.0) / self.mu;
        let deviator = stress.map(|s| (s - mean) * size);
        let least = deviator.iter().fold(0.0_f64, |least, d| least.max(-d));
        let isotropic = libm::pow(volume, 2.0 / 3.0);
        let excess = |mean: f64| deviator.iter().map(|d| mean + d).product::<f64>() - volume * volume;
        let mean = increasing_root(excess, [least, least + 2.0 * isotropic])?;
        Some(deviator.map(|d| 0.5 * libm::log(mean + d)))
    }
}
