//! Hencky elasticity with Drucker-Prager yield and isochoric flow for dry granular matter (Klar et
//! al. 2016, "Drucker-Prager elastoplasticity for sand animation"), in three dimensions; plane strain
//! is the same with zero out-of-plane stretch.
//!
//! With `ε` the trial strain plus the booked volume gain: where `tr ε >= 0` the grains come apart and
//! all strain is plastic; else `f = |dev ε| + (3λ + 2μ)/(2μ) tr(ε) α`, and where `f > 0` the deviator
//! shrinks by `f`.
//!
//! Volume correction (Tampubolon et al. 2017): the volume gained apart is booked as `ln J_p` and a
//! third of it is added to each principal trial strain, so that the material carries stress again
//! only after the gain has been given back.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Model;
use super::hencky::Hencky;
use crate::material::parameters::Lame;
use crate::material::tensor::strain::Strain;
use crate::material::{Law, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step};
use crate::simd::{Vector, VectorMask};

/// The cone through the Mohr-Coulomb pyramid on which a friction angle is matched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionMatch {
    /// Compression meridian: `alpha = sqrt(2/3) · 2 sin(phi) / (3 - sin(phi))` (Klar et al. 2016).
    #[default]
    TriaxialCompression,
    /// Non-dilatant flow in plane strain: `alpha = sqrt(2) sin(phi) / 3`.
    PlaneStrain,
}

/// Hencky elasticity with Drucker-Prager yield, non-associated flow (Klar et al. 2016).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// Book the volume gained in tension and give it back on compression (Tampubolon et al. 2017).
    #[serde(default = "yes")]
    pub volume_correction: bool,
}

fn yes() -> bool {
    true
}

/// Drucker-Prager granular material.
#[derive(Clone, Copy, Debug)]
pub struct DruckerPrager {
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
            FrictionMatch::PlaneStrain => 2.0_f64.sqrt() * sine / 3.0,
        };
        let slope = (3.0 * lame.lambda + 2.0 * lame.mu) / (2.0 * lame.mu) * alpha;
        let correction = if p.volume_correction { 1.0 } else { 0.0 };
        Self { solid: Hencky::of(p.young, p.poisson, density), slope, correction }
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'drucker_prager', young = 1e6, poisson = 0.3, friction_angle = 30",
            "model = 'drucker_prager', young = 1e6, poisson = 0.3, friction_angle = 30, match = 'plane_strain', volume_correction = false",
        ]
    }
}

impl Law for DruckerPrager {
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
        // Strain without plastic flow; differs from the trial only where a gain of volume is booked.
        let returns = zero.lt(booked.abs()) & !apart;
        let changed = apart | flows | returns;
        let mut kept = one;
        state.work = zero;
        if changed.any() {
            kept = apart.select(zero, flows.select(one - excess / norm, one));
            let slip = apart.select(norm, flows.select(excess, zero));
            state.history[PLASTIC_STRAIN] = shear + slip;
            // What the elastic part gives up; nothing is booked any more once the material is closed.
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
}
