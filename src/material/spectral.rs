//! Return mapping in principal Hencky strains: what all such models share.
//!
//! The trial tensor is decomposed once; a model maps the principal strains, and tensors of the final state are put
//! together from the same eigenvectors.
use super::eigen::{Eigen, decompose};
use super::hencky::Hencky;
use super::{State, Symmetric};
use crate::kernel::math::{exp, ln};
use crate::kernel::simd::{Lanes, Mask, each};

/// Principal logarithmic strains of `b`, with its decomposition.
#[inline(always)]
pub(super) fn principal_strains(b: &Symmetric, plane: bool) -> (Eigen, [Lanes; 3]) {
    let eigen = decompose(b, plane);
    (eigen, each(eigen.value, |value| ln(value) * 0.5))
}

/// A trial state in its principal directions.
pub(super) struct Trial {
    eigen: Eigen,
    /// Principal strains.
    pub strain: [Lanes; 3],
    /// Their sum.
    pub trace: Lanes,
    /// Their deviator.
    pub deviator: [Lanes; 3],
    /// Its norm.
    pub norm: Lanes,
}

impl Trial {
    /// Decomposes a trial tensor.
    #[inline(always)]
    pub fn of(b: &Symmetric, plane: bool) -> Self {
        let (eigen, strain) = principal_strains(b, plane);
        let trace = strain[0] + strain[1] + strain[2];
        let deviator = each(strain, |e| e - trace * (1.0 / 3.0));
        let [x, y, z] = deviator;
        let norm = x.mul_add(x, y.mul_add(y, z * z)).sqrt();
        Self { eigen, strain, trace, deviator, norm }
    }

    /// Writes the final state: elastic tensor where `changed`, stress, wave speed. Lanes in `unstrained` get exactly
    /// the unit tensor, not its product with rounded eigenvectors. All other lanes keep the bits of the trial tensor.
    #[inline(always)]
    pub fn finish(
        &self,
        solid: &Hencky,
        state: &mut State,
        strain: &[Lanes; 3],
        changed: Mask,
        unstrained: Mask,
        plane: bool,
    ) {
        if changed.any() {
            let elastic = self.eigen.compose(&each(*strain, |e| exp(e + e)), plane);
            for c in 0..6 {
                let unit = Lanes::splat(if c < 3 { 1.0 } else { 0.0 });
                let returned = unstrained.select(unit, elastic[c]);
                state.elastic[c] = changed.select(returned, state.elastic[c]);
            }
        }
        state.stress = self.eigen.compose(&solid.principal_stresses(strain), plane);
        state.wave_speed = solid.wave_speed_under(&state.stress);
    }
}
