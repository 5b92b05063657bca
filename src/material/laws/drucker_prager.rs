//! Hencky elasticity with Drucker-Prager yield and isochoric flow for dry granular matter (Klar et
//! al. 2016, "Drucker-Prager elastoplasticity for sand animation"), in three dimensions; plane strain
//! is the same with zero out-of-plane stretch.
//!
//! With `ε` the trial strain plus the volume gain so far: where `tr ε >= 0` the grains come apart and all
//! strain is plastic; else `f = |dev ε| + (3λ + 2μ)/(2μ) tr(ε) α`, and where `f > 0` the deviator shrinks by
//! `f`.
//!
//! Volume correction (Tampubolon et al. 2017): the volume gained apart is stored as `ln J_p`, and a third of
//! it is added to each principal trial strain, so that the material carries stress again only after the gain
//! has been given back.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Model;
use super::metal::Overstress;
use crate::material::parameters::{Lame, OutOfRange};
use crate::material::root::Function;
use crate::material::solid::Hencky;
use crate::material::strength::angle;
use crate::material::strength::hardening::{Curve, Flow, Hardening};
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, OWN, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step, root};
use crate::simd::{Vector, VectorMask};

/// The cone through the Mohr-Coulomb pyramid on which a friction angle is matched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionMatch {
    /// Compression meridian: `alpha = sqrt(2/3) · 2 sin(phi) / (3 - sin(phi))` (Klar et al. 2016).
    #[default]
    TriaxialCompression,
    /// Extension meridian: `alpha = sqrt(2/3) · 2 sin(phi) / (3 + sin(phi))`.
    TriaxialExtension,
    /// Flow in plane strain; without dilation `alpha = sqrt(2) sin(phi) / 3`.
    PlaneStrain,
}

/// Hencky elasticity with Drucker-Prager yield, non-associated flow (Klar et al. 2016).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Young's modulus, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: f64,
    /// Friction angle, degrees; at least 0 and below 90.
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 90.0))]
    pub friction_angle: f64,
    /// Where the cone meets the Mohr-Coulomb friction angle.
    #[serde(default, rename = "match")]
    pub matching: FrictionMatch,
    /// Cohesion, Pa.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e13))]
    pub cohesion: f64,
    /// Dilation angle, degrees; at most the friction angle.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 90.0))]
    pub dilation_angle: f64,
    /// Greatest mean stress, Pa; by default only the apex bounds it.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e13))]
    pub tension_cutoff: Option<f64>,
    /// How the cohesion changes with plastic strain: a number is the modulus of linear hardening, Pa.
    #[serde(default)]
    pub hardening: Hardening,
    /// Viscosity η of the overstress, Pa s^h: `|dev τ|` exceeds its value at yield by `η |dev d_p|^h`
    /// (Perzyna 1966). 0: no overstress.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e13))]
    pub viscosity: f64,
    /// Exponent h of the rate in the overstress.
    #[serde(default = "one")]
    #[schemars(range(min = 0.05, max = 10.0))]
    pub rate_exponent: f64,
    /// Book the volume gained in tension and give it back on compression (Tampubolon et al. 2017).
    #[serde(default = "yes")]
    pub volume_correction: bool,
}

fn yes() -> bool {
    true
}

fn one() -> f64 {
    1.0
}

/// Properties beyond dry friction.
#[derive(Clone, Debug)]
struct Cohesive {
    /// Bulk modulus, Pa.
    bulk: f64,
    /// `|dev τ| + α tr τ ≤ k`: α, and k per cohesion.
    alpha: f64,
    strength: f64,
    /// Plastic volume per norm of the plastic shear strain, over 3.
    beta: f64,
    cohesion: Curve,
    /// Greatest mean stress, Pa.
    tension: f64,
    overstress: Option<Overstress>,
    volume_correction: bool,
}

