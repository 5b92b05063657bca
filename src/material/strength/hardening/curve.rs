//! Hardening laws for batches of particles.
use super::{Hardening, HardeningLaw};
use crate::material::{HISTORIES, OWN, Step};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask};

/// Strength as a function of plastic strain, its rate and temperature.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// Strength of the undeformed material, Pa.
    initial: f64,
    kind: Kind,
    /// Edge of the cells for which strains of softening hold, m.
    length: Option<f64>,
    /// Factor of the strengths of the law.
    factor: f64,
}

#[derive(Clone, Debug)]
enum Kind {
    Linear {
        modulus: f64,
    },
    Voce {
        gain: f64,
        rate: f64,
        modulus: f64,
    },
    Ludwik {
        modulus: f64,
        exponent: f64,
    },
    Swift {
        strain: f64,
        exponent: f64,
    },
    /// Strains and the changes of slope there.
    Table(Vec<[f64; 2]>),
    LinearSoftening {
        residual: f64,
        strain: f64,
    },
    ExponentialSoftening {
        residual: f64,
        strain: f64,
    },
    JohnsonCook(JohnsonCook),
}

#[derive(Clone, Copy, Debug)]
struct JohnsonCook {
    modulus: f64,
    exponent: f64,
    rate_factor: f64,
    reference_rate: f64,
    thermal_exponent: f64,
    reference_temperature: f64,
    /// From there to melting, K.
    range: f64,
    temperature: f64,
    /// Temperature gained per plastic work, K/(J/m³).
    heat: f64,
}

/// Arguments of the strength besides the plastic strain: its increment, and the temperature.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flow<V> {
    /// Increment of the plastic strain in this step.
    pub increment: V,
    /// Temperature at the end of the step, K, and its derivative by the increment.
    pub temperature: [V; 2],
}

impl Curve {
    /// From the parameters, the strength of the undeformed material, Pa, and its density, kg/m³.
    pub(crate) fn new(hardening: &Hardening, initial: f64, density: f64) -> Self {
        let mut own_length = None;
        let kind = match hardening {
            Hardening::Modulus(modulus) => Kind::Linear { modulus: *modulus },
            Hardening::Law(law) => match law {
                HardeningLaw::None {} => Kind::Linear { modulus: 0.0 },
                HardeningLaw::Linear { modulus } => Kind::Linear { modulus: *modulus },
                HardeningLaw::Voce { saturation, rate, modulus } => {
                    Kind::Voce { gain: saturation - initial, rate: *rate, modulus: *modulus }
                }
                HardeningLaw::Ludwik { modulus, exponent } => {
                    Kind::Ludwik { modulus: *modulus, exponent: *exponent }
                }
                HardeningLaw::Swift { strain, exponent } => {
                    Kind::Swift { strain: *strain, exponent: *exponent }
                }
                HardeningLaw::Table { points } => Kind::Table(kinks(points, initial)),
                HardeningLaw::LinearSoftening { residual, strain, length } => {
                    own_length = *length;
                    Kind::LinearSoftening { residual: *residual, strain: *strain }
                }
                HardeningLaw::ExponentialSoftening { residual, strain, length } => {
                    own_length = *length;
                    Kind::ExponentialSoftening { residual: *residual, strain: *strain }
                }
                HardeningLaw::JohnsonCook {
                    modulus,
                    exponent,
                    rate_factor,
                    reference_rate,
                    thermal_exponent,
                    reference_temperature,
                    melting_temperature,
                    temperature,
                    specific_heat,
                    heat_fraction,
                } => Kind::JohnsonCook(JohnsonCook {
                    modulus: *modulus,
                    exponent: *exponent,
                    rate_factor: *rate_factor,
                    reference_rate: *reference_rate,
                    thermal_exponent: *thermal_exponent,
                    reference_temperature: *reference_temperature,
                    range: melting_temperature - reference_temperature,
                    temperature: *temperature,
                    heat: heat_fraction / (density * specific_heat),
                }),
            },
        };
        Self { initial, kind, length: own_length, factor: 1.0 }
    }

