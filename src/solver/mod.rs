//! The time integration.
pub mod bins;
pub mod migrate;
pub mod update;
