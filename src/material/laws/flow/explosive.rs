//! High explosive: products after Jones, Wilkins and Lee (JWL), with a burn that starts at points.
//!
//! With the volume ratio V and the energy E per volume of the explosive, products have
//! ```text
//! p = A e^(-R₁V) + B e^(-R₂V) + C V^-(1+ω),   E = A/R₁ e^(-R₁V) + B/R₂ e^(-R₂V) + C/ω V^-ω
//! ```
//! where C is constant without heat; heat h adds `ω V^ω h` to it. What has not burned has the pressure `ρ c²
//! (1 - V)` and the energy `E₀ + ρ c² (1 - V)²/2`. A particle with the burnt part F has the sums of both,
//! weighted with F and 1 - F. The front reaches a particle at `t₀ + |X - X₀|/D` (programmed burn, Wilkins
//! 1964); from then on F grows to 1 while the front passes `WIDTH` cells. What burns at a volume V keeps
//! its energy, and so becomes products with the C of `E(V, C) = E₀ + ρ c² (1 - V)²/2`; C of the particle is
//! the mean by mass. So energy is conserved to round-off, and a steady front has the state of Chapman and
//! Jouguet if `D` and `E₀` belong to the products.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::forget_shear;
use crate::geometry::written;
use crate::material::laws::Model;
use crate::material::parameters::OutOfRange;
use crate::material::tensor::eigen;
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, OWN, State, Step};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask};

/// History variable of F; below 0 minus the time until the front is there, s.
const BURN: usize = 0;
/// History variable of C, Pa.
const ADIABAT: usize = OWN;
/// Cells over which the front burns.
const WIDTH: f64 = 3.0;
/// Greatest difference of the burnt parts of particles that merge.
const ALIKE: f64 = 0.05;

/// High explosive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Coefficient A of the products, Pa.
    #[schemars(range(min = 0.0, max = 1e14))]
    pub a: f64,
    /// Coefficient B of the products, Pa.
    #[schemars(range(min = -1e13, max = 1e13))]
    pub b: f64,
    /// Exponent R₁ of the products.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub r1: f64,
    /// Exponent R₂ of the products.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub r2: f64,
    /// Coefficient ω of the products: their adiabatic index is 1 + ω once they have expanded.
    #[schemars(range(max = 5.0), extend("exclusiveMinimum" = 0.0))]
    pub omega: f64,
    /// Energy E₀ per volume of the explosive, J/m³.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub energy: f64,
    /// Speed D of the detonation, m/s.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0))]
    pub detonation_velocity: f64,
    /// Speed c of sound in what has not burned, m/s; a third of D by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0))]
    pub sound_speed: Option<f64>,
    /// Points from which it burns. Without any, all of it has burned at the start, at the volume of the
    /// explosive.
    #[serde(default)]
    #[schemars(length(max = 100))]
    pub ignition: Vec<Ignition>,
}

/// A point from which an explosive burns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ignition {
    /// The point, m, in the coordinates of the job.
    pub point: written::Vector,
    /// Time at which it is lit, s.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub time: f64,
}

/// Law of an explosive.
#[derive(Clone, Debug)]
pub struct Explosive {
    /// A and B, Pa, with R₁ and R₂.
    terms: [[f64; 2]; 2],
    omega: f64,
    /// E₀, J/m³.
    energy: f64,
    /// D, m/s.
    detonation: f64,
    /// c, m/s.
    sound: f64,
    density: f64,
    ignition: Vec<Ignition>,
}

/// Products at a volume.
struct Products<V> {
    /// `V^ω`.
    power: V,
    /// p, Pa.
    pressure: V,
    /// E, J/m³.
    energy: V,
    /// `-dp/dV` without heat, Pa.
    stiffness: V,
}

