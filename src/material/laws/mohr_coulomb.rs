//! Soil and rock: Hencky elasticity with Mohr-Coulomb yield, in Kirchhoff stress, tension positive,
//! `τ₁ ≥ τ₂ ≥ τ₃`: `f = (τ₁ - τ₃) + (τ₁ + τ₃) sin φ - 2c cos φ`.
//!
//! Flow is along the same with the dilation angle ψ in place of φ, exact on edges and at the apex
//! (`strength/coulomb.rs`). With `flow = "radial"` the deviator shrinks instead and the mean stays:
//! isochoric, as Drucker-Prager's.
//!
//! Cohesion hardens or softens with `κ = √(2/3) |dev ε_p|`; angles may soften with it. Where the material
//! opens (apex, cut-off), the volume that it gains is stored, and given back on compression (Tampubolon et
//! al. 2017).
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Model;
use crate::material::parameters::{Lame, OutOfRange};
use crate::material::root::Function;
use crate::material::solid::Hencky;
use crate::material::strength::angle::{self, Angle};
use crate::material::strength::coulomb::{Pyramid, Returned, Slopes};
use crate::material::strength::hardening::{Curve, Flow, Hardening};
use crate::material::tensor::principal::{Lone, Principal};
use crate::material::tensor::strain::{Strain, finish};
use crate::material::{HISTORIES, Law, OWN, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step, root};
use crate::simd::{Lanes, Vector, VectorMask, each};

/// How the material flows at yield.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FlowRule {
    /// Along the pyramid of the dilation angle: exact on faces, edges and at the apex.
    #[default]
    Pyramid,
    /// Along the deviator, at constant volume.
    Radial,
}

/// Hencky elasticity with Mohr-Coulomb yield.
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
    /// Cohesion, Pa.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e13))]
    pub cohesion: f64,
    /// Dilation angle, degrees; at most the friction angle.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 90.0))]
    pub dilation_angle: f64,
    /// Greatest principal stress, Pa; by default only the apex bounds it.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e13))]
    pub tension_cutoff: Option<f64>,
    /// How it flows at yield.
    #[serde(default)]
    pub flow: FlowRule,
    /// How the cohesion changes with plastic strain: a number is the modulus of linear hardening, Pa.
    #[serde(default)]
    pub hardening: Hardening,
    /// Friction angle once the cohesion has softened to its residual, degrees; by default it does not change.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 90.0))]
    pub residual_friction_angle: Option<f64>,
    /// Dilation angle once the cohesion has softened to its residual, degrees; by default it does not change.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("exclusiveMaximum" = 90.0))]
    pub residual_dilation_angle: Option<f64>,
    /// Book the volume gained in tension and give it back on compression (Tampubolon et al. 2017).
    #[serde(default = "yes")]
    pub volume_correction: bool,
}

fn yes() -> bool {
    true
}

/// Mohr-Coulomb material.
#[derive(Clone, Debug)]
pub struct MohrCoulomb(pub(super) Properties);

/// The law with a pyramid that depends on the state, or with a fixed one: separate kernels, which are smaller
/// and faster.
#[derive(Clone, Debug)]
struct Only<const HARDENS: bool>(MohrCoulomb);

/// Properties that follow from the parameters.
#[derive(Clone, Debug)]
pub(super) struct Properties {
    solid: Hencky,
    elastic: Lame,
    /// Bulk modulus, Pa; one over it, and one over twice the shear modulus, 1/Pa.
    bulk: f64,
    per_bulk: f64,
    per_twice_mu: f64,
    cohesion: Curve,
    friction: Angle,
    dilation: Angle,
    tension: f64,
    radial: bool,
    volume_correction: bool,
    /// The pyramid where it does not depend on the state.
    fixed: Option<(Pyramid<f64>, Slopes<f64>)>,
}

