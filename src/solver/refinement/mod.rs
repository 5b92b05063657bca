//! The tree follows the material.
//!
//! | file | what it holds |
//! |---|---|
//! | [`regrid`] | one regrid |
//! | `indicators` | values of criteria |
//! | [`resample`] | splitting and merging |
//! | `reunion` | families that a face cuts in two |
mod indicators;
pub mod regrid;
pub mod resample;
mod reunion;
