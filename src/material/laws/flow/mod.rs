//! Laws of matter that flows.
//!
//! | file | model |
//! |---|---|
//! | `explosive.rs` | high explosive and its products |
//! | `fluid.rs` | weakly compressible Newtonian fluid |
//! | `gas.rs` | ideal and stiffened gas |
//! | `mu_i.rs` | dense granular flow whose friction grows with the rate: μ(I) |
//!
//! Bingham and Herschel-Bulkley flow is that of `von_mises` with `viscosity` and `rate_exponent`.
pub mod explosive;
pub mod fluid;
pub mod gas;
pub mod mu_i;

use crate::material::State;
use crate::simd::math::exp;
use crate::simd::{Vector, VectorMask};

/// Leaves of the elastic tensor its volume, with this trace of the strain and norm of its deviator: matter
/// that flows has no memory of shear. A particle that is not sheared keeps its bits.
#[inline(always)]
fn forget_shear<V: Vector>(state: &mut State<V>, trace: V, norm: V) {
    let zero = V::splat(0.0);
    let sheared = zero.lt(norm);
    if sheared.any() {
        let stretch = exp(trace * (2.0 / 3.0));
        for c in 0..6 {
            let own = if c < 3 { stretch } else { zero };
            state.elastic[c] = sheared.select(own, state.elastic[c]);
        }
    }
}