/// α, k per cohesion, and β.
fn cone(p: &Parameters) -> [f64; 3] {
    let (sine, cosine) = (libm::sin(p.friction_angle.to_radians()), libm::cos(p.friction_angle.to_radians()));
    let dilation = libm::sin(p.dilation_angle.to_radians());
    let triaxial = |sign: f64| {
        let alpha = |sine: f64| (2.0_f64 / 3.0).sqrt() * 2.0 * sine / (3.0 + sign * sine);
        [alpha(sine), (2.0_f64 / 3.0).sqrt() * 6.0 * cosine / (3.0 + sign * sine), alpha(dilation)]
    };
    match p.matching {
        FrictionMatch::TriaxialCompression => triaxial(-1.0),
        FrictionMatch::TriaxialExtension => triaxial(1.0),
        FrictionMatch::PlaneStrain => {
            // Such that sin ψ is the ratio of rates of volume and shear in the plane.
            let beta = 2.0_f64.sqrt() * dilation / (9.0 + 3.0 * dilation * dilation).sqrt();
            let d = (0.5 * (1.0 - 1.5 * beta * beta)).sqrt();
            let denominator = d + 0.5 * beta * sine;
            [sine / (3.0 * denominator), cosine / denominator, beta]
        }
    }
}

/// Drucker-Prager material.
#[derive(Clone, Debug)]
pub struct DruckerPrager {
    dry: Dry,
    /// Cohesion and all else.
    cohesive: Option<Cohesive>,
}

/// Dry friction without dilation.
#[derive(Clone, Copy, Debug)]
struct Dry {
    solid: Hencky,
    /// `(3λ + 2μ)/(2μ) α`.
    slope: f64,
    /// 1 with volume correction, 0 without.
    correction: f64,
}

impl Model for DruckerPrager {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        let lame = Lame::new(p.young, p.poisson);
        let sine = libm::sin(p.friction_angle.to_radians());
        let alpha = match p.matching {
            FrictionMatch::TriaxialCompression => (2.0_f64 / 3.0).sqrt() * 2.0 * sine / (3.0 - sine),
            FrictionMatch::TriaxialExtension => (2.0_f64 / 3.0).sqrt() * 2.0 * sine / (3.0 + sine),
            FrictionMatch::PlaneStrain => 2.0_f64.sqrt() * sine / 3.0,
        };
        let slope = (3.0 * lame.lambda + 2.0 * lame.mu) / (2.0 * lame.mu) * alpha;
        let correction = if p.volume_correction { 1.0 } else { 0.0 };
        let dry = Dry { solid: Hencky::of(p.young, p.poisson, density), slope, correction };
        Self { dry, cohesive: Cohesive::new(p, lame, density) }
    }

    fn boxed(p: &Parameters, density: f64) -> Box<dyn crate::material::Material> {
        let whole = Self::new(p, density);
        if whole.cohesive.is_none() { Box::new(whole.dry) } else { Box::new(whole) }
    }

    fn check(p: &Parameters) -> Result<(), OutOfRange> {
        let angles = [p.friction_angle, p.dilation_angle];
        p.hardening.check_frictional(p.cohesion, angles, p.volume_correction)
    }

    fn weakened(p: &Parameters, factor: f64) -> Option<Parameters> {
        let friction_angle = angle::weakened(p.friction_angle, factor);
        Some(Parameters {
            friction_angle,
            cohesion: p.cohesion / factor,
            dilation_angle: p.dilation_angle.min(friction_angle),
            tension_cutoff: p.tension_cutoff.map(|tension| tension / factor),
            hardening: p.hardening.weakened(factor),
            ..p.clone()
        })
    }

    fn associated(p: &Parameters) -> Parameters {
        let share = angle::davis(p.friction_angle, p.dilation_angle);
        if share == 1.0 {
            return p.clone();
        }
        let friction_angle = angle::weakened(p.friction_angle, 1.0 / share);
        Parameters {
            friction_angle,
            cohesion: share * p.cohesion,
            dilation_angle: friction_angle,
            hardening: p.hardening.weakened(1.0 / share),
            // Temperature and volume gain share one history variable.
            volume_correction: p.volume_correction && !p.hardening.heats(),
            ..p.clone()
        }
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'drucker_prager', young = 1e6, poisson = 0.3, friction_angle = 30",
            "model = 'drucker_prager', young = 1e6, poisson = 0.3, friction_angle = 30, match = 'plane_strain', volume_correction = false",
            "model = 'drucker_prager', young = 1e6, poisson = 0.3, friction_angle = 35, cohesion = 2e3, dilation_angle = 10, \
             tension_cutoff = 1e3, match = 'triaxial_extension'",
            "model = 'drucker_prager', young = 1e6, poisson = 0.3, friction_angle = 25, cohesion = 1e4, volume_correction = false, \
             viscosity = 20.0, hardening = {kind = 'exponential_softening', residual = 2e3, strain = 0.1, length = 0.2}",
        ]
    }
}