    /// The same law with half the strength.
    pub(crate) fn halved(self) -> Self {
        Self { factor: 0.5 * self.factor, ..self }
    }

    /// Strength of the undeformed material, Pa.
    pub(crate) fn initial(&self) -> f64 {
        self.initial * self.factor
    }

    /// The modulus, if strength is linear for all strains.
    pub(crate) fn linear(&self) -> Option<f64> {
        match self.kind {
            Kind::Linear { modulus } => Some(modulus * self.factor),
            _ => None,
        }
    }

    /// Whether it depends on the size of cells.
    pub(crate) fn softens(&self) -> bool {
        self.length.is_some()
    }

    /// Names of the history variables of a frictional model: plastic shear strain, plastic volume, and
    /// temperature or, with `books_apart`, the volume that has opened.
    pub(crate) fn frictional_history(&self, books_apart: bool) -> &'static [&'static str] {
        match (self.temperature(), books_apart) {
            (Some(_), _) => &["plastic_shear_strain", "plastic_volume", "temperature"],
            (None, true) => &["plastic_shear_strain", "plastic_volume", "volume_gain"],
            (None, false) => &["plastic_shear_strain", "plastic_volume"],
        }
    }

    /// History variables of an undeformed particle: its temperature.
    pub(crate) fn initial_history(&self) -> [f64; HISTORIES] {
        let mut history = [0.0; HISTORIES];
        history[OWN] = self.temperature().unwrap_or(0.0);
        history
    }

    /// Temperature of the undeformed material, K, for laws with one.
    pub(crate) fn temperature(&self) -> Option<f64> {
        match &self.kind {
            Kind::JohnsonCook(law) => Some(law.temperature),
            _ => None,
        }
    }

    /// Temperature gained per plastic work, K/(J/m³).
    pub(crate) fn heat(&self) -> f64 {
        match &self.kind {
            Kind::JohnsonCook(law) => law.heat,
            _ => 0.0,
        }
    }

    /// Strength at a plastic strain, which includes the increment, and its derivative by the increment, Pa.
    #[inline(always)]
    pub(crate) fn strength<V: Vector>(&self, strain: V, flow: &Flow<V>, step: &Step) -> [V; 2] {
        let [value, slope] = self.whole_strength(strain, flow, step);
        [value * self.factor, slope * self.factor]
    }

    #[inline(always)]
    fn whole_strength<V: Vector>(&self, strain: V, flow: &Flow<V>, step: &Step) -> [V; 2] {
        let zero = V::splat(0.0);
        let initial = V::splat(self.initial);
        match &self.kind {
            Kind::Linear { modulus } => {
                let modulus = V::splat(*modulus);
                [strain.mul_add(modulus, initial), modulus]
            }
            Kind::Voce { gain, rate, modulus } => {
                let left = exp(strain * -rate);
                let linear = strain.mul_add(V::splat(*modulus), initial);
                let one = V::splat(1.0);
                [
                    (one - left).mul_add(V::splat(*gain), linear),
                    left.mul_add(V::splat(gain * rate), V::splat(*modulus)),
                ]
            }
            Kind::Ludwik { modulus, exponent } => {
                let [power, slope] = power(strain, *exponent);
                [power.mul_add(V::splat(*modulus), initial), slope * *modulus]
            }
            Kind::Swift { strain: past, exponent } => {
                let sum = strain + V::splat(*past);
                let power = exp(ln(sum * (1.0 / past)) * *exponent) * self.initial;
                [power, power * *exponent / sum]
            }
            Kind::Table(kinks) => {
                let (mut value, mut slope) = (initial, zero);
                for &[at, change] in kinks {
                    let beyond = strain - V::splat(at);
                    let passed = zero.le(beyond);
                    value = passed.select(beyond.mul_add(V::splat(change), value), value);
                    slope = passed.select(slope + V::splat(change), slope);
                }
                [value, slope]
            }
            Kind::LinearSoftening { residual, strain: whole } => {
                let scale = self.scale::<V>(step) * ((self.initial - residual) / whole);
                let value = (strain * scale).mul_add(V::splat(-1.0), initial);
                let falls = V::splat(*residual).lt(value);
                [falls.select(value, V::splat(*residual)), falls.select(-scale, zero)]
            }
            Kind::ExponentialSoftening { residual, strain: whole } => {
                let scale = self.scale::<V>(step) * (1.0 / whole);
                let left = exp(-(strain * scale)) * (self.initial - residual);
                [left + V::splat(*residual), -(left * scale)]
            }
            Kind::JohnsonCook(law) => law.strength(self.initial, strain, flow, step.dt),
        }
    }

    /// Strength above the residual one, as a share of that of the undeformed material above it: 1 to 0. Other
    /// parameters soften in proportion. 1 for laws that do not soften.
    #[inline(always)]
    pub(crate) fn progress<V: Vector>(&self, strain: V, step: &Step) -> V {
        let one = V::splat(1.0);
        match &self.kind {
            Kind::LinearSoftening { strain: whole, .. } => {
                (one - strain * self.scale::<V>(step) * (1.0 / whole)).max(V::splat(0.0))
            }
            Kind::ExponentialSoftening { strain: whole, .. } => {
                exp(-(strain * self.scale::<V>(step) * (1.0 / whole)))
            }
            _ => one,
        }
    }

    /// Edge of cells over the one for which strains of softening hold.
    #[inline(always)]
    fn scale<V: Vector>(&self, step: &Step) -> V {
        let one = V::splat(1.0);
        let Some(length) = self.length else { return one };
        let size = V::new(step.size);
        V::splat(0.0).lt(size).select(size * (1.0 / length), one)
    }
}

