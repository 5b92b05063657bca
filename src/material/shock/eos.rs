//! Equation of state of metals under shocks: Mie and Grüneisen, with a shock speed linear in that of the
//! material.
//!
//! With the compression `η = 1 - J` and the internal energy E per reference volume, that of shear not
//! counted,
//! ```text
//! p = A(η) + Γ E,   A = ρ_0 c_0² η (1 - Γ η/2) / (1 - s η)² for η > 0,   A = ρ_0 c_0² η for η < 0
//! ```
//! where the product of density and Grüneisen's parameter is that of the undeformed metal. Without heat `dE =
//! p dη`, so `E = S e^(Γη) + ∫_0^η A(y) e^(Γ(η-y)) dy`: S, the heat at the volume of the undeformed metal, is
//! constant, and pressure and energy are functions of the state. Heat h adds `h e^(-Γη)` to S. The integral
//! is that of Gauss with eight points; beyond `s η = 0.75` the curve A goes on straight.
//!
//! Below the tension limit metal opens (spall): stress vanishes, and its gain of volume is kept as plastic
//! volume until compression gives it back.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::laws::metal::{VonMises, Whole};
use crate::material::parameters::OutOfRange;
use crate::material::strength::hardening::Hardening;
use crate::material::tensor::eigen::determinant;
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, OWN, PLASTIC_VOLUME, State, Step};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask};

/// History variable of S, J/m³.
const HEAT: usize = OWN;
/// Greatest `s η` on the curve.
const STEEPEST: f64 = 0.75;
/// Points of Gauss in the interval from 0 to 1, with their weights.
const GAUSS: [[f64; 2]; 8] = [
    [0.019_855_071_751_231_9, 0.050_614_268_145_188_1],
    [0.101_666_761_293_186_6, 0.111_190_517_226_687_2],
    [0.237_233_795_041_835_5, 0.156_853_322_938_943_6],
    [0.408_282_678_752_175_1, 0.181_341_891_689_181],
    [0.591_717_321_247_825, 0.181_341_891_689_181],
    [0.762_766_204_958_164_5, 0.156_853_322_938_943_6],
    [0.898_333_238_706_813_4, 0.111_190_517_226_687_2],
    [0.980_144_928_248_768_1, 0.050_614_268_145_188_1],
];

/// Equation of state for the pressure. Young's modulus and Poisson's ratio then give the shear modulus alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Eos {
    /// Mie-Grüneisen about the states behind shocks, which travel at `sound_speed + slope u` into metal at
    /// rest that they set in motion at u.
    MieGruneisen {
        /// Speed c₀ of weak shocks in metal without strength, m/s: the bulk modulus is `density c₀²`.
        #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0))]
        sound_speed: f64,
        /// Slope s of the speed of shocks.
        #[schemars(range(min = 0.0, max = 10.0))]
        slope: f64,
        /// Grüneisen's parameter Γ of the undeformed metal.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 10.0))]
        gruneisen: f64,
        /// Mean tension that the metal bears, Pa; beyond it opens. By default it bears any.
        #[serde(default)]
        #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
        tension_limit: Option<f64>,
    },
}

impl Eos {
    /// Checks that a metal may have it.
    pub(in crate::material) fn check(self, has_damage: bool) -> Result<(), OutOfRange> {
        let Self::MieGruneisen { sound_speed, .. } = self;
        if !has_damage {
            return Ok(());
        }
        let range = "absent with damage, whose history variable it takes: use tension_limit".to_owned();
        Err(OutOfRange { key: "eos.sound_speed".to_owned(), value: sound_speed, range })
    }
}

/// Von Mises solid with an equation of state.
#[derive(Clone, Debug)]
pub(in crate::material) struct Shocked {
    metal: VonMises,
    /// `ρ_0 c_0²`, Pa.
    bulk: f64,
    slope: f64,
    gruneisen: f64,
    /// Pa.
    tension: f64,
    /// Part of the plastic work that becomes heat.
    heated: f64,
    /// Temperature of the undeformed metal, K, and its rise with heat, K/(J/m³); 0 without temperatures.
    temperature: f64,
    kelvin: f64,
}

/// Pressure of a particle.
struct Volume<V> {
    /// p, Pa.
    pressure: V,
    /// `dp/dη` without heat, Pa.
    stiffness: V,
    /// E, J/m³.
    energy: V,
}

impl Shocked {
    pub(in crate::material) fn new(metal: VonMises, eos: &Eos, hardening: &Hardening) -> Self {
        let Eos::MieGruneisen { sound_speed, slope, gruneisen, tension_limit } = *eos;
        let heated = hardening.homologous().map_or(1.0, |(_, fraction)| fraction);
        let kelvin = if heated > 0.0 { metal.warming() / heated } else { 0.0 };
        Self {
            bulk: metal.elastic().density() * sound_speed * sound_speed,
            slope,
            gruneisen,
            tension: tension_limit.unwrap_or(f64::INFINITY),
            heated,
            temperature: metal.temperature().unwrap_or(0.0),
            kelvin,
            metal,
        }
    }

    /// A and its derivative.
    #[inline(always)]
    fn curve<V: Vector>(&self, compression: V) -> [V; 2] {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let most = if self.slope > 0.0 { STEEPEST / self.slope } else { f64::MAX };
        let on = compression.max(zero).min(V::splat(most));
        let beyond = compression - on;
        let left = one / (one - on * self.slope);
        let factor = one - on * (0.5 * self.gruneisen);
        let value = on * factor * left * left;
        // d/dη of η (1 - Γη/2) (1 - sη)^-2.
        let slope = (one - on * self.gruneisen + factor * on * left * (2.0 * self.slope)) * left * left;
        [slope.mul_add(beyond, value) * self.bulk, slope * self.bulk]
    }