impl Law for DruckerPrager {
    const HISTORIES: usize = OWN + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        match &self.cohesive {
            None => self.dry.respond(state, step),
            Some(cohesive) => cohesive.respond(&self.dry.solid, state, step),
        }
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        self.dry.solid.energy(state, plane)
    }

    fn density(&self) -> f64 {
        Law::density(&self.dry.solid)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(&self.dry.solid)
    }

    fn history_names(&self) -> &'static [&'static str] {
        match &self.cohesive {
            Some(own) => own.cohesion.frictional_history(own.books_apart()),
            None => self.dry.history_names(),
        }
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        self.cohesive.as_ref().map_or([0.0; HISTORIES], |own| own.cohesion.initial_history())
    }

    fn softens(&self) -> bool {
        self.cohesive.as_ref().is_some_and(|own| own.cohesion.softens())
    }

    fn solid(&self) -> Option<&Hencky> {
        Some(&self.dry.solid)
    }
}

impl Law for Dry {
    const HISTORIES: usize = PLASTIC_VOLUME + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let (shear, gain) = (state.history[PLASTIC_STRAIN], state.history[PLASTIC_VOLUME]);
        let trial = Strain::of(&state.elastic, step.plane);
        let booked = gain * self.correction;
        let trace = trial.trace + booked;
        let norm = trial.norm;
        let excess = trace.mul_add(V::splat(self.slope), norm);
        // An unstrained particle is elastic, so that it keeps its bits.
        let apart = zero.lt(trace) | (zero.le(trace) & zero.lt(norm));
        let flows = !apart & zero.lt(excess);
        // Strain without plastic flow; differs from the trial only where volume has been gained.
        let returns = zero.lt(booked.abs()) & !apart;
        let changed = apart | flows | returns;
        let mut kept = one;
        state.work = zero;
        if changed.any() {
            kept = apart.select(zero, flows.select(one - excess / norm, one));
            let slip = apart.select(norm, flows.select(excess, zero));
            state.history[PLASTIC_STRAIN] = shear + slip;
            // Volume that the elastic part gives up; none is left once the material is closed.
            let opened = gain + trial.trace;
            let closed = if self.correction == 0.0 { gain } else { zero };
            state.history[PLASTIC_VOLUME] = apart.select(opened, changed.select(closed, gain));
            let retained = norm - excess;
            state.work = flows.select(retained * excess * (2.0 * self.solid.shear_modulus()), zero);
        }
        let trace = apart.select(zero, trace);
        trial.finish(&self.solid, state, [trace, kept], changed, apart, step.plane);
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
        &["plastic_shear_strain", "volume_gain"]
    }

    fn solid(&self) -> Option<&Hencky> {
        Some(&self.solid)
    }
}

/// The cone of a particle as it shears.
struct Cone<'a, V> {
    law: &'a Cohesive,
    step: &'a Step,
    /// Plastic strain and temperature at the start of the step.
    strain: V,
    temperature: V,
}