/// `x^n` and its derivative, for x from 0 on.
#[inline(always)]
fn power<V: Vector>(x: V, exponent: f64) -> [V; 2] {
    // The logarithm of 0 is that of the least normal number.
    let power = exp(ln(x) * exponent);
    [power, power * exponent / x.max(V::splat(f64::MIN_POSITIVE))]
}

/// Strains at which slopes change, and by how much.
fn kinks(points: &[[f64; 2]], initial: f64) -> Vec<[f64; 2]> {
    let (mut last, mut slope) = ([0.0, initial], 0.0);
    let mut kinks = Vec::with_capacity(points.len() + 1);
    for &point in points {
        let own = (point[1] - last[1]) / (point[0] - last[0]);
        kinks.push([last[0], own - slope]);
        (last, slope) = (point, own);
    }
    kinks.push([last[0], -slope]);
    kinks
}

impl JohnsonCook {
    #[inline(always)]
    fn strength<V: Vector>(&self, initial: f64, strain: V, flow: &Flow<V>, dt: f64) -> [V; 2] {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let [power, slope] = power(strain, self.exponent);
        let cold = power.mul_add(V::splat(self.modulus), V::splat(initial));
        let cold_slope = slope * self.modulus;
        let (mut rate, mut rate_slope) = (one, zero);
        // Without a step nothing has a rate.
        if self.rate_factor > 0.0 && dt > 0.0 {
            let ratio = flow.increment * (1.0 / (dt * self.reference_rate));
            let fast = one.lt(ratio);
            rate = fast.select(ln(ratio).mul_add(V::splat(self.rate_factor), one), one);
            rate_slope = fast.select(V::splat(self.rate_factor) / flow.increment, zero);
        }
        let [temperature, temperature_slope] = flow.temperature;
        let homologous = (temperature - V::splat(self.reference_temperature)) * (1.0 / self.range);
        let warm = zero.lt(homologous) & homologous.lt(one);
        let bounded = homologous.max(zero).min(one);
        let [lost, lost_slope] = self::power(bounded, self.thermal_exponent);
        let lost = zero.lt(bounded).select(lost, zero);
        let left = one - lost;
        let left_slope = warm.select(-(lost_slope * temperature_slope * (1.0 / self.range)), zero);
        let value = cold * rate * left;
        let slope = cold_slope * rate * left + cold * (rate_slope * left + rate * left_slope);
        [value, slope]
    }
}
