//! The law of a metal with von Mises yield; its formulas are in `von_mises.rs`.
use crate::material::root::Function;
use crate::material::solid::Hencky;
use crate::material::strength::hardening::{Curve, Flow};
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, OWN, PLASTIC_STRAIN, State, Step, root};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask};

/// History variable of the temperature, K.
const TEMPERATURE: usize = OWN;

/// Von Mises solid.
#[derive(Clone, Debug)]
pub struct VonMises {
    solid: Hencky,
    curve: Curve,
    overstress: Option<Overstress>,
}

/// `η |d_p|^h`
#[derive(Clone, Copy, Debug)]
pub(super) struct Overstress {
    /// η, Pa s^h.
    pub viscosity: f64,
    /// h.
    pub exponent: f64,
}

impl Overstress {
    /// With η, Pa s^h, and h; `None` without viscosity.
    pub(super) fn new(viscosity: f64, exponent: f64) -> Option<Self> {
        (viscosity > 0.0).then_some(Self { viscosity, exponent })
    }

    /// In a step of `dt` (s) with a plastic increment of this norm, above 0, and its derivative by the
    /// increment, Pa.
    #[inline(always)]
    pub(super) fn of<V: Vector>(self, increment: V, dt: f64) -> [V; 2] {
        let rate = increment * (1.0 / dt);
        let value = match self.exponent {
            1.0 => rate,
            exponent => exp(ln(rate) * exponent),
        } * self.viscosity;
        [value, value * self.exponent / increment]
    }
}

/// The part of its strength that a metal has left.
pub(in crate::material) trait Left<V>: Copy {
    /// This part of a strength.
    fn of(self, strength: V) -> V;
}

/// All of it.
#[derive(Clone, Copy)]
pub(in crate::material) struct Whole;

/// A part from 0 to 1.
#[derive(Clone, Copy)]
pub(in crate::material) struct Part<V>(pub V);

impl<V> Left<V> for Whole {
    #[inline(always)]
    fn of(self, strength: V) -> V {
        strength
    }
}

impl<V: Vector> Left<V> for Part<V> {
    #[inline(always)]
    fn of(self, strength: V) -> V {
        strength * self.0
    }
}

impl VonMises {
    /// With these elastic constants, strength and overstress.
    pub(super) fn of(solid: Hencky, curve: Curve, overstress: Option<Overstress>) -> Self {
        Self { solid, curve, overstress }
    }

    /// The elastic part.
    pub(in crate::material) fn elastic(&self) -> &Hencky {
        &self.solid
    }

    /// Temperature gained per plastic work, K/(J/m³); 0 for laws without temperatures.
    pub(in crate::material) fn warming(&self) -> f64 {
        self.curve.heat()
    }

    /// Temperature of the undeformed material, K, for laws with one.
    pub(in crate::material) fn temperature(&self) -> Option<f64> {
        self.curve.temperature()
    }
}

impl Law for VonMises {
    const HISTORIES: usize = TEMPERATURE + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        match (self.curve.linear(), self.overstress) {
            (Some(modulus), None) => self.return_linear(state, modulus, step.plane),
            _ => self.return_curved(state, step, Whole),
        }
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        self.solid.energy(state, plane)
    }

    fn density(&self) -> f64 {
        Law::density(&self.solid)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(&self.solid)
    }

    fn history_names(&self) -> &'static [&'static str] {
        match self.curve.temperature() {
            Some(_) => &["plastic_strain", "plastic_volume", "temperature"],
            None => &["plastic_strain"],
        }
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        self.curve.initial_history()
    }

    fn is_firm(&self) -> bool {
        true
    }

    fn softens(&self) -> bool {
        self.curve.softens()
    }

    fn solid(&self) -> Option<&Hencky> {
        Some(&self.solid)
    }
}

/// Excess of a trial stress over the strength after an increment of the plastic strain, Pa.
struct Excess<'a, V, L> {
    law: &'a VonMises,
    step: &'a Step,
    /// Trial `q`, Pa.
    stress: V,
    /// Plastic strain and temperature at the start of the step.
    strain: V,
    temperature: V,
    three_mu: f64,
    part: L,
}

