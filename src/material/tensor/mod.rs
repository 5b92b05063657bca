//! Symmetric tensors of batches of particles.
//!
//! | file | what it holds |
//! |---|---|
//! | `eigen.rs` | eigenvalues and eigenvectors, determinant, bounds |
//! | `near_unit.rs` | logarithm and exponential near the unit tensor, by series |
//! | `principal.rs` | principal values of a deviator, without eigenvectors |
//! | `strain.rs` | Hencky strain of a trial tensor, and the way back |
pub mod eigen;
mod near_unit;
pub(super) mod principal;
pub(super) mod strain;