    /// State at a compression with the heat S.
    #[inline(always)]
    fn at<V: Vector>(&self, compression: V, heat: V) -> Volume<V> {
        let [value, slope] = self.curve(compression);
        let mut cold = V::splat(0.0);
        for [point, weight] in GAUSS {
            let [inner, _] = self.curve(compression * point);
            cold = inner.mul_add(exp(compression * (self.gruneisen * (1.0 - point))) * weight, cold);
        }
        let energy = cold.mul_add(compression, heat * exp(compression * self.gruneisen));
        let pressure = energy.mul_add(V::splat(self.gruneisen), value);
        Volume { pressure, stiffness: pressure.mul_add(V::splat(self.gruneisen), slope), energy }
    }

    /// The compression without pressure of metal that has opened, near 0.
    #[inline(always)]
    fn free<V: Vector>(&self, heat: V) -> V {
        let mut compression = -heat * (self.gruneisen / self.bulk);
        for _ in 0..4 {
            let Volume { pressure, stiffness, .. } = self.at(compression, heat);
            compression = compression - pressure / stiffness.max(V::splat(0.01 * self.bulk));
        }
        compression
    }

    /// Heat at the volume of the undeformed metal over heat at a compression.
    #[inline(always)]
    fn to_reference<V: Vector>(&self, compression: V) -> V {
        exp((compression * -self.gruneisen).min(V::splat(50.0)))
    }

    /// Bound of the wave speeds with this volume ratio.
    #[inline(always)]
    fn waves<V: Vector>(&self, stiffness: V, ratio: V) -> V {
        let elastic = self.metal.elastic();
        let bulk = (stiffness * ratio * ratio).max(V::splat(0.0));
        ((bulk + V::splat(4.0 / 3.0 * elastic.shear_modulus())) * (1.0 / elastic.density())).sqrt()
    }
}

impl Law for Shocked {
    const HISTORIES: usize = HEAT + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let (gain, heat) = (state.history[PLASTIC_VOLUME], state.history[HEAT]);
        let was_open = zero.lt(gain);
        let trial = Strain::of(&state.elastic, step.plane);
        let whole = trial.trace + gain;
        let compression = one - exp(whole);
        let tried = self.at(compression, heat);
        let limit = was_open.select(zero, V::splat(-self.tension));
        let opens = tried.pressure.lt(limit);
        let mut lost = zero;
        let mut free = zero;
        if opens.any() {
            free = self.free(heat);
            let shear = trial.norm * trial.norm * self.metal.elastic().shear_modulus();
            let freed = tried.energy - self.at(free, heat).energy + shear;
            lost = (opens & !was_open).select(freed, zero).max(zero);
        }
        // The metal sees the deviator and the elastic volume; its own pressure is replaced.
        let closed = opens.select(ln(one - free), whole);
        let changes = opens | was_open;
        if changes.any() {
            let kept = opens.select(zero, one);
            trial.rewrite(state, [closed, kept], changes, V::Mask::from_bits(0), step.plane);
        }
        state.history[PLASTIC_VOLUME] = opens.select(whole - closed, zero);
        // Temperature follows the volume as E does, from that of the undeformed metal on.
        let warm = heat.mul_add(V::splat(self.kelvin), V::splat(self.temperature));
        state.history[HEAT] = warm * exp(compression * self.gruneisen);
        self.metal.return_curved(state, step, Whole);
        let made = state.work * self.heated;
        state.work = (state.work - made).max(zero) + lost;
        state.history[HEAT] = made.mul_add(self.to_reference(compression), heat);
        let ratio = one - compression;
        let pressure = opens.select(zero, made.mul_add(V::splat(self.gruneisen), tried.pressure) * ratio);
        let mean = (state.stress[0] + state.stress[1] + state.stress[2]) * (1.0 / 3.0) + pressure;
        for normal in &mut state.stress[..3] {
            *normal = *normal - mean;
        }
        state.wave_speed = self.waves(tried.stiffness, ratio);
    }

    /// That of shear, and E of the elastic volume.
    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        let strain = Strain::of(&state.elastic, plane);
        let compression = V::splat(1.0) - exp(strain.trace);
        let shear = strain.norm * strain.norm * self.metal.elastic().shear_modulus();
        shear + self.at(compression, state.history[HEAT]).energy
    }

    #[inline(always)]
    fn take_heat<V: Vector>(&self, state: &mut State<V>, heat: V) -> V {
        let ratio = determinant(&state.elastic).sqrt();
        let scale = self.to_reference(V::splat(1.0) - ratio);
        state.history[HEAT] = heat.mul_add(scale, state.history[HEAT]);
        let more = heat * ratio * self.gruneisen;
        let is_open = V::splat(0.0).lt(state.history[PLASTIC_VOLUME]);
        let more = is_open.select(V::splat(0.0), more);
        for normal in &mut state.stress[..3] {
            *normal = *normal - more;
        }
        heat
    }

    fn density(&self) -> f64 {
        self.metal.elastic().density()
    }

    fn wave_speed(&self) -> f64 {
        let elastic = self.metal.elastic();
        ((self.bulk + 4.0 / 3.0 * elastic.shear_modulus()) / elastic.density()).sqrt()
    }

    fn is_firm(&self) -> bool {
        self.metal.is_firm()
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["plastic_strain", "plastic_volume", "heat"]
    }
}

const _: () = assert!(Shocked::HISTORIES <= HISTORIES);