impl Model for MohrCoulomb {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        let softening = |angle: f64, residual: Option<f64>| Angle::new(angle, residual.unwrap_or(angle));
        let own = Properties {
            friction: softening(p.friction_angle, p.residual_friction_angle),
            dilation: softening(p.dilation_angle, p.residual_dilation_angle),
            tension: p.tension_cutoff.unwrap_or(f64::INFINITY),
            radial: p.flow == FlowRule::Radial,
            volume_correction: p.volume_correction,
            fixed: None,
            ..Properties::of(p.young, p.poisson, density, Curve::new(&p.hardening, p.cohesion, density))
        };
        Self(own.with_fixed_pyramid())
    }

    fn boxed(p: &Parameters, density: f64) -> Box<dyn crate::material::Material> {
        Self::new(p, density).0.boxed()
    }

    fn check(p: &Parameters) -> Result<(), OutOfRange> {
        let angles = [p.friction_angle, p.dilation_angle];
        p.hardening.check_frictional(p.cohesion, angles, p.volume_correction)?;
        let within = |key: &str, value: f64, limit: f64, name: &str| {
            let range = format!("at most {name}, {limit}");
            if value <= limit { Ok(()) } else { Err(OutOfRange { key: key.to_owned(), value, range }) }
        };
        let friction = p.residual_friction_angle.unwrap_or(p.friction_angle);
        within("residual_friction_angle", friction, p.friction_angle, "friction_angle")?;
        let dilation = p.residual_dilation_angle.unwrap_or(p.dilation_angle);
        within("residual_dilation_angle", dilation, p.dilation_angle, "dilation_angle")?;
        within("residual_dilation_angle", dilation, friction, "residual_friction_angle")?;
        if p.flow == FlowRule::Radial {
            let none = "0 with flow = \"radial\", which keeps the volume".to_owned();
            if p.dilation_angle > 0.0 {
                return Err(OutOfRange {
                    key: "dilation_angle".into(),
                    value: p.dilation_angle,
                    range: none,
                });
            }
            if let Some(value) = p.tension_cutoff {
                let range = "left out with flow = \"radial\"".to_owned();
                return Err(OutOfRange { key: "tension_cutoff".into(), value, range });
            }
        }
        Ok(())
    }

    fn weakened(p: &Parameters, factor: f64) -> Option<Parameters> {
        let friction_angle = angle::weakened(p.friction_angle, factor);
        let residual_friction_angle = p.residual_friction_angle.map(|angle| angle::weakened(angle, factor));
        let least = residual_friction_angle.unwrap_or(friction_angle);
        Some(Parameters {
            friction_angle,
            residual_friction_angle,
            cohesion: p.cohesion / factor,
            dilation_angle: p.dilation_angle.min(friction_angle),
            residual_dilation_angle: p.residual_dilation_angle.map(|angle| angle.min(least)),
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
        let residual_friction_angle =
            p.residual_friction_angle.map(|angle| angle::weakened(angle, 1.0 / share));
        Parameters {
            friction_angle,
            residual_friction_angle,
            cohesion: share * p.cohesion,
            dilation_angle: friction_angle,
            residual_dilation_angle: residual_friction_angle,
            flow: FlowRule::Pyramid,
            hardening: p.hardening.weakened(1.0 / share),
            // Temperature and volume gain share one history variable.
            volume_correction: p.volume_correction && !p.hardening.heats(),
            ..p.clone()
        }
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'mohr_coulomb', young = 1e6, poisson = 0.3, friction_angle = 30",
            "model = 'mohr_coulomb', young = 1e6, poisson = 0.3, friction_angle = 30, flow = 'radial'",
            "model = 'mohr_coulomb', young = 1e6, poisson = 0.3, friction_angle = 35, cohesion = 2e3, dilation_angle = 10, \
             tension_cutoff = 1e3",
            "model = 'mohr_coulomb', young = 1e6, poisson = 0.3, friction_angle = 25, cohesion = 1e4, dilation_angle = 5, \
             volume_correction = false, residual_friction_angle = 20, residual_dilation_angle = 0, \
             hardening = {kind = 'exponential_softening', residual = 2e3, strain = 0.1, length = 0.2}",
            "model = 'mohr_coulomb', young = 1e6, poisson = 0.3, friction_angle = 20, cohesion = 1e3, flow = 'radial', \
             hardening = {kind = 'voce', saturation = 4e3, rate = 10.0}",
        ]
    }
}

