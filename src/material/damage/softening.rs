//! Stress of a crack band under uniaxial tension.
//!
//! With Young's modulus E, strength f, onset `ε₀ = f/E`, energy of fracture G, width h of the band and its
//! greatest strain κ, from ε₀ upwards:
//!
//! | softening | stress |
//! |---|---|
//! | `linear` | `f (ε_u - κ)/(ε_u - ε₀)`, at least 0, with `ε_u = 2 G/(h f)` |
//! | `exponential_total_strain` | `f exp(-(κ - ε₀)/c)` with `c = G/(h f) - ε₀/2` |
//! | `exponential_crack_opening` | `f exp(-w f/G)` with the opening w: `κ = s/E + w/h` |
//!
//! All take G per area until they are broken. Here stresses are divided by E and energies per volume too.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::root::{Function, newton};
use crate::simd::math::exp;
use crate::simd::{Lanes, Vector, VectorMask};

/// How the stress of a crack band falls with its greatest strain κ, from the strength f at the onset ε₀. The
/// energy of fracture G and the width h of the band set how fast.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Softening {
    /// Linearly, to 0 at `κ = 2 G/(h f)`.
    #[default]
    Linear,
    /// Exponentially with the strain: `f exp(-(κ - ε₀)/c)` with `c = G/(h f) - ε₀/2`.
    ExponentialTotalStrain,
    /// Exponentially with the opening w of the crack: `f exp(-w f/G)`, `κ = s/E + w/h`.
    ExponentialCrackOpening,
}

impl Softening {
    /// Greatest width of a band, m, in which the stress falls with growing strain; `length` is `E G/f²`, m.
    pub(super) fn widest(self, length: f64) -> f64 {
        match self {
            Self::Linear | Self::ExponentialTotalStrain => 2.0 * length,
            Self::ExponentialCrackOpening => length,
        }
    }
}

/// Greatest range of the softening over the onset: that of particles without a band, which keep their
/// strength.
const ENDLESS: f64 = 1e6;

/// Part of the strength that is left in a band that has failed.
const LEFT: f64 = 0.01;

/// Stress over Young's modulus as a function of strain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve {
    kind: Softening,
    /// ε₀.
    pub onset: f64,
    /// `G/(E ε₀)`, m.
    opening: f64,
}

/// The strain less the stress over E: the opening over the width, at a strain.
struct Opening<V> {
    strain: V,
    onset: f64,
    range: V,
}

impl<V: Vector> Function<V, [V; 2]> for Opening<V> {
    #[inline(always)]
    fn at(&self, opening: V) -> [V; 2] {
        let stress = exp(-(opening / self.range)) * self.onset;
        [self.strain - opening - stress, stress / self.range - V::splat(1.0)]
    }
}

/// An exponential less a line, which fall to zero where a damage was reached.
struct Reached<V> {
    /// Factor of the exponential, and its range.
    factor: V,
    range: V,
    /// Slope of the line, and its value at 0 over the slope.
    left: V,
    before: f64,
}

impl<V: Vector> Function<V, [V; 2]> for Reached<V> {
    #[inline(always)]
    fn at(&self, x: V) -> [V; 2] {
        let stress = exp(-(x / self.range)) * self.factor;
        [(x + V::splat(self.before)).neg_mul_add(self.left, stress), -(stress / self.range + self.left)]
    }
}

impl Curve {
    /// Of this onset and energy of fracture over Young's modulus, m.
    pub(super) fn new(kind: Softening, onset: f64, energy: f64) -> Self {
        Self { kind, onset, opening: energy / onset }
    }

    /// Strain over which the stress falls in bands of this width (m): `ε_u` of the linear law, c of the
    /// others. Bands too wide break at once.
    #[inline(always)]
    pub(super) fn range<V: Vector>(&self, band: V) -> V {
        let most = V::splat(self.onset * ENDLESS);
        let whole = (V::splat(self.opening) / band.max(V::splat(1e-300))).min(most);
        let (range, least) = match self.kind {
            Softening::Linear => (whole * 2.0, 1.001),
            Softening::ExponentialTotalStrain => (whole - V::splat(0.5 * self.onset), 0.01),
            Softening::ExponentialCrackOpening => (whole, 1.001),
        };
        range.max(V::splat(least * self.onset))
    }

