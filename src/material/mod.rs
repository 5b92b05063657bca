//! Constitutive models.
//!
//! All models are isotropic, so the elastic left Cauchy-Green tensor `b = F_e F_eᵀ` is the whole
//! elastic state. Plastic models map a trial `b` back to their yield surface in Hencky strains.
//!
//! | file | content |
//! |---|---|
//! | `state.rs` | the state of a batch of particles, and the step |
//! | `law.rs` | the trait of a model |
//! | `batches/` | laws as the solver calls them: updates and tangents |
//! | `solid.rs` | the Hencky solid |
//! | `consolidation.rs` | the stress that matter has borne |
//! | `initial.rs` | states under a given stress |
//! | `laws/` | the models, one file each, and the list of them |
//! | `parameters/` | parameters that models share: elastic constants, checks, reading from text |
//! | `strength/` | friction, the Mohr-Coulomb pyramid, hardening; strength over a factor of safety |
//! | `damage/` | stiffness and strength that are lost for good |
//! | `shock/` | artificial viscosity; equation of state of metals |
//! | `root.rs` | roots of scalar equations, lane by lane |
//! | `tensor/` | symmetric tensors of batches: eigenvalues, logarithm, exponential |
//! | `undrained.rs` | water that cannot leave the pores of a solid |
//! | `driver/` | one particle along a path |
use crate::simd::{LANES, Mask, VectorMask};

mod batches;
mod consolidation;
pub mod damage;
pub mod driver;
pub mod initial;
mod law;
pub mod laws;
pub mod parameters;
mod root;
pub mod shock;
mod solid;
mod state;
mod strength;
pub(crate) mod tensor;
#[cfg(test)]
mod tests;
pub mod undrained;

pub use batches::{Material, Tangent};
pub use consolidation::Consolidation;
pub use law::Law;
pub use laws::Model;
pub use parameters::Parameters;
pub use shock::{SHOCK_SUMS, Shock, Viscosity};
use state::OWN;
pub use state::{HISTORIES, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step};
pub use strength::Weakened;
pub use tensor::eigen::{self, Symmetric};

/// Fate of a particle whose material has failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Failed {
    /// It stays, with what its law leaves it.
    #[default]
    Stays,
    /// It is deleted.
    Delete,
    /// It becomes the material of this number.
    Becomes(u16),
}

/// The model with these parameters and the density of the undeformed material, kg/m³.
pub fn build(parameters: &Parameters, density: f64) -> Box<dyn Material> {
    parameters.build(density)
}

/// Updates a batch whose lane `i` is of material `index[i]`; the bits are those of each material
/// alone.
#[inline]
pub fn update(materials: &[Box<dyn Material>], index: &[u16; LANES], state: &mut State, step: &Step) {
    if index.iter().all(|&i| i == index[0]) {
        materials[usize::from(index[0])].update(state, step);
        return;
    }
    let trial = *state;
    let mut pending = (1u32 << LANES) - 1;
    while pending != 0 {
        let first = index[pending.trailing_zeros() as usize];
        let bits = (0..LANES).filter(|&i| index[i] == first).fold(0, |bits, i| bits | 1 << i);
        let mut part = trial;
        materials[usize::from(first)].update(&mut part, step);
        let mask = Mask::from_bits(bits);
        for c in 0..6 {
            state.elastic[c] = mask.select(part.elastic[c], state.elastic[c]);
            state.stress[c] = mask.select(part.stress[c], state.stress[c]);
        }
        for h in 0..HISTORIES {
            state.history[h] = mask.select(part.history[h], state.history[h]);
        }
        state.work = mask.select(part.work, state.work);
        state.wave_speed = mask.select(part.wave_speed, state.wave_speed);
        for (own, work) in state.shock.iter_mut().zip(part.shock) {
            *own = mask.select(work, *own);
        }
        pending &= !bits;
    }
}

/// Tangents of a batch whose lane `i` is of material `index[i]`; `trial` is the state before the update.
pub fn tangent(materials: &[Box<dyn Material>], index: &[u16; LANES], trial: &State, step: &Step) -> Tangent {
    let mut all = materials[usize::from(index[0])].tangent(trial, step);
    let mut pending = (0..LANES).filter(|&i| index[i] != index[0]).fold(0_u32, |bits, i| bits | 1 << i);
    while pending != 0 {
        let first = index[pending.trailing_zeros() as usize];
        let bits = (0..LANES).filter(|&i| index[i] == first).fold(0, |bits, i| bits | 1 << i);
        all = all.with_lanes(Mask::from_bits(bits), &materials[usize::from(first)].tangent(trial, step));
        pending &= !bits;
    }
    all
}
