//! Registers of each instruction set: four numbers, and eight of AVX-512.
//!
//! | file | what it holds |
//! |---|---|
//! | `avx` | four numbers in one register of AVX |
//! | `avx512` | a vector as one register of AVX-512 |
//! | `portable` | four numbers as an array |
//! | `exponent` | constants that take exponents apart |
#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
pub use avx::{F64x4, Mask4};
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma")))]
pub use portable::{F64x4, Mask4};

#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
mod avx;
#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
pub(super) mod avx512;
mod exponent;
#[cfg(any(test, not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))))]
// Public where it replaces AVX2, which it does not in tests on most machines.
#[cfg_attr(test, allow(unreachable_pub))]
pub(super) mod portable;
