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
use super::hencky::{energy, principal_strains, principal_stresses, wave_speed};
use super::parameters::FrictionMatch;
use super::{Lame, Material, State, Symmetric, parameters};
use crate::kernel::math::exp;
use crate::kernel::simd::Lanes;

/// Drucker-Prager granular material.
#[derive(Clone, Copy, Debug)]
pub struct DruckerPrager {
    lame: Lame,
    /// `(3λ + 2μ)/(2μ) α`.
    slope: f64,
    /// 1 with volume correction, 0 without.
    correction: f64,
    density: f64,
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
        Self { lame, slope, correction: if p.volume_correction { 1.0 } else { 0.0 }, density }
    }
}

impl Material for DruckerPrager {
    fn update(&self, state: &mut State, plane: bool) {
        let zero = Lanes::splat(0.0);
        let one = Lanes::splat(1.0);
        let [shear, gain] = state.history;
        let (eigen, trial) = principal_strains(&state.elastic, plane);
        let trial_trace = trial[0] + trial[1] + trial[2];
        let booked = gain * self.correction;
        let trace = trial_trace + booked;
        let mean = trace * (1.0 / 3.0);
        let trial_mean = trial_trace * (1.0 / 3.0);
        let deviator = trial.map(|e| e - trial_mean);
        let norm = deviator[0]
            .mul_add(deviator[0], deviator[1].mul_add(deviator[1], deviator[2] * deviator[2]))
            .sqrt();
        let excess = trace.mul_add(Lanes::splat(self.slope), norm);
        // An unstrained particle is elastic, so that it keeps its bits.
        let apart = zero.lt(trace) | (zero.le(trace) & zero.lt(norm));
        let flows = !apart & zero.lt(excess);
        // Strain without plastic flow; differs from the trial only where a gain of volume is booked.
        let third = booked * (1.0 / 3.0);
        let returns = zero.lt(booked.abs()) & !apart;
        let changed = apart | flows | returns;
        let mut strain = trial;
        state.work = zero;
        if changed.any() {
            let kept = one - excess / norm;
            for k in 0..3 {
                let sheared = deviator[k].mul_add(kept, mean);
                strain[k] = flows.select(sheared, trial[k] + third);
                strain[k] = apart.select(zero, strain[k]);
                strain[k] = changed.select(strain[k], trial[k]);
            }
            let slip = apart.select(norm, flows.select(excess, zero));
            state.history[0] = shear + slip;
            // What the elastic part gives up; nothing is booked any more once the material is closed.
            let opened = gain + trial_trace;
            let closed = if self.correction == 0.0 { gain } else { zero };
            state.history[1] = apart.select(opened, changed.select(closed, gain));
            let retained = norm - excess;
            state.work = flows.select(retained * excess * (2.0 * self.lame.mu), zero);
            let elastic = eigen.compose(&strain.map(|e| exp(e + e)), plane);
            for c in 0..6 {
                // Exactly the unit tensor, not its product with rounded eigenvectors.
                let unit = Lanes::splat(if c < 3 { 1.0 } else { 0.0 });
                let returned = apart.select(unit, elastic[c]);
                state.elastic[c] = changed.select(returned, state.elastic[c]);
            }
        }
        state.stress = eigen.compose(&principal_stresses(&self.lame, &strain), plane);
        state.wave_speed = wave_speed(&self.lame, self.density, &state.stress);
    }

    fn energy(&self, b: &Symmetric, plane: bool) -> Lanes {
        energy(&self.lame, b, plane)
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.lame.pressure_wave() / self.density).sqrt()
    }

    fn is_plastic(&self) -> bool {
        true
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["plastic_shear_strain", "volume_gain"]
    }
}
