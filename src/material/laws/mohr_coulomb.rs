//! Soil and rock: Hencky elasticity with Mohr-Coulomb yield, in Kirchhoff stress, tension positive, `τ₁ ≥ τ₂ ≥ τ₃`:
//! `f = (τ₁ - τ₃) + (τ₁ + τ₃) sin φ - 2c cos φ`.
//!
//! Flow is along the same with the dilation angle ψ in place of φ, exact on edges and at the apex (`coulomb.rs`). With
//! `flow = "radial"` the deviator shrinks instead and the mean stays: isochoric, as Drucker-Prager's.
//!
//! Cohesion hardens or softens with `κ = √(2/3) |dev ε_p|`; angles may soften with it. Where the material opens (apex, cut-off),
//! the volume that it gains is booked and given back on compression (Tampubolon et al. 2017).
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Model;
use super::hencky::Hencky;
use crate::material::coulomb::{Pyramid, Returned};
use crate::material::hardening::{Curve, Flow, Hardening};
use crate::material::parameters::{Lame, OutOfRange};
use crate::material::tensor::principal::Principal;
use crate::material::tensor::strain::{Strain, finish};
use crate::material::{HISTORIES, Law, OWN, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step, root};
use crate::simd::{Vector, VectorMask, each};

/// How the material flows at yield.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FlowRule {
    /// Along the pyramid of the dilation angle: exact on faces, edges and at the apex.
    #[default]
    Pyramid,
    /// Along the deviator, at constant volume; faster, as it needs no more than the eigenvalues.
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

/// An angle that may soften.
#[derive(Clone, Copy, Debug)]
struct Angle {
    /// Sine and cosine at the start.
    sine: f64,
    cosine: f64,
    /// What softens away, radians.
    softens: f64,
}

impl Angle {
    /// From degrees at the start and at the end.
    fn new(first: f64, last: f64) -> Self {
        let angle = first.to_radians();
        Self { sine: libm::sin(angle), cosine: libm::cos(angle), softens: (first - last).to_radians() }
    }

    /// Sine and cosine once a part, from 0 to 1, of what may soften has gone.
    #[inline(always)]
    fn softened<V: Vector>(self, lost: V) -> [V; 2] {
        let (sine, cosine) = (V::splat(self.sine), V::splat(self.cosine));
        if self.softens == 0.0 {
            return [sine, cosine];
        }
        // Taylor series of the change, which is below π/2.
        let x = lost * self.softens;
        let square = x * x;
        let series = |first: u32| {
            (1..=11).rev().fold(V::splat(1.0), |sum, term| {
                let n = f64::from(2 * term + first);
                (square * sum).neg_mul_add(V::splat(1.0 / (n * (n - 1.0))), V::splat(1.0))
            })
        };
        let (s, c) = (x * series(1), series(0));
        [sine * c - cosine * s, cosine * c + sine * s]
    }
}

/// Mohr-Coulomb material.
#[derive(Clone, Debug)]
pub struct MohrCoulomb {
    solid: Hencky,
    elastic: Lame,
    cohesion: Curve,
    friction: Angle,
    dilation: Angle,
    tension: f64,
    radial: bool,
    volume_correction: bool,
}

impl Model for MohrCoulomb {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        let softening = |angle: f64, residual: Option<f64>| Angle::new(angle, residual.unwrap_or(angle));
        Self {
            friction: softening(p.friction_angle, p.residual_friction_angle),
            dilation: softening(p.dilation_angle, p.residual_dilation_angle),
            tension: p.tension_cutoff.unwrap_or(f64::INFINITY),
            radial: p.flow == FlowRule::Radial,
            volume_correction: p.volume_correction,
            ..Self::of(p.young, p.poisson, density, Curve::new(&p.hardening, p.cohesion, density))
        }
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

impl MohrCoulomb {
    /// Without friction, dilation and cut-off, and with this cohesion.
    pub(super) fn of(young: f64, poisson: f64, density: f64, cohesion: Curve) -> Self {
        Self {
            solid: Hencky::of(young, poisson, density),
            elastic: Lame::new(young, poisson),
            cohesion,
            friction: Angle::new(0.0, 0.0),
            dilation: Angle::new(0.0, 0.0),
            tension: f64::INFINITY,
            radial: false,
            volume_correction: false,
        }
    }

    /// Whether volume that has opened is booked apart from that of dilation.
    fn books_apart(&self) -> bool {
        self.volume_correction && self.dilation.sine > 0.0
    }

    /// Whether the pyramid depends on the state.
    fn hardens(&self) -> bool {
        self.cohesion.linear() != Some(0.0)
    }

