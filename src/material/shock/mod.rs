//! Shocks: artificial viscosity, and the equation of state of metals.
pub mod eos;
mod viscosity;

pub use viscosity::{SHOCK_SUMS, Shock, Viscosity};
