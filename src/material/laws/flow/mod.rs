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
