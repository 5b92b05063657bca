//! Explicit vectors of `f64`: the only module of this crate with CPU intrinsics.
//!
//! [`F64x4`] is one AVX register where the build has AVX2 and FMA and an array of four numbers elsewhere. It
//! holds a row of a node. [`LANES`] particles at a time make a [`Vector`]: two of them ([`Lanes`]), or one
//! register of 512 bits where the processor has AVX-512 (see [`widest`]). All do the same IEEE 754
//! operations, each correctly rounded, so a result never depends on the choice.

#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
pub use avx::{F64x4, Mask4};
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma")))]
pub use portable::{F64x4, Mask4};

pub use dispatch::{Kernel, widest};
pub use dual::{DIRECTIONS, Dual};
pub use lanes::{Lanes, Mask};
pub use prefetch::{prefetch, prefetch_to_second_level};
pub use processor::missing;
pub use vector::{LANES, Vector, VectorMask, each};

#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
mod avx;
#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
mod avx512;
mod dispatch;
mod dual;
mod exponent;
mod lanes;
#[cfg(any(test, not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))))]
// Public where it replaces AVX2, which it does not in tests on most machines.
#[cfg_attr(test, allow(unreachable_pub))]
mod portable;
mod prefetch;
mod processor;
mod vector;

pub mod math;
#[cfg(test)]
mod tests;