impl Properties {
    /// Without friction, dilation and cut-off, and with this cohesion.
    pub(super) fn of(young: f64, poisson: f64, density: f64, cohesion: Curve) -> Self {
        let elastic = Lame::new(young, poisson);
        let bulk = elastic.lambda + 2.0 / 3.0 * elastic.mu;
        let own = Self {
            solid: Hencky::of(young, poisson, density),
            elastic,
            bulk,
            per_bulk: 1.0 / bulk,
            per_twice_mu: 1.0 / (2.0 * elastic.mu),
            cohesion,
            friction: Angle::new(0.0, 0.0),
            dilation: Angle::new(0.0, 0.0),
            tension: f64::INFINITY,
            radial: false,
            volume_correction: false,
            fixed: None,
        };
        own.with_fixed_pyramid()
    }

    /// The law as the solver calls it.
    pub(super) fn boxed(self) -> Box<dyn crate::material::Material> {
        let whole = MohrCoulomb(self);
        match whole.0.fixed {
            Some(_) => Box::new(Only::<false>(whole)),
            None => Box::new(Only::<true>(whole)),
        }
    }

    /// Computes the parts that do not depend on the state, once for all.
    fn with_fixed_pyramid(mut self) -> Self {
        if !self.hardens() {
            let pyramid = Pyramid {
                friction: Lanes::splat(self.friction.sine),
                dilation: Lanes::splat(self.dilation.sine),
                strength: Lanes::splat(2.0 * self.cohesion.initial() * self.friction.cosine),
                tension: Lanes::splat(self.tension),
            };
            let first = |lanes: Lanes| lanes.to_array()[0];
            self.fixed = Some((pyramid.map(first), pyramid.slopes(&self.elastic).map(first)));
        }
        self
    }

    /// Whether volume that has opened is stored apart from that of dilation.
    fn books_apart(&self) -> bool {
        self.volume_correction && self.dilation.sine > 0.0
    }

    /// Whether the pyramid depends on the state.
    fn hardens(&self) -> bool {
        self.cohesion.linear() != Some(0.0)
    }

    /// The pyramid at a plastic strain, of which `increment` came in this step.
    #[inline(always)]
    fn pyramid<V: Vector, const HARDENS: bool>(
        &self,
        strain: V,
        increment: V,
        temperature: V,
        step: &Step,
    ) -> (Pyramid<V>, Slopes<V>) {
        if let (false, Some((pyramid, slopes))) = (HARDENS, &self.fixed) {
            return (pyramid.map(V::splat), slopes.map(V::splat));
        }
        let zero = V::splat(0.0);
        let flow = Flow { increment, temperature: [temperature, zero] };
        let [cohesion, _] = self.cohesion.strength(strain, &flow, step);
        let (mut friction, mut cosine) = (V::splat(self.friction.sine), V::splat(self.friction.cosine));
        let mut dilation = V::splat(self.dilation.sine);
        if self.friction.softens != 0.0 || self.dilation.softens != 0.0 {
            let lost = V::splat(1.0) - self.cohesion.progress(strain, step);
            [friction, cosine] = self.friction.softened(lost);
            [dilation, _] = self.dilation.softened(lost);
        }
        let strength = cohesion * cosine * 2.0;
        let pyramid = Pyramid { friction, dilation, strength, tension: V::splat(self.tension) };
        (pyramid, pyramid.slopes(&self.elastic))
    }
}

/// Returned principal stresses, and the plastic strain of the return.
#[derive(Clone, Copy)]
struct Outcome<V: Vector> {
    returned: Returned<V>,
    /// Mean of the stresses, Pa.
    mean: V,
    /// Increment of the norm of the plastic shear strain.
    shear: V,
}

/// The return of a trial stress.
struct Return<'a, V> {
    law: &'a Properties,
    step: &'a Step,
    /// Principal stresses, greatest first, and their mean, Pa.
    stress: [V; 3],
    mean: V,
    /// Plastic strain and temperature at the start of the step.
    strain: V,
    temperature: V,
}