impl<V: Vector> Cone<'_, V> {
    /// k after an increment of the norm of the plastic shear strain, and its derivative, Pa.
    #[inline(always)]
    fn strength(&self, increment: V) -> [V; 2] {
        let root = (2.0_f64 / 3.0).sqrt();
        let flow = Flow { increment: increment * root, temperature: [self.temperature, V::splat(0.0)] };
        let strain = increment.mul_add(V::splat(root), self.strain);
        let [value, slope] = self.law.cohesion.strength(strain, &flow, self.step);
        [value * self.law.strength, slope * (self.law.strength * root)]
    }

    /// Increment at which a load, reduced by `stiffness` per increment, equals the strength of the cone;
    /// `first` is that at the start.
    #[inline(always)]
    fn slip(&self, [load, first]: [V; 2], stiffness: f64, active: V::Mask) -> V {
        let least = V::splat(f64::MIN_POSITIVE);
        let high = (load * (1.0 / stiffness)).max(least);
        let guess = ((load - first) * (1.0 / stiffness)).max(least).min(high);
        let excess = Excess { cone: self, load, stiffness };
        let slip = root::newton(excess, guess, high, load.abs() * f64::EPSILON, active);
        active.select(slip, V::splat(0.0))
    }
}

/// Excess of a load over the strength after an increment of the norm of the plastic shear strain, Pa.
struct Excess<'a, V> {
    cone: &'a Cone<'a, V>,
    load: V,
    stiffness: f64,
}

impl<V: Vector> Function<V, [V; 2]> for Excess<'_, V> {
    #[inline(always)]
    fn at(&self, increment: V) -> [V; 2] {
        let [mut value, mut slope] = self.cone.strength(increment);
        if let Some(overstress) = self.cone.law.overstress {
            let [own, change] = overstress.of(increment, self.cone.step.dt);
            (value, slope) = (value + own, slope + change);
        }
        let stiffness = V::splat(self.stiffness);
        [increment.neg_mul_add(stiffness, self.load) - value, -(slope + stiffness)]
    }
}

impl Cohesive {
    /// The properties beyond dry friction; `None` for dry friction alone.
    fn new(p: &Parameters, lame: Lame, density: f64) -> Option<Self> {
        let cohesion = Curve::new(&p.hardening, p.cohesion, density);
        let overstress = Overstress::new(p.viscosity, p.rate_exponent);
        let is_dry = p.cohesion == 0.0 && cohesion.linear() == Some(0.0) && overstress.is_none();
        if is_dry && p.dilation_angle == 0.0 && p.tension_cutoff.is_none() {
            return None;
        }
        let [alpha, strength, beta] = cone(p);
        Some(Self {
            bulk: lame.lambda + 2.0 / 3.0 * lame.mu,
            alpha,
            strength,
            beta,
            cohesion,
            tension: p.tension_cutoff.unwrap_or(f64::INFINITY),
            overstress,
            volume_correction: p.volume_correction,
        })
    }

    /// Whether volume that has opened is stored apart from that of dilation.
    fn books_apart(&self) -> bool {
        self.volume_correction && self.beta > 0.0
    }

    /// Greatest trace that a cone of this strength carries, Pa.
    #[inline(always)]
    fn tip<V: Vector>(&self, strength: V) -> V {
        let apex = if self.alpha > 0.0 { strength * (1.0 / self.alpha) } else { V::splat(f64::INFINITY) };
        apex.min(V::splat(3.0 * self.tension))
    }

