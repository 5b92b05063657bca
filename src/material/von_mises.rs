//! Hencky elasticity with von Mises yield and linear isotropic hardening; radial return in principal
//! logarithmic strains (Simo 1992).
//!
//! `f = |dev τ| - √(2/3) (σ_y + H κ)`, closed form: `Δγ = f / (2μ + 2H/3)`, `Δκ = √(2/3) Δγ`.
use super::hencky::{energy, principal_strains, principal_stresses, wave_speed};
use super::{Lame, Material, State, Symmetric, parameters};
use crate::kernel::math::exp;
use crate::kernel::simd::Lanes;

/// Von Mises solid.
#[derive(Clone, Copy, Debug)]
pub struct VonMises {
    lame: Lame,
    yield_stress: f64,
    hardening: f64,
    density: f64,
}

impl VonMises {
    /// From parameters and density, kg/m³.
    pub fn new(p: &parameters::VonMises, density: f64) -> Self {
        let lame = Lame::new(p.young, p.poisson);
        Self { lame, yield_stress: p.yield_stress, hardening: p.hardening, density }
    }
}

impl Material for VonMises {
    fn update(&self, state: &mut State, plane: bool) {
        let zero = Lanes::splat(0.0);
        let one = Lanes::splat(1.0);
        let root = (2.0_f64 / 3.0).sqrt();
        let twice_mu = Lanes::splat(2.0 * self.lame.mu);
        let (eigen, trial) = principal_strains(&state.elastic, plane);
        let mean = (trial[0] + trial[1] + trial[2]) * (1.0 / 3.0);
        let deviator = trial.map(|e| e - mean);
        let norm = deviator[0]
            .mul_add(deviator[0], deviator[1].mul_add(deviator[1], deviator[2] * deviator[2]))
            .sqrt();
        let radius = |kappa: Lanes| {
            kappa.mul_add(Lanes::splat(root * self.hardening), Lanes::splat(root * self.yield_stress))
        };
        let excess = norm.mul_add(twice_mu, -radius(state.history[0]));
        let flows = zero.lt(excess);
        let mut strain = trial;
        state.work = zero;
        if flows.any() {
            let flow = excess * (1.0 / (2.0 * self.lame.mu + 2.0 / 3.0 * self.hardening));
            let kept = one - flow / norm;
            for k in 0..3 {
                strain[k] = flows.select(deviator[k].mul_add(kept, mean), trial[k]);
            }
            let kappa = flow.mul_add(Lanes::splat(root), state.history[0]);
            state.history[0] = flows.select(kappa, state.history[0]);
            state.work = flows.select(radius(kappa) * flow, zero);
            let elastic = eigen.compose(&strain.map(|e| exp(e + e)), plane);
            for c in 0..6 {
                state.elastic[c] = flows.select(elastic[c], state.elastic[c]);
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
        &["plastic_strain"]
    }
}