impl<V: Vector> Return<'_, V> {
    /// To a pyramid.
    #[inline(always)]
    fn to(&self, pyramid: &Pyramid<V>, slopes: &Slopes<V>) -> Outcome<V> {
        let returned = match self.law.radial {
            false => pyramid.returned(&self.stress, slopes, &self.law.elastic),
            true => radial(pyramid, slopes, &self.stress, self.mean),
        };
        let end = &returned.stress;
        let mean = (end[0] + end[1] + end[2]) * (1.0 / 3.0);
        let mut square = V::splat(0.0);
        for k in 0..3 {
            let slip = (self.stress[k] - self.mean) - (end[k] - mean);
            square = slip.mul_add(slip, square);
        }
        Outcome { returned, mean, shear: square.sqrt() * self.law.per_twice_mu }
    }

    /// To the pyramid after an increment of the plastic strain.
    #[inline(always)]
    fn after(&self, increment: V) -> Outcome<V> {
        let strain = self.strain + increment;
        let (pyramid, slopes) = self.law.pyramid::<V, true>(strain, increment, self.temperature, self.step);
        self.to(&pyramid, &slopes)
    }
}

/// Plastic strain of the return to the pyramid after an increment, less that increment.
impl<V: Vector> Function<V, V> for &Return<'_, V> {
    #[inline(always)]
    fn at(&self, increment: V) -> V {
        self.after(increment).shear * (2.0_f64 / 3.0).sqrt() - increment
    }
}

impl Properties {
    /// The law. `HARDENS`: whether the pyramid depends on the state.
    #[inline(always)]
    fn flow<V: Vector, const HARDENS: bool>(&self, state: &mut State<V>, step: &Step) {
        let zero = V::splat(0.0);
        let none = V::Mask::from_bits(0);
        let root = (2.0_f64 / 3.0).sqrt();
        let twice_mu = 2.0 * self.elastic.mu;
        let shear = state.history[PLASTIC_STRAIN];
        let volume = state.history[PLASTIC_VOLUME];
        let booked = match (self.volume_correction, self.books_apart()) {
            (false, _) => zero,
            (true, false) => volume,
            (true, true) => state.history[OWN],
        };
        let heats = HARDENS && self.cohesion.temperature().is_some();
        let temperature = if heats { state.history[OWN] } else { zero };
        let trial = Strain::of(&state.elastic, step.plane);
        let trace = trial.trace + booked;
        let (mean, norm) = (trace * self.bulk, trial.norm * twice_mu);
        state.work = zero;
        let strain = shear * root;
        let (pyramid, slopes) = self.pyramid::<V, HARDENS>(strain, zero, temperature, step);
        let returns = zero.lt(booked.abs());
        let [holds, yields] = pyramid.surely(mean, norm, &slopes);
        if !(!holds | returns).any() {
            return trial.finish(&self.solid, state, [trace, zero], none, none, step.plane);
        }
        let lone = Lone::of(&trial.deviator, trial.norm);
        if !(yields | returns).any() {
            let stress = each(lone.nearly_sorted(), |strain| strain.mul_add(V::splat(twice_mu), mean));
            if (holds | pyramid.holds(&stress, norm * 1e-6)).all() {
                return trial.finish(&self.solid, state, [trace, zero], none, none, step.plane);
            }
        }
        let principal = Principal::of(&lone);
        let deviator = principal.sorted();
        let stress = each(deviator, |strain| strain.mul_add(V::splat(twice_mu), mean));
        let whole = Return { law: self, step, stress, mean, strain, temperature };
        let mut outcome = whole.to(&pyramid, &slopes);
        if HARDENS {
            let flows = outcome.returned.flows;
            let at_once = outcome.shear * root;
            let points = [at_once, at_once, trial.norm * (2.0 * root)];
            let increment = root::bracketed(&whole, points, trial.norm * f64::EPSILON, flows);
            outcome = whole.after(flows.select(increment, zero));
            outcome.returned.flows = flows;
        }
        let Outcome { returned: Returned { stress: end, flows, opens }, mean: end_mean, shear: slip } =
            outcome;
        let changed = flows | returns;
        let end_trace = flows.select(end_mean * self.per_bulk, trace);
        let kept = each(end, |stress| (stress - end_mean) * self.per_twice_mu);
        let mut work = zero;
        for k in 0..3 {
            let plastic = (deviator[k] - kept[k]) + (trace - end_trace) * (1.0 / 3.0);
            work = end[k].mul_add(plastic, work);
        }
        let work = flows.select(work, zero).max(zero);
        state.work = work;
        state.history[PLASTIC_STRAIN] = flows.select(shear + slip, shear);
        state.history[PLASTIC_VOLUME] = changed.select(volume + (trial.trace - end_trace), volume);
        if !self.volume_correction {
            // Not given back, but part of the plastic volume.
        } else if self.books_apart() {
            let gained = (trace - end_trace).max(zero);
            state.history[OWN] = changed.select(opens.select(gained, zero), booked);
        } else {
            // Once the material is closed no gain is left, not even by rounding.
            let gained = opens.select(state.history[PLASTIC_VOLUME], zero);
            state.history[PLASTIC_VOLUME] = changed.select(gained, volume);
        }
        if heats {
            state.history[OWN] = work.mul_add(V::splat(self.cohesion.heat()), temperature);
        }
        let composed = principal.compose(&kept);
        let mut end_deviator = trial.deviator;
        for c in 0..6 {
            end_deviator[c] = flows.select(composed[c], end_deviator[c]);
        }
        finish(&trial, &self.solid, state, (end_trace, &end_deviator), changed, step.plane);
    }
}

