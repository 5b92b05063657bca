//! Brittle solid: Hencky elasticity with isotropic damage.
//!
//! With the effective Kirchhoff stress `τ̄` of the whole material, the driving strain is `⟨τ̄₁⟩/E` (Rankine),
//! `√Σ⟨ε_i⟩²`, or `√(Σ⟨τ̄_i⟩ε_i/E)`, κ its greatest value so far, and `τ = (1 - D(κ)) τ̄`; with damage
//! in tension only, D lowers the principal stresses above zero. Dissipated is the energy that the loss of
//! stiffness sets free, `Y dD` with `Y = ½ Σ τ̄_i ε_i` over the lowered stresses: exact along
//! proportional paths, which are those between two states of a step. D is kept, κ follows from it.
//!
//! In a band that opens between solids that stay, the strain along the crack stays too, and
//! `Y = ½ κ τ̄₁ (1 + ν)(1 - 2ν)/(1 - ν)` with Rankine's κ: the crack takes that share of the
//! energy of fracture. The third driving strain is that of which `Y = ½ E κ²` in any state of tension, so
//! its cracks take all of it.
use super::softening::Curve;
use super::{Damage, Softening};
use crate::material::solid::Hencky;
use crate::material::tensor::principal::{Lone, Principal};
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, OWN, State, Step};
use crate::simd::{Vector, VectorMask, each};

/// History variable of the damage: the first, in which particles of a group that merges are alike.
const DAMAGE: usize = 0;
/// History variable of the width of the crack band, m; 0 before the onset.
const BAND: usize = OWN;
/// Greatest difference of the damage of particles that merge.
const ALIKE: f64 = 0.01;

/// Strain that opens cracks.
#[derive(Clone, Copy, Debug)]
enum Drive {
    Rankine,
    Strain,
    Energy,
}

/// Brittle solid.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Brittle {
    solid: Hencky,
    drive: Drive,
    curve: Curve,
    tension_only: bool,
    young: f64,
}

/// Principal values of a trial state, greatest first.
struct Parts<V: Vector> {
    principal: Principal<V>,
    /// Strains.
    strain: [V; 3],
    /// Effective stresses, Pa.
    stress: [V; 3],
}

impl<V: Vector> Parts<V> {
    #[inline(always)]
    fn of(strain: &Strain<V>, solid: &Hencky) -> Self {
        let principal = Principal::of(&Lone::of(&strain.deviator, strain.norm));
        let deviator = principal.sorted();
        let (third, pressure) = (strain.trace * (1.0 / 3.0), strain.trace * solid.bulk_modulus());
        let twice_mu = V::splat(2.0 * solid.shear_modulus());
        Self {
            principal,
            strain: each(deviator, |e| e + third),
            stress: each(deviator, |e| e.mul_add(twice_mu, pressure)),
        }
    }
}

impl Brittle {
    /// With these elastic constants; Young's modulus in Pa.
    pub(in crate::material) fn new(solid: Hencky, young: f64, damage: &Damage) -> Self {
        let (drive, onset, energy, softening, tension_only): (_, _, _, Softening, _) = match *damage {
            Damage::Rankine { strength, fracture_energy, softening, tension_only } => {
                (Drive::Rankine, strength / young, fracture_energy, softening, tension_only)
            }
            Damage::Strain { onset, fracture_energy, softening, tension_only } => {
                (Drive::Strain, onset, fracture_energy, softening, tension_only)
            }
            Damage::Energy { strength, fracture_energy, softening, tension_only } => {
                (Drive::Energy, strength / young, fracture_energy, softening, tension_only)
            }
        };
        Self { solid, drive, curve: Curve::new(softening, onset, energy / young), tension_only, young }
    }

    /// A quick upper bound of the driving strain.
    #[inline(always)]
    fn bound<V: Vector>(&self, strain: &Strain<V>) -> V {
        let (trace, norm) = (strain.trace, strain.norm);
        let [bulk, twice_mu] = [self.solid.bulk_modulus(), 2.0 * self.solid.shear_modulus()];
        match self.drive {
            Drive::Rankine => {
                let deviator = norm * ((2.0_f64 / 3.0).sqrt() * twice_mu / self.young);
                trace.mul_add(V::splat(bulk / self.young), deviator)
            }
            Drive::Strain => norm.mul_add(norm, trace * trace * (1.0 / 3.0)).sqrt(),
            // The greater of twice the shear modulus and three times the bulk modulus times the square of the
            // strain: the product of the lengths of stress and strain is no greater.
            Drive::Energy => {
                let square = norm.mul_add(norm, trace * trace * (1.0 / 3.0));
                (square * (twice_mu.max(3.0 * bulk) / self.young)).sqrt()
            }
        }
    }

