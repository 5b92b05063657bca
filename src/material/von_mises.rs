//! Hencky elasticity with von Mises yield and linear isotropic hardening; radial return in logarithmic
//! strains (Simo 1992).
//!
//! `f = |dev τ| - √(2/3) (σ_y + H κ)`, closed form: `Δγ = f / (2μ + 2H/3)`, `Δκ = √(2/3) Δγ`.
use super::hencky::Hencky;
use super::strain::Strain;
use super::{Lame, Law, Material, Response, State, Symmetric, parameters};
use crate::simd::{Lanes, Vector, VectorMask, widest};

/// Von Mises solid.
#[derive(Clone, Copy, Debug)]
pub struct VonMises {
    solid: Hencky,
    yield_stress: f64,
    hardening: f64,
}

impl VonMises {
    /// From parameters and density, kg/m³.
    pub fn new(p: &parameters::VonMises, density: f64) -> Self {
        let lame = Lame::new(p.young, p.poisson);
        Self { solid: Hencky::new(lame, density), yield_stress: p.yield_stress, hardening: p.hardening }
    }
}

impl Law for VonMises {
    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, plane: bool) {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let root = (2.0_f64 / 3.0).sqrt();
        let mu = self.solid.shear_modulus();
        let trial = Strain::of(&state.elastic, plane);
        let radius =
            |kappa: V| kappa.mul_add(V::splat(root * self.hardening), V::splat(root * self.yield_stress));
        let excess = trial.norm.mul_add(V::splat(2.0 * mu), -radius(state.history[0]));
        let flows = zero.lt(excess);
        let mut kept = one;
        state.work = zero;
        if flows.any() {
            let flow = excess * (1.0 / (2.0 * mu + 2.0 / 3.0 * self.hardening));
            kept = flows.select(one - flow / trial.norm, one);
            let kappa = flow.mul_add(V::splat(root), state.history[0]);
            state.history[0] = flows.select(kappa, state.history[0]);
            state.work = flows.select(radius(kappa) * flow, zero);
        }
        trial.finish(&self.solid, state, [trial.trace, kept], flows, V::Mask::from_bits(0), plane);
    }
}

impl Material for VonMises {
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
        &["plastic_strain"]
    }
}
