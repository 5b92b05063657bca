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
use super::hencky::Hencky;
use super::parameters::FrictionMatch;
use super::strain::Strain;
use super::{Lame, Law, Material, Response, State, Symmetric, parameters};
use crate::simd::{Lanes, Vector, VectorMask, widest};

/// Drucker-Prager granular material.
#[derive(Clone, Copy, Debug)]
pub struct DruckerPrager {
    solid: Hencky,
    /// `(3λ + 2μ)/(2μ) α`.
    slope: f64,
    /// 1 with volume correction, 0 without.
    correction: f64,
}

impl DruckerPrager {
    /// From parameters and density, kg/m³.
    pub fn new(p: &parameters::DruckerPrager, density: f64) -> Self {
        let lame = Lame::new(p.young, p.poisson);
        let sine = libm::sin(p.friction_angle.to_radians());
        let alpha = match p.matching {
            FrictionMatch::TriaxialCompression => (2.0_f64 / 3.0).sqrt() * 2.0 * sine / (3.0 - sine),
            FrictionMatch::PlaneStrain => 2.0_f64.sqrt() * sine / 3.0,
        };
        let slope = (3.0 * lame.lambda + 2.0 * lame.mu) / (2.0 * lame.mu) * alpha;
        let correction = if p.volume_correction { 1.0 } else { 0.0 };
        Self { solid: Hencky::new(lame, density), slope, correction }
    }
}

impl Law for DruckerPrager {
    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, plane: bool) {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let [shear, gain] = state.history;
        let trial = Strain::of(&state.elastic, plane);
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
            state.history[0] = shear + slip;
            // What the elastic part gives up; nothing is booked any more once the material is closed.
            let opened = gain + trial.trace;
            let closed = if self.correction == 0.0 { gain } else { zero };
            state.history[1] = apart.select(opened, changed.select(closed, gain));
            let retained = norm - excess;
            state.work = flows.select(retained * excess * (2.0 * self.solid.shear_modulus()), zero);
        }
        let trace = apart.select(zero, trace);
        trial.finish(&self.solid, state, [trace, kept], changed, apart, plane);
    }
}

impl Material for DruckerPrager {
    fn update(&self, state: &mut State, plane: bool) {
        widest(Response(self, state, plane));
    }

    fn energy(&self, b: &Symmetric, plane: bool) -> Lanes {
        self.solid.energy(b, plane)
    }

    fn density(&self) -> f64 {
        self.solid.density()
    }

    fn wave_speed(&self) -> f64 {
        Material::wave_speed(&self.solid)
    }

    fn is_plastic(&self) -> bool {
        true
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["plastic_shear_strain", "volume_gain"]
    }
}
