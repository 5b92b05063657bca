//! Metal that fails: von Mises plasticity with the failure strain of Johnson and Cook (1985).
//!
//! The index `ω = Σ Δκ/ε_f` grows with the plastic strain κ, where
//!
//! `ε_f = (D₁ + D₂ exp(D₃ σ*)) (1 + D₄ ln⟨κ̇/κ̇₀⟩) (1 + D₅ T*)`,
//!
//! σ* is the mean stress over the von Mises stress, held between -3 and 3, and T* the homologous temperature
//! of Johnson-Cook hardening. From ω = 1 to `1 + softening` the damage D grows linearly from 0 to 1; strength
//! and mean stress in tension are `1 - D` times those of the whole metal: failed metal bears pressure only.
//! The return mapping takes D from the start of the step.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::laws::metal::{Part, VonMises};
use crate::material::parameters::OutOfRange;
use crate::material::solid::Hencky;
use crate::material::strength::hardening::Hardening;
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, OWN, PLASTIC_STRAIN, State, Step};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask};

/// History variable of the index ω.
const INDEX: usize = OWN;
/// Greatest difference of index and damage of particles that merge.
const ALIKE: f64 = 0.01;
/// Greatest σ*.
const TRIAXIAL: f64 = 3.0;
/// Damage with which the metal has failed.
const FAILED: f64 = 0.99;
/// Least failure strain.
const LEAST: f64 = 1e-6;

/// Failure of a metal by plastic strain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Failure {
    /// Failure strain by triaxiality, rate and temperature (Johnson and Cook 1985):
    /// `(d1 + d2 exp(d3 σ*)) (1 + d4 ln(rate/reference_rate)) (1 + d5 T*)` with the mean over the von Mises
    /// stress σ*, tension positive, held between -3 and 3. The field `damage` is the sum of plastic strain
    /// over failure strain: from 1 on, strength and tension fall to 0, and what has failed bears pressure
    /// only.
    JohnsonCook {
        /// Failure strain that does not depend on σ*.
        #[schemars(range(min = -100.0, max = 100.0))]
        d1: f64,
        /// Factor of the exponential.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 1e3))]
        d2: f64,
        /// Exponent of σ*; below 0 for metals that stretch less under tension from all sides.
        #[serde(default)]
        #[schemars(range(min = -100.0, max = 100.0))]
        d3: f64,
        /// Increase with the logarithm of the rate of plastic strain.
        #[serde(default)]
        #[schemars(range(min = -1.0, max = 1.0))]
        d4: f64,
        /// Increase with the homologous temperature; needs the hardening `johnson_cook`.
        #[serde(default)]
        #[schemars(range(min = -100.0, max = 100.0))]
        d5: f64,
        /// Rate of plastic strain below which the failure strain does not depend on it, 1/s.
        #[serde(default = "one")]
        #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0))]
        reference_rate: f64,
        /// Part of the failure strain over which strength falls to 0, from 1 on.
        #[serde(default = "tenth")]
        #[schemars(range(min = 1e-3, max = 10.0))]
        softening: f64,
    },
}

fn one() -> f64 {
    1.0
}

fn tenth() -> f64 {
    0.1
}

impl Failure {
    /// Checks conditions beyond the ranges of single keys.
    pub(in crate::material) fn check(&self, hardening: &Hardening) -> Result<(), OutOfRange> {
        let fail = |key: &str, value: f64, range: &str| {
            Err(OutOfRange { key: key.to_owned(), value, range: range.to_owned() })
        };
        let Self::JohnsonCook { d1, d2, d3, d5, .. } = *self;
        match hardening.homologous() {
            // Temperature and damage share one history variable.
            Some((_, heat_fraction)) if heat_fraction > 0.0 => fail(
                "hardening.heat_fraction",
                heat_fraction,
                "0 with damage, which takes its history variable",
            ),
            None if d5 != 0.0 => {
                fail("damage.d5", d5, "0 without the hardening johnson_cook, which has temperatures")
            }
            _ if d1 + d2 * libm::exp(d3 / 3.0) <= 0.0 => fail(
                "damage.d1",
                d1,
                "such that d1 + d2 exp(d3/3), the failure strain in uniaxial tension, is above 0",
            ),
            _ => Ok(()),
        }
    }
}

/// Von Mises solid that fails.
#[derive(Clone, Debug)]
pub(in crate::material) struct Ductile {
    metal: VonMises,
    d: [f64; 4],
    /// `1 + D₅ T*`.
    thermal: f64,
    reference_rate: f64,
    softening: f64,
    /// K; 0 where strength does not depend on it.
    temperature: f64,
}