    /// Stress at a greatest strain, beyond the onset where `active`.
    #[inline(always)]
    pub(super) fn stress<V: Vector>(&self, strain: V, range: V, active: V::Mask) -> V {
        let onset = V::splat(self.onset);
        match self.kind {
            Softening::Linear => {
                let left = (range - strain).max(V::splat(0.0));
                left * self.onset / (range - onset)
            }
            Softening::ExponentialTotalStrain => exp((onset - strain) / range) * self.onset,
            Softening::ExponentialCrackOpening => {
                let function = Opening { strain, onset: self.onset, range };
                let guess = active.select(strain - onset, onset);
                let opening = newton(function, guess, strain, strain * f64::EPSILON, active);
                exp(-(opening / range)) * self.onset
            }
        }
    }

    /// Damage from which a band of this width (m) has failed: a hundredth of the strength is left.
    pub(super) fn failed(&self, band: f64) -> f64 {
        let range = self.range(Lanes::splat(band)).to_array()[0];
        let strain = match self.kind {
            Softening::Linear => range - LEFT * (range - self.onset),
            Softening::ExponentialTotalStrain => range.mul_add(-libm::log(LEFT), self.onset),
            Softening::ExponentialCrackOpening => range.mul_add(-libm::log(LEFT), LEFT * self.onset),
        };
        1.0 - LEFT * self.onset / strain
    }

    /// Strain and stress at which a damage was reached, where `active`; below the strain `high`.
    #[inline(always)]
    pub(super) fn reached<V: Vector>(&self, damage: V, range: V, high: V, active: V::Mask) -> [V; 2] {
        let onset = V::splat(self.onset);
        let left = V::splat(1.0) - damage;
        let noise = V::splat(self.onset * f64::EPSILON);
        let cracked = active & V::splat(0.0).lt(damage);
        let beyond = cracked.select(high - onset, onset);
        let [strain, stress] = match self.kind {
            Softening::Linear => {
                let strain = range * self.onset / damage.neg_mul_add(range - onset, range);
                [strain, left * strain]
            }
            Softening::ExponentialTotalStrain => {
                let function = Reached { factor: onset, range, left, before: self.onset };
                let strain = onset + newton(function, beyond, beyond, noise, cracked);
                [strain, left * strain]
            }
            Softening::ExponentialCrackOpening => {
                let function = Reached { factor: damage * self.onset, range, left, before: 0.0 };
                let high = cracked.select(high, onset);
                let opening = newton(function, beyond, high, noise, cracked);
                let stress = exp(-(opening / range)) * self.onset;
                [stress + opening, stress]
            }
        };
        [cracked.select(strain, onset), cracked.select(stress, onset)]
    }

    /// Energy that a band has taken for good at a greatest strain with this stress, per volume over E.
    #[inline(always)]
    pub(super) fn taken<V: Vector>(&self, strain: V, stress: V, range: V) -> V {
        let onset = V::splat(self.onset);
        let before = V::splat(0.5 * self.onset * self.onset);
        match self.kind {
            Softening::Linear => {
                let strain = strain.min(range);
                let work = ((onset + stress) * (strain - onset)).mul_add(V::splat(0.5), before);
                (stress * strain).mul_add(V::splat(-0.5), work)
            }
            Softening::ExponentialTotalStrain => {
                let work = range.mul_add(onset - stress, before);
                (stress * strain).mul_add(V::splat(-0.5), work)
            }
            Softening::ExponentialCrackOpening => {
                let back = stress * (strain - stress) * 0.5;
                range.mul_add(onset - stress, -back)
            }
        }
    }
}