    /// Any cohesion, dilation, cut-off, hardening and overstress: `f = |dev τ| + α tr τ - k`, flow along
    /// `|dev τ| + β tr τ`.
    #[inline(always)]
    fn respond<V: Vector>(&self, solid: &Hencky, state: &mut State<V>, step: &Step) {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let root = (2.0_f64 / 3.0).sqrt();
        let twice_mu = 2.0 * solid.shear_modulus();
        let shear = state.history[PLASTIC_STRAIN];
        let volume = state.history[PLASTIC_VOLUME];
        let booked = match (self.volume_correction, self.books_apart()) {
            (false, _) => zero,
            (true, false) => volume,
            (true, true) => state.history[OWN],
        };
        let heats = self.cohesion.temperature().is_some();
        let temperature = if heats { state.history[OWN] } else { zero };
        let trial = Strain::of(&state.elastic, step.plane);
        let strain = trial.trace + booked;
        let (norm, trace) = (trial.norm * twice_mu, strain * (3.0 * self.bulk));
        let cone = Cone { law: self, step, strain: shear * root, temperature };
        let [first, _] = cone.strength(zero);
        let excess = trace.mul_add(V::splat(self.alpha), norm) - first;
        let shears = zero.lt(excess);
        // Without a step there is no rate-dependent flow, but the material opens at once.
        let torn = self.tip(first).lt(trace);
        let returns = zero.lt(booked.abs());
        let none = V::Mask::from_bits(0);
        let yields = if self.overstress.is_some() && step.dt <= 0.0 { none } else { shears };
        let flows = yields | torn;
        let changed = flows | returns;
        let (mut kept, mut end_trace, mut opens) = (one, trace, none);
        state.work = zero;
        if flows.any() {
            let volumetric = 9.0 * self.bulk * self.beta;
            let load = trace.mul_add(V::splat(self.alpha), norm);
            let mut slip = cone.slip([load, first], twice_mu + volumetric * self.alpha, yields);
            end_trace = slip.neg_mul_add(V::splat(volumetric), trace);
            let whole = trial.norm;
            let [mut end_strength, _] = cone.strength(slip.min(whole));
            let cut =
                (flows & self.tip(end_strength).lt(end_trace)) | (torn & !yields) | (yields & whole.lt(slip));
            if cut.any() {
                // At the apex all shear vanishes; at the cut-off the return is to the corner with the cone,
                // or shear stays.
                let mean = V::splat(3.0 * self.tension);
                let is_apex = first.le(mean * self.alpha);
                let load = is_apex.select(zero, mean).mul_add(V::splat(self.alpha), norm);
                let corner = cut & yields & !is_apex & first.lt(load);
                let own = (cut & yields & is_apex)
                    .select(whole, cone.slip([load, first], twice_mu, corner).min(whole));
                slip = cut.select(own, slip);
                [end_strength, _] = cone.strength(slip);
                end_trace = cut.select(self.tip(end_strength), end_trace);
            }
            opens = cut;
            let left = whole - slip;
            kept = (flows & zero.lt(whole)).select(left / whole, one);
            let plastic = (trace - end_trace) * (1.0 / (3.0 * self.bulk));
            let work = (left * twice_mu).mul_add(slip, end_trace * plastic * (1.0 / 3.0));
            state.work = flows.select(work, zero).max(zero);
            state.history[PLASTIC_STRAIN] = flows.select(shear + slip, shear);
        }
        let end = flows.select(end_trace * (1.0 / (3.0 * self.bulk)), strain);
        if changed.any() {
            state.history[PLASTIC_VOLUME] = changed.select(volume + (trial.trace - end), volume);
            if self.books_apart() {
                let gained = opens.select((strain - end).max(zero), zero);
                state.history[OWN] = changed.select(gained, booked);
            } else if self.volume_correction {
                // Once the material is closed no gain is left, not even by rounding.
                let gained = opens.select(state.history[PLASTIC_VOLUME], zero);
                state.history[PLASTIC_VOLUME] = changed.select(gained, volume);
            }
            if heats {
                state.history[OWN] = state.work.mul_add(V::splat(self.cohesion.heat()), temperature);
            }
        }
        trial.finish(solid, state, [end, kept], changed, none, step.plane);
    }
}
