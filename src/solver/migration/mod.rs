//! Particles between leaves and ranks, and out of the domain.
pub mod crossings;
pub mod depart;
pub mod fluxes;
pub mod migrate;
mod records;