impl Ductile {
    /// A metal with this hardening.
    pub(in crate::material) fn new(metal: VonMises, failure: &Failure, hardening: &Hardening) -> Self {
        let Failure::JohnsonCook { d1, d2, d3, d4, d5, reference_rate, softening } = *failure;
        let homologous = hardening.homologous().map_or(0.0, |(temperature, _)| temperature);
        let temperature = metal.temperature().unwrap_or(0.0);
        let thermal = d5.mul_add(homologous, 1.0);
        Self { metal, d: [d1, d2, d3, d4], thermal, reference_rate, softening, temperature }
    }

    /// D.
    #[inline(always)]
    fn damage<V: Vector>(&self, index: V) -> V {
        let over = (index - V::splat(1.0)).max(V::splat(0.0)) * (1.0 / self.softening);
        over.min(V::splat(1.0))
    }

    /// ε_f.
    #[inline(always)]
    fn failure_strain<V: Vector>(&self, triaxiality: V, rate: V) -> V {
        let [d1, d2, d3, d4] = self.d;
        let mut strain = (exp(triaxiality * d3) * d2 + V::splat(d1)) * self.thermal;
        if d4 != 0.0 {
            let ratio = (rate * (1.0 / self.reference_rate)).max(V::splat(1.0));
            strain = strain * ln(ratio).mul_add(V::splat(d4), V::splat(1.0));
        }
        strain.max(V::splat(LEAST))
    }

    /// The index after a plastic increment that ended under a stress.
    #[inline(always)]
    fn grown<V: Vector>(&self, index: V, increment: V, state: &State<V>, dt: f64) -> V {
        let [xx, yy, zz, xy, xz, yz] = state.stress;
        let mean = (xx + yy + zz) * (1.0 / 3.0);
        let [a, b, c] = [xx - mean, yy - mean, zz - mean];
        let shear = xy.mul_add(xy, xz.mul_add(xz, yz * yz));
        let square = a.mul_add(a, b.mul_add(b, c.mul_add(c, shear + shear)));
        let mises = (square * 1.5).sqrt().max(V::splat(f64::MIN_POSITIVE));
        let triaxiality = (mean / mises).min(V::splat(TRIAXIAL)).max(V::splat(-TRIAXIAL));
        let rate = increment * if dt > 0.0 { 1.0 / dt } else { 0.0 };
        let next = index + increment / self.failure_strain(triaxiality, rate);
        next.min(V::splat(1.0 + self.softening))
    }
}

impl Law for Ductile {
    const HISTORIES: usize = INDEX + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let index = state.history[INDEX];
        let before = self.damage(index);
        // The metal finds its temperature there.
        state.history[INDEX] = V::splat(self.temperature);
        let strain = state.history[PLASTIC_STRAIN];
        self.metal.return_curved(state, step, Part(one - before));
        let increment = state.history[PLASTIC_STRAIN] - strain;
        let flows = zero.lt(increment);
        let mut next = index;
        if flows.any() {
            next = flows.select(self.grown(index, increment, state, step.dt), index);
        }
        state.history[INDEX] = next;
        let damage = self.damage(next);
        let mean = (state.stress[0] + state.stress[1] + state.stress[2]) * (1.0 / 3.0);
        let opens = zero.lt(damage) & zero.lt(mean);
        if opens.any() {
            let lost = opens.select(mean * damage, zero);
            for normal in &mut state.stress[..3] {
                *normal = *normal - lost;
            }
            let energy = mean * mean * (0.5 / self.metal.elastic().bulk_modulus());
            state.work += opens.select(energy * (damage - before), zero);
        }
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        let whole = Law::energy(&self.metal, state, plane);
        let damage = self.damage(state.history[INDEX]);
        if damage.le(V::splat(0.0)).all() {
            return whole;
        }
        let opening = Strain::of(&state.elastic, plane).trace.max(V::splat(0.0));
        let lost = opening * opening * damage * (0.5 * self.metal.elastic().bulk_modulus());
        (whole - lost).max(V::splat(0.0))
    }

    fn density(&self) -> f64 {
        Law::density(&self.metal)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(&self.metal)
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["plastic_strain", "plastic_volume", "damage"]
    }

    fn solid(&self) -> Option<&Hencky> {
        Some(self.metal.elastic())
    }

    fn alike(&self, a: &[f64; HISTORIES], b: &[f64; HISTORIES]) -> bool {
        let damage = |history: &[f64; HISTORIES]| ((history[INDEX] - 1.0) / self.softening).clamp(0.0, 1.0);
        (a[INDEX] - b[INDEX]).abs() <= ALIKE && (damage(a) - damage(b)).abs() <= ALIKE
    }

    fn is_firm(&self) -> bool {
        self.metal.is_firm()
    }

    fn has_failed(&self, history: &[f64; HISTORIES]) -> bool {
        history[INDEX] >= FAILED.mul_add(self.softening, 1.0)
    }
}

const _: () = assert!(Ductile::HISTORIES <= HISTORIES);