impl Model for Explosive {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        Self {
            terms: [[p.a, p.r1], [p.b, p.r2]],
            omega: p.omega,
            energy: p.energy,
            detonation: p.detonation_velocity,
            sound: p.sound_speed.unwrap_or(p.detonation_velocity / 3.0),
            density,
            ignition: p.ignition.clone(),
        }
    }

    fn check(p: &Parameters) -> Result<(), OutOfRange> {
        let law = Self::new(p, 1.0);
        let fail = |key: &str, value: f64, range: &str| {
            Err(OutOfRange { key: key.to_owned(), value, range: range.to_owned() })
        };
        if law.sound >= p.detonation_velocity {
            return fail("sound_speed", law.sound, "below detonation_velocity, so that nothing runs ahead");
        }
        if law.fresh_adiabat() <= 0.0 {
            let cold = p.energy - law.fresh_adiabat() / p.omega;
            let range = format!("above the energy {cold:.4e} that a and b give products at this volume");
            return fail("energy", p.energy, &range);
        }
        Ok(())
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'explosive', a = 3.712e5, b = 3.231e3, r1 = 4.15, r2 = 0.95, omega = 0.3, energy = 7e3, detonation_velocity = 8.85",
            "model = 'explosive', a = 3.712e5, b = 3.231e3, r1 = 4.15, r2 = 0.95, omega = 0.3, energy = 7e3, detonation_velocity = 8.85, \
             sound_speed = 3.0, ignition = [{point = [0.0, 0.0, 0.0], time = 0.0}]",
        ]
    }
}

impl Explosive {
    /// C of products that have burned at the volume of the explosive, Pa.
    fn fresh_adiabat(&self) -> f64 {
        let cold: f64 = self.terms.iter().map(|[a, r]| a / r * libm::exp(-r)).sum();
        self.omega * (self.energy - cold)
    }

    #[inline(always)]
    fn products<V: Vector>(&self, volume: V, trace: V, adiabat: V) -> Products<V> {
        let power = exp(trace * self.omega);
        let thermal = adiabat / power;
        let mut of = Products {
            power,
            pressure: thermal / volume,
            energy: thermal * (1.0 / self.omega),
            stiffness: thermal / (volume * volume) * (1.0 + self.omega),
        };
        for [a, r] in self.terms {
            let term = exp(volume * -r) * a;
            of.pressure += term;
            of.energy = term.mul_add(V::splat(1.0 / r), of.energy);
            of.stiffness = term.mul_add(V::splat(r), of.stiffness);
        }
        of
    }

    /// Energy of what has not burned, J/m³.
    #[inline(always)]
    fn unburnt<V: Vector>(&self, volume: V) -> V {
        let closed = V::splat(1.0) - volume;
        (closed * closed).mul_add(V::splat(0.5 * self.bulk()), V::splat(self.energy))
    }

    /// `ρ c²`, Pa.
    fn bulk(&self) -> f64 {
        self.density * self.sound * self.sound
    }

    /// The burnt part after a step.
    #[inline(always)]
    fn burn<V: Vector>(&self, before: V, step: &Step) -> V {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let waits = before.lt(zero);
        let time = waits.select(before, zero) + V::splat(step.dt);
        // Without cells the front has no width.
        let rate = if step.cell.is_finite() { self.detonation / (WIDTH * step.cell) } else { 1e300 };
        let part = (before.max(zero) + time.max(zero) * rate).min(one);
        (waits & time.le(zero)).select(time, part)
    }
}

