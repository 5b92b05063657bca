//! Particles between leaves and ranks.
pub mod depart;
pub mod migrate;
mod records;
