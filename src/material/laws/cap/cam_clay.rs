//! Clay: modified Cam-clay (Roscoe and Burland 1968) in finite strain, with bilogarithmic compression.
//!
//! With `e = -tr ε` of the logarithmic strains, elastic and plastic, in Kirchhoff stress:
//! `p = p_r exp(e_e / κ)`, `dev τ = 2G dev ε_e`, `f = q²/M² + p (p - p_c)`, associated,
//! `p_c = p_c0 exp(e_p / (λ - κ))`.
//!
//! The implicit step has one unknown, the stress ratio `η = q/p` at its end: the ellipse gives
//! `p_c/p = 1 + η²/M²`, whose logarithm is linear in the plastic volume, so volume and stress follow from η,
//! and the direction of flow remains, `2η Δe_p = (M² - η²) Δe_q`. The root is bracketed by the critical state
//! and the ratio without plastic volume.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::Consolidation;
use crate::material::eigen::greatest_bound;
use crate::material::laws::Model;
use crate::material::parameters::OutOfRange;
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step, root};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask, each};

/// Modified Cam-clay.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Shear modulus G, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub shear_modulus: f64,
    /// Slope M of the critical state line, q over p; `6 sin φ / (3 - sin φ)` of a friction angle φ.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0))]
    pub critical_stress_ratio: f64,
    /// Slope λ of virgin compression: logarithmic strain of volume over the logarithm of the pressure.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0))]
    pub compression_index: f64,
    /// Slope κ of swelling, likewise; below the compression index.
    #[schemars(range(min = 1e-3, max = 10.0))]
    pub swelling_index: f64,
    /// Pressure p_r of the undeformed material, Pa. Pressure falls as the material expands, and never to 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub pressure: f64,
    /// Preconsolidation pressure p_c0 of the undeformed material, Pa; at least its pressure.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub preconsolidation_pressure: f64,
}

/// Law of clay.
#[derive(Clone, Copy, Debug)]
pub struct CamClay {
    density: f64,
    shear: f64,
    slope: f64,
    swelling: f64,
    /// `λ - κ`.
    plastic: f64,
    /// Logarithms of p_r and p_c0.
    pressure_log: f64,
    preconsolidation_log: f64,
}

impl Model for CamClay {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        Self {
            density,
            shear: p.shear_modulus,
            slope: p.critical_stress_ratio,
            swelling: p.swelling_index,
            plastic: p.compression_index - p.swelling_index,
            pressure_log: libm::log(p.pressure),
            preconsolidation_log: libm::log(p.preconsolidation_pressure),
        }
    }

    fn check(p: &Parameters) -> Result<(), OutOfRange> {
        let fail =
            |key: &str, value: f64, range: String| Err(OutOfRange { key: key.to_owned(), value, range });
        if p.swelling_index >= p.compression_index {
            let range = format!("below compression_index, {}", p.compression_index);
            return fail("swelling_index", p.swelling_index, range);
        }
        if p.preconsolidation_pressure < p.pressure {
            let range = format!("at least pressure, {}", p.pressure);
            return fail("preconsolidation_pressure", p.preconsolidation_pressure, range);
        }
        Ok(())
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'cam_clay', shear_modulus = 4e5, critical_stress_ratio = 1.2, compression_index = 0.1, \
             swelling_index = 0.02, pressure = 1e4, preconsolidation_pressure = 1e4",
            "model = 'cam_clay', shear_modulus = 4e5, critical_stress_ratio = 0.9, compression_index = 0.15, \
             swelling_index = 0.03, pressure = 1e3, preconsolidation_pressure = 2e4",
        ]
    }
}

/// Final state for a trial value of the stress ratio η.
#[derive(Clone, Copy)]
struct Candidate<V> {
    /// Increment of the plastic compression.
    compression: V,
    pressure: V,
    /// Residual `(M² - η²) Δe_q - 2η Δe_p`, and its derivative by η.
    residual: [V; 2],
}

impl CamClay {
    /// `ratio`: η. `log`: logarithms of the trial pressure, and of the preconsolidation pressure over it.
    /// `strain`: trial `q / 3G`.
    #[inline(always)]
    fn at<V: Vector>(&self, ratio: V, [log, distance]: [V; 2], strain: V) -> Candidate<V> {
        let square = self.slope * self.slope;
        let per_log = self.swelling * self.plastic / (self.swelling + self.plastic);
        let own = ratio * ratio;
        let one = V::splat(1.0);
        let compression = (ln(own.mul_add(V::splat(1.0 / square), one)) - distance) * per_log;
        let pressure = exp(log - compression * (1.0 / self.swelling));
        let slip = (ratio * pressure).neg_mul_add(V::splat(1.0 / (3.0 * self.shear)), strain);
        let beside = V::splat(square) - own;
        let residual = beside * slip - ratio * compression * 2.0;
        let growth = ratio * (2.0 * per_log) / (own + V::splat(square));
        let slip_growth =
            (ratio * growth * (1.0 / self.swelling) - one) * pressure * (1.0 / (3.0 * self.shear));
        let slope = beside * slip_growth - (ratio * slip + compression + ratio * growth) * 2.0;
        Candidate { compression, pressure, residual: [residual, slope] }
    }
}