impl Law for MohrCoulomb {
    const HISTORIES: usize = OWN + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        match self.0.fixed {
            Some(_) => self.0.flow::<V, false>(state, step),
            None => self.0.flow::<V, true>(state, step),
        }
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        Law::energy(&self.0.solid, state, plane)
    }

    fn density(&self) -> f64 {
        Law::density(&self.0.solid)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(&self.0.solid)
    }

    fn history_names(&self) -> &'static [&'static str] {
        self.0.cohesion.frictional_history(self.0.books_apart())
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        self.0.cohesion.initial_history()
    }

    /// Without friction it is Tresca's law.
    fn is_firm(&self) -> bool {
        self.0.friction.is_zero()
    }

    fn softens(&self) -> bool {
        self.0.cohesion.softens()
    }

    fn solid(&self) -> Option<&Hencky> {
        Some(&self.0.solid)
    }
}

impl<const HARDENS: bool> Law for Only<HARDENS> {
    const HISTORIES: usize = <MohrCoulomb as Law>::HISTORIES;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let Self(MohrCoulomb(properties)) = self;
        properties.flow::<V, HARDENS>(state, step);
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        Law::energy(&self.0, state, plane)
    }

    fn density(&self) -> f64 {
        Law::density(&self.0)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(&self.0)
    }

    fn history_names(&self) -> &'static [&'static str] {
        Law::history_names(&self.0)
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        Law::initial_history(&self.0)
    }

    fn is_firm(&self) -> bool {
        Law::is_firm(&self.0)
    }

    fn softens(&self) -> bool {
        Law::softens(&self.0)
    }

    fn solid(&self) -> Option<&Hencky> {
        self.0.solid()
    }
}

/// Shrinks the deviator to the pyramid at constant mean.
#[inline(always)]
fn radial<V: Vector>(pyramid: &Pyramid<V>, slopes: &Slopes<V>, stress: &[V; 3], mean: V) -> Returned<V> {
    let zero = V::splat(0.0);
    let deviator = each(*stress, |stress| stress - mean);
    let size = (deviator[0] + deviator[2]).mul_add(pyramid.friction, deviator[0] - deviator[2]);
    let allowed = (mean * -2.0).mul_add(pyramid.friction, pyramid.strength);
    let (apex, flows) = (slopes.apex, allowed.lt(size));
    let opens = flows & apex.le(mean);
    let kept = (allowed / size).max(zero);
    let mut end = *stress;
    for k in 0..3 {
        let on_face = deviator[k].mul_add(kept, mean);
        end[k] = flows.select(opens.select(apex, on_face), stress[k]);
    }
    Returned { stress: end, flows, opens }
}