impl<V: Vector, L: Left<V>> Function<V, [V; 2]> for Excess<'_, V, L> {
    #[inline(always)]
    fn at(&self, increment: V) -> [V; 2] {
        let (root, heat) = (1.5_f64.sqrt(), self.law.curve.heat());
        let left = increment.neg_mul_add(V::splat(self.three_mu), self.stress);
        let gained = left * increment * heat;
        let rise = (left - increment * self.three_mu) * heat;
        let flow = Flow { increment, temperature: [self.temperature + gained, rise] };
        let [mut strength, mut slope] = self.law.curve.strength(self.strain + increment, &flow, self.step);
        if let Some(overstress) = self.law.overstress {
            let [value, change] = overstress.of(increment * root, self.step.dt);
            strength = value.mul_add(V::splat(root), strength);
            slope = change.mul_add(V::splat(1.5), slope);
        }
        [left - self.part.of(strength), -(self.part.of(slope) + V::splat(self.three_mu))]
    }
}

impl VonMises {
    /// Closed form for linear hardening without overstress.
    #[inline(always)]
    fn return_linear<V: Vector>(&self, state: &mut State<V>, modulus: f64, plane: bool) {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let root = (2.0_f64 / 3.0).sqrt();
        let mu = self.solid.shear_modulus();
        let trial = Strain::of(&state.elastic, plane);
        let radius =
            |kappa: V| kappa.mul_add(V::splat(root * modulus), V::splat(root * self.curve.initial()));
        let excess = trial.norm.mul_add(V::splat(2.0 * mu), -radius(state.history[PLASTIC_STRAIN]));
        let flows = zero.lt(excess);
        let mut kept = one;
        state.work = zero;
        if flows.any() {
            let flow = excess * (1.0 / (2.0 * mu + 2.0 / 3.0 * modulus));
            kept = flows.select(one - flow / trial.norm, one);
            let kappa = flow.mul_add(V::splat(root), state.history[PLASTIC_STRAIN]);
            state.history[PLASTIC_STRAIN] = flows.select(kappa, state.history[PLASTIC_STRAIN]);
            state.work = flows.select(radius(kappa) * flow, zero);
        }
        trial.finish(&self.solid, state, [trial.trace, kept], flows, V::Mask::from_bits(0), plane);
    }

    /// Any hardening and overstress, with a part of the strength.
    #[inline(always)]
    pub(in crate::material) fn return_curved<V: Vector>(
        &self,
        state: &mut State<V>,
        step: &Step,
        part: impl Left<V>,
    ) {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let three_mu = 3.0 * self.solid.shear_modulus();
        let trial = Strain::of(&state.elastic, step.plane);
        let stress = trial.norm * (2.0 * 1.5_f64.sqrt() * self.solid.shear_modulus());
        let (strain, temperature) = (state.history[PLASTIC_STRAIN], state.history[TEMPERATURE]);
        let still = Flow { increment: zero, temperature: [temperature, zero] };
        let [strength, _] = self.curve.strength(strain, &still, step);
        let strength = part.of(strength);
        // Without a step there is no rate-dependent flow.
        let mut flows = strength.lt(stress);
        if self.overstress.is_some() && step.dt <= 0.0 {
            flows = V::Mask::from_bits(0);
        }
        let mut kept = one;
        state.work = zero;
        if flows.any() {
            let heat = self.curve.heat();
            let excess = Excess { law: self, step, stress, strain, temperature, three_mu, part };
            let high = stress * (1.0 / three_mu);
            let guess = flows.select((stress - strength) * (1.0 / three_mu), high);
            let increment = root::newton(excess, guess, high, stress * f64::EPSILON, flows);
            let left = increment.neg_mul_add(V::splat(three_mu), stress);
            let work = left * increment;
            kept = flows.select(left / stress, one).max(zero);
            state.history[PLASTIC_STRAIN] = flows.select(strain + increment, strain);
            state.history[TEMPERATURE] = flows.select(work.mul_add(V::splat(heat), temperature), temperature);
            state.work = flows.select(work, zero).max(zero);
        }
        trial.finish(&self.solid, state, [trial.trace, kept], flows, V::Mask::from_bits(0), step.plane);
    }
}