impl Law for Explosive {
    const HISTORIES: usize = ADIABAT + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let strain = Strain::of(&state.elastic, step.plane);
        let volume = exp(strain.trace);
        let was = state.history[BURN].max(zero);
        let next = self.burn(state.history[BURN], step);
        let part = next.max(zero);
        let mut adiabat = state.history[ADIABAT];
        let burns = was.lt(part);
        if burns.any() {
            let cold = self.products(volume, strain.trace, zero);
            let fresh = (self.unburnt(volume) - cold.energy) * cold.power * self.omega;
            let mean = was.mul_add(adiabat, (part - was) * fresh) / part;
            adiabat = burns.select(mean, adiabat);
        }
        state.history[BURN] = next;
        state.history[ADIABAT] = adiabat;
        let products = self.products(volume, strain.trace, adiabat);
        let left = one - part;
        let pressure = part.mul_add(products.pressure, left * (one - volume) * self.bulk());
        let stiffness = part.mul_add(products.stiffness, left * self.bulk());
        forget_shear(state, strain.trace, strain.norm);
        let tension = -(pressure * volume);
        state.stress = [tension, tension, tension, zero, zero, zero];
        state.work = zero;
        let wave = (stiffness.max(zero) * (1.0 / self.density)).sqrt() * volume;
        // The front is a wave as well.
        state.wave_speed = part.lt(one).select(wave.max(V::splat(self.detonation)), wave);
    }

    /// That of both parts less E₀: 0 at the start, and the work that has been done is below 0.
    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, _plane: bool) -> V {
        let trace = ln(eigen::determinant(&state.elastic)) * 0.5;
        let volume = exp(trace);
        let part = state.history[BURN].max(V::splat(0.0));
        let products = self.products(volume, trace, state.history[ADIABAT]).energy;
        let unburnt = self.unburnt(volume);
        part.mul_add(products - unburnt, unburnt - V::splat(self.energy))
    }

    /// Products take it up.
    #[inline(always)]
    fn take_heat<V: Vector>(&self, state: &mut State<V>, heat: V) -> V {
        let zero = V::splat(0.0);
        let part = state.history[BURN];
        let taken = V::splat(1e-6).lt(part).select(heat, zero);
        let power = exp(ln(eigen::determinant(&state.elastic)) * (0.5 * self.omega));
        let gain = taken * power * self.omega / part.max(V::splat(1e-6));
        state.history[ADIABAT] += gain;
        for normal in &mut state.stress[..3] {
            *normal = *normal - taken * self.omega;
        }
        let more = taken * (self.omega * (1.0 + self.omega) / self.density);
        state.wave_speed = state.wave_speed.mul_add(state.wave_speed, more).sqrt();
        taken
    }

    fn density(&self) -> f64 {
        self.density
    }

    /// The front is the fastest wave of what burns; products at the volume of the explosive have their sound.
    fn wave_speed(&self) -> f64 {
        let [[a, r1], [b, r2]] = self.terms;
        let thermal = self.fresh_adiabat() * (1.0 + self.omega);
        let stiffness = a * r1 * libm::exp(-r1) + b * r2 * libm::exp(-r2) + thermal;
        (stiffness / self.density).sqrt().max(self.detonation)
    }

    fn rest_pressure(&self) -> f64 {
        let [[a, r1], [b, r2]] = self.terms;
        match self.ignition.is_empty() {
            true => a * libm::exp(-r1) + b * libm::exp(-r2) + self.fresh_adiabat(),
            false => 0.0,
        }
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["burn", "plastic_volume", "adiabat"]
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        let mut history = [0.0; HISTORIES];
        if self.ignition.is_empty() {
            (history[BURN], history[ADIABAT]) = (1.0, self.fresh_adiabat());
        }
        history
    }

    fn place_history(&self, place: &[f64], time: f64, history: &mut [f64; HISTORIES]) {
        let way = |point: &[f64]| point.iter().zip(place).map(|(a, x)| (a - x) * (a - x)).sum::<f64>().sqrt();
        let arrivals = self.ignition.iter().map(|own| own.time + way(&own.point.0) / self.detonation);
        if let Some(first) = arrivals.reduce(f64::min) {
            history[BURN] = (time - first).min(0.0);
        }
    }

    fn alike(&self, a: &[f64; HISTORIES], b: &[f64; HISTORIES]) -> bool {
        let part = |history: &[f64; HISTORIES]| history[BURN].max(0.0);
        (a[BURN] < 0.0) == (b[BURN] < 0.0) && (part(a) - part(b)).abs() <= ALIKE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::driver::Point;

    /// TNT (Lee, Finger and Collins 1973).
    const TNT: &str = "model = 'explosive', a = 3.712e11, b = 3.231e9, r1 = 4.15, r2 = 0.95, omega = 0.3, \
                       energy = 7e9, detonation_velocity = 6930.0";

    fn tnt(more: &str) -> Explosive {
        match format!("{TNT}{more}").parse() {
            Ok(crate::material::Parameters::Explosive(parameters)) => Explosive::new(&parameters, 1630.0),
            other => panic!("{other:?}"),
        }
    }

    /// The line of Rayleigh of the given D touches the states that burning can reach at 21 GPa, the pressure
    /// of Chapman and Jouguet of the source, and the energy of products follows their pressure.
    #[test]
    fn products_have_the_state_of_chapman_and_jouguet() {
        let law = tnt("");
        let rayleigh = |v: f64| 1630.0 * 6930.0 * 6930.0 * (1.0 - v);
        let hugoniot = |v: f64| {
            let cold = |r: f64, a: f64| (a * libm::exp(-r * v), a / r * libm::exp(-r * v));
            let [(p1, e1), (p2, e2)] = law.terms.map(|[a, r]| cold(r, a));
            // p = p1 + p2 + ω (E - e1 - e2)/v with E = E₀ + p (1 - v)/2.
            (p1 + p2 + 0.3 * (7e9 - e1 - e2) / v) / (1.0 - 0.15 * (1.0 - v) / v)
        };
        let volumes = (0..4000).map(|i| 0.6 + 1e-4 * f64::from(i));
        let excess = |v: f64| hugoniot(v) / rayleigh(v) - 1.0;
        let touch =
            volumes.clone().filter(|v| *v < 0.95).min_by(|a, b| excess(*a).total_cmp(&excess(*b))).unwrap();
        assert!(excess(touch).abs() < 0.01, "{touch} {}", excess(touch));
        assert!((rayleigh(touch) / 21e9 - 1.0).abs() < 0.02, "{}", rayleigh(touch));
        let mut point = Point::new(&law);
        assert!((-point.stress[0] / law.rest_pressure() - 1.0).abs() < 1e-12);
        for _ in 0..50 {
            let (before, stress) = (point.energy(), point.stress[0]);
            point.stretch([1e-4; 3]);
            let work = 0.5 * (stress + point.stress[0]) * 3e-4;
            assert!(((point.energy() - before) / work - 1.0).abs() < 1e-6);
        }
    }

    /// A particle at a distance burns when the front is there, at constant volume with the energy of all of
    /// it.
    #[test]
    fn burning_keeps_the_energy() {
        let law = tnt(", ignition = [{point = [0.0, 0.0], time = 1e-5}, {point = [0.1, 0.0], time = 0.0}]");
        let mut history = Law::initial_history(&law);
        Law::place_history(&law, &[0.04, 0.0], 2e-6, &mut history);
        let arrival = 0.06 / 6930.0;
        assert!((history[BURN] + arrival - 2e-6).abs() < 1e-18);
        let mut point = Point::new(&law);
        (point.history, point.dt, point.cell) = (history, 1e-7, 1e-3);
        point.stretch([-0.02; 3]);
        let start = point.energy();
        assert!(start > 0.0);
        for step in 0..90 {
            point.stretch([0.0; 3]);
            assert!((point.energy() - start).abs() < 1e-13 * 7e9, "{step} {} {start}", point.energy());
            let time = 2e-6 + 1e-7 * f64::from(step + 2) - arrival;
            let part = (time * 6930.0 / 3e-3).clamp(0.0, 1.0);
            assert!((point.history[BURN].max(0.0) - part).abs() < 1e-9, "{step} {part}");
        }
        assert_eq!(point.history[BURN], 1.0);
    }
}