impl Law for CamClay {
    const HISTORIES: usize = PLASTIC_VOLUME + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let slope = V::splat(self.slope);
        let trial = Strain::of(&state.elastic, step.plane);
        let gain = state.history[PLASTIC_VOLUME];
        let log = trial.trace.neg_mul_add(V::splat(1.0 / self.swelling), V::splat(self.pressure_log));
        let preconsolidation =
            gain.neg_mul_add(V::splat(1.0 / self.plastic), V::splat(self.preconsolidation_log));
        // Bounded, so that the root of its exponential is finite.
        let distance = (preconsolidation - log).min(V::splat(690.0));
        let strain = trial.norm * (2.0_f64 / 3.0).sqrt();
        let ellipse = exp(distance) - one;
        // The stress ratio without plastic volume.
        let reach = ellipse.max(zero).sqrt() * slope;
        let mut pressure = exp(log);
        let stress = strain * (3.0 * self.shear);
        let flows = ellipse.lt(zero) | (reach * pressure).lt(stress);
        let mut kept = one;
        let mut compression = zero;
        state.work = zero;
        if flows.any() {
            let critical = self.at(slope, [log, distance], strain);
            // On the dry side the root is above the critical state, and counted from there.
            let dry = critical.compression.lt(zero);
            let base = dry.select(slope, zero);
            let high = dry.select(reach - slope, slope).max(V::splat(f64::MIN_POSITIVE));
            let wet = (stress / pressure.max(V::splat(f64::MIN_POSITIVE))).min(slope * 0.9);
            let guess = dry.select((high * 0.5).min(slope), wet).max(V::splat(f64::MIN_POSITIVE)).min(high);
            let scale =
                critical.compression.abs() + critical.pressure * (self.slope / (3.0 * self.shear)) + strain;
            let noise = scale * (0.25 * f64::EPSILON * self.slope);
            // Positive below the root: (M² - η²) Δe_q is more than 2η Δe_p on the wet side, and on the dry
            // side both are negative and the volume is more.
            let function = |above: V| self.at(base + above, [log, distance], strain).residual;
            let ratio = base + root::newton(function, guess, high, noise, flows);
            let end = self.at(ratio, [log, distance], strain);
            let end_stress = ratio * end.pressure;
            let slip = (strain - end_stress * (1.0 / (3.0 * self.shear))).max(zero);
            kept = (flows & zero.lt(stress)).select((end_stress / stress).min(one), one);
            compression = flows.select(end.compression, zero);
            pressure = flows.select(end.pressure, pressure);
            let work = end_stress.mul_add(slip, end.pressure * end.compression);
            state.work = flows.select(work, zero).max(zero);
            let shear = state.history[PLASTIC_STRAIN];
            state.history[PLASTIC_STRAIN] = flows.select(shear + slip, shear);
            state.history[PLASTIC_VOLUME] = gain - compression;
        }
        let none = V::Mask::from_bits(0);
        let (_, deviator) = trial.rewrite(state, [trial.trace + compression, kept], flows, none, step.plane);
        state.stress = each(deviator, |component| component * (2.0 * self.shear));
        for normal in &mut state.stress[..3] {
            *normal = *normal - pressure;
        }
        // Along a principal direction ρ₀ c² = p/κ + 4/3 G - τ.
        let compressive = greatest_bound(&each(state.stress, |s| -s)).max(zero);
        let modulus = pressure * (1.0 / self.swelling) + compressive + V::splat(4.0 / 3.0 * self.shear);
        state.wave_speed = (modulus * (1.0 / self.density)).sqrt();
    }

    /// `W = κ p + G |dev ε|²`, 0 without pressure and shear.
    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        let Strain { trace, norm, .. } = Strain::of(&state.elastic, plane);
        let log = trace.neg_mul_add(V::splat(1.0 / self.swelling), V::splat(self.pressure_log));
        norm * norm * self.shear + exp(log) * self.swelling
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        let pressure = libm::exp(self.pressure_log);
        ((pressure / self.swelling + pressure + 4.0 / 3.0 * self.shear) / self.density).sqrt()
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["plastic_strain", "plastic_volume"]
    }

    fn strain_under(
        &self,
        stress: [f64; 3],
        consolidation: Option<Consolidation>,
        history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        // With the volume exp(θ + g) of elastic and plastic volume strain, p exp(θ + g) = p_r exp(-θ / κ) and
        // p_c exp(θ + g) = p_c0 exp(-g / (λ - κ)): linear in the logarithms.
        let pressure = -stress.iter().sum::<f64>() / 3.0;
        if pressure.is_nan() || pressure <= 0.0 {
            return None;
        }
        let elastic = self.swelling * (self.pressure_log - libm::log(pressure));
        let (mut gain, mut volume_log) = (0.0, elastic / (1.0 + self.swelling));
        if let Some(consolidation) = consolidation {
            let square: f64 = stress.iter().map(|s| (s + pressure) * (s + pressure)).sum();
            let on_surface = pressure + 1.5 * square / (self.slope * self.slope * pressure);
            let consolidated = match consolidation {
                Consolidation::Ratio(ratio) => ratio * on_surface,
                Consolidation::Pressure(pressure) => pressure,
            };
            let plastic = self.plastic * (self.preconsolidation_log - libm::log(consolidated));
            // θ + κ (θ + g) = elastic, g + (λ - κ) (θ + g) = plastic.
            let sum = (elastic + plastic) / (1.0 + self.swelling + self.plastic);
            (volume_log, gain) = (elastic - self.swelling * sum, plastic - self.plastic * sum);
            history[PLASTIC_VOLUME] = gain;
        }
        let volume = libm::exp(volume_log + gain);
        Some(stress.map(|s| volume * (s + pressure) / (2.0 * self.shear) + volume_log / 3.0))
    }

    fn consolidates(&self) -> bool {
        true
    }
}
