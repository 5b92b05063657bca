//! Particles between leaves and ranks, and out of the domain.
//!
//! | file | what it holds |
//! |---|---|
//! | [`migrate`] | particles to the leaves that contain them |
//! | [`depart`], `records` | those that leave a leaf; how they are sent |
//! | [`crossings`], [`fluxes`], `gone` | faces of the domain; masses that have passed; particles that are no longer there |
//! | [`error`] | why particles could not be migrated |
pub mod crossings;
pub mod depart;
pub mod error;
pub mod fluxes;
pub(super) mod gone;
pub mod migrate;
mod records;