    /// The pyramid at a plastic strain, of which `increment` came in this step.
    #[inline(always)]
    fn pyramid<V: Vector>(&self, strain: V, increment: V, temperature: V, step: &Step) -> Pyramid<V> {
        let tension = V::splat(self.tension);
        if !self.hardens() {
            return Pyramid {
                friction: V::splat(self.friction.sine),
                dilation: V::splat(self.dilation.sine),
                strength: V::splat(2.0 * self.cohesion.initial() * self.friction.cosine),
                tension,
            };
        }
        let zero = V::splat(0.0);
        let flow = Flow { increment, temperature: [temperature, zero] };
        let [cohesion, _] = self.cohesion.strength(strain, &flow, step);
        let lost = V::splat(1.0) - self.cohesion.progress(strain, step);
        let [sine, cosine] = self.friction.softened(lost);
        let [dilation, _] = self.dilation.softened(lost);
        Pyramid { friction: sine, dilation, strength: cohesion * cosine * 2.0, tension }
    }
}

/// Where principal stresses end, and what is lost on the way.
#[derive(Clone, Copy)]
struct Outcome<V: Vector> {
    returned: Returned<V>,
    /// Increment of the norm of the plastic shear strain.
    shear: V,
}

impl Law for MohrCoulomb {
    const HISTORIES: usize = OWN + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let zero = V::splat(0.0);
        let (twice_mu, bulk) = (2.0 * self.elastic.mu, self.elastic.lambda + 2.0 / 3.0 * self.elastic.mu);
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
        let trace = trial.trace + booked;
        let (mean, norm) = (trace * bulk, trial.norm * twice_mu);
        state.work = zero;
        let kappa = shear * (2.0_f64 / 3.0).sqrt();
        let first = self.pyramid(kappa, zero, temperature, step);
        let returns = zero.lt(booked.abs());
        if !(first.may_flow(mean, norm) | returns).any() {
            return trial.finish(
                &self.solid,
                state,
                [trace, zero],
                V::Mask::from_bits(0),
                V::Mask::from_bits(0),
                step.plane,
            );
        }
        let principal = Principal::of(&trial.deviator, trial.norm);
        let deviator = principal.sorted();
        let stress = each(deviator, |strain| strain.mul_add(V::splat(twice_mu), mean));
        let returned = |pyramid: &Pyramid<V>| -> Outcome<V> {
            let returned = match self.radial {
                false => pyramid.returned(&stress, &self.elastic),
                true => radial(pyramid, &stress, mean),
            };
            let end = &returned.stress;
            let end_mean = (end[0] + end[1] + end[2]) * (1.0 / 3.0);
            let mut square = zero;
            for k in 0..3 {
                let slip = (stress[k] - mean) - (end[k] - end_mean);
                square = slip.mul_add(slip, square);
            }
            Outcome { returned, shear: square.sqrt() * (1.0 / twice_mu) }
        };
        let mut outcome = returned(&first);
        if self.hardens() {
            let flows = outcome.returned.flows;
            let root = (2.0_f64 / 3.0).sqrt();
            let at = |increment: V| self.pyramid(kappa + increment, increment, temperature, step);
            let excess = |increment: V| returned(&at(increment)).shear * root - increment;
            let high = trial.norm * (2.0 * root);
            let increment = root::bracketed(excess, high, trial.norm * f64::EPSILON, flows);
            outcome = returned(&at(flows.select(increment, zero)));
            outcome.returned.flows = flows;
        }
        let Returned { stress: end, flows, opens } = outcome.returned;
        let changed = flows | returns;
        let end_mean = (end[0] + end[1] + end[2]) * (1.0 / 3.0);
        let end_trace = flows.select(end_mean * (1.0 / bulk), trace);
        let kept = each(end, |stress| (stress - end_mean) * (1.0 / twice_mu));
        let composed = principal.compose(&kept);
        let mut end_deviator = trial.deviator;
        let mut work = zero;
        for c in 0..6 {
            end_deviator[c] = flows.select(composed[c], end_deviator[c]);
        }
        for k in 0..3 {
            let plastic = (deviator[k] - kept[k]) + (trace - end_trace) * (1.0 / 3.0);
            work = end[k].mul_add(plastic, work);
        }
        let work = flows.select(work, zero).max(zero);
        state.work = work;
        state.history[PLASTIC_STRAIN] = flows.select(shear + outcome.shear, shear);
        state.history[PLASTIC_VOLUME] = changed.select(volume + (trial.trace - end_trace), volume);
        if !self.volume_correction {
            // Not given back, but part of the volume all the same.
        } else if self.books_apart() {
            let gained = (trace - end_trace).max(zero);
            state.history[OWN] = changed.select(opens.select(gained, zero), booked);
        } else {
            // Nothing is booked any more once the material is closed, not even by rounding.
            let gained = opens.select(state.history[PLASTIC_VOLUME], zero);
            state.history[PLASTIC_VOLUME] = changed.select(gained, volume);
        }
        if heats {
            state.history[OWN] = work.mul_add(V::splat(self.cohesion.heat()), temperature);
        }
        finish(&trial, &self.solid, state, (end_trace, &end_deviator), changed, step.plane);
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
        self.cohesion.frictional_history(self.books_apart())
    }

    fn initial_history(&self) -> [f64; HISTORIES] {
        self.cohesion.initial_history()
    }

    fn softens(&self) -> bool {
        self.cohesion.softens()
    }

    fn solid(&self) -> Option<&Hencky> {
        Some(&self.solid)
    }
}

/// Shrinks the deviator to the pyramid at constant mean.
#[inline(always)]
fn radial<V: Vector>(pyramid: &Pyramid<V>, stress: &[V; 3], mean: V) -> Returned<V> {
    let zero = V::splat(0.0);
    let deviator = each(*stress, |stress| stress - mean);
    let size = (deviator[0] + deviator[2]).mul_add(pyramid.friction, deviator[0] - deviator[2]);
    let allowed = (mean * -2.0).mul_add(pyramid.friction, pyramid.strength);
    let (apex, flows) = (pyramid.apex(), allowed.lt(size));
    let opens = flows & apex.le(mean);
    let kept = (allowed / size).max(zero);
    let mut end = *stress;
    for k in 0..3 {
        let on_face = deviator[k].mul_add(kept, mean);
        end[k] = flows.select(opens.select(apex, on_face), stress[k]);
    }
    Returned { stress: end, flows, opens }
}