    /// The driving strain.
    #[inline(always)]
    fn driving<V: Vector>(&self, parts: &Parts<V>) -> V {
        let zero = V::splat(0.0);
        match self.drive {
            Drive::Rankine => parts.stress[0].max(zero) * (1.0 / self.young),
            Drive::Strain => {
                let [a, b, c] = each(parts.strain, |e| e.max(zero));
                a.mul_add(a, b.mul_add(b, c * c)).sqrt()
            }
            Drive::Energy => {
                let [a, b, c] = each(parts.stress, |s| s.max(zero));
                let [x, y, z] = parts.strain;
                let twice = a.mul_add(x, b.mul_add(y, c * z)).max(zero);
                (twice * (1.0 / self.young)).sqrt()
            }
        }
    }

    /// Effective stresses that damage lowers, Pa.
    #[inline(always)]
    fn lowered<V: Vector>(&self, parts: &Parts<V>) -> [V; 3] {
        if self.tension_only { each(parts.stress, |s| s.max(V::splat(0.0))) } else { parts.stress }
    }

    /// Y, the energy per damage and reference volume, J/m³.
    #[inline(always)]
    fn per_damage<V: Vector>(&self, parts: &Parts<V>) -> V {
        let [a, b, c] = self.lowered(parts);
        let [x, y, z] = parts.strain;
        (a.mul_add(x, b.mul_add(y, c * z)) * 0.5).max(V::splat(0.0))
    }

    /// Damage grows with the driving strain.
    #[inline(always)]
    fn grow<V: Vector>(&self, state: &mut State<V>, parts: &Parts<V>, step: &Step) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let strain = self.driving(parts);
        let beyond = V::splat(self.curve.onset).lt(strain);
        if !beyond.any() {
            return;
        }
        let (damage, frozen) = (state.history[DAMAGE], state.history[BAND]);
        let band = zero.lt(frozen).select(frozen, V::new(step.size));
        let range = self.curve.range(band);
        let stress = self.curve.stress(strain, range, beyond);
        let next = one - stress / strain;
        let grows = beyond & damage.lt(next);
        if !grows.any() {
            return;
        }
        let [was, held] = self.curve.reached(damage, range, strain, grows);
        let taken = self.curve.taken(strain, stress, range) - self.curve.taken(was, held, range);
        // Along the way the energy grows with the square of the driving strain.
        let scale = self.per_damage(parts) / (strain * strain * 0.5);
        state.work = grows.select(taken * scale, zero).max(zero);
        state.history[DAMAGE] = grows.select(next, damage);
        state.history[BAND] = grows.select(band, frozen);
    }
}

impl Law for Brittle {
    const HISTORIES: usize = BAND + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let strain = Strain::of(&state.elastic, step.plane);
        // The wave speed of the whole material bounds that of the cracked one.
        self.solid.load(state, strain.trace, &strain.deviator);
        state.work = zero;
        let is_whole = state.history[DAMAGE].le(zero);
        if (is_whole & self.bound(&strain).le(V::splat(self.curve.onset))).all() {
            return;
        }
        let parts = Parts::of(&strain, &self.solid);
        self.grow(state, &parts, step);
        let damage = state.history[DAMAGE];
        let left = one - damage;
        if !self.tension_only {
            state.stress = each(state.stress, |component| component * left);
            return;
        }
        let is_lowered = zero.lt(damage) & zero.lt(parts.stress[0]);
        if is_lowered.any() {
            let own = each(parts.stress, |s| zero.lt(s).select(s * left, s));
            let stress = parts.principal.compose(&own);
            for c in 0..6 {
                state.stress[c] = is_lowered.select(stress[c], state.stress[c]);
            }
        }
    }

    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V {
        let (zero, damage) = (V::splat(0.0), state.history[DAMAGE]);
        let whole = Law::energy(&self.solid, state, plane);
        if damage.le(zero).all() {
            return whole;
        }
        let parts = Parts::of(&Strain::of(&state.elastic, plane), &self.solid);
        let left = damage.neg_mul_add(self.per_damage(&parts), whole).max(zero);
        zero.lt(damage).select(left, whole)
    }

    fn density(&self) -> f64 {
        Law::density(&self.solid)
    }

    fn wave_speed(&self) -> f64 {
        Law::wave_speed(&self.solid)
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["damage", "plastic_volume", "crack_band"]
    }

    fn softens(&self) -> bool {
        true
    }

    fn solid(&self) -> Option<&Hencky> {
        Some(&self.solid)
    }

    fn alike(&self, a: &[f64; HISTORIES], b: &[f64; HISTORIES]) -> bool {
        a[BAND] == b[BAND] && (a[DAMAGE] - b[DAMAGE]).abs() <= ALIKE
    }

    fn has_failed(&self, history: &[f64; HISTORIES]) -> bool {
        history[DAMAGE] > 0.0 && history[DAMAGE] >= self.curve.failed(history[BAND])
    }
}

const _: () = assert!(Brittle::HISTORIES <= HISTORIES);
