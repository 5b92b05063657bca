//! The tree follows the material.
//!
//! | file | what it holds |
//! |---|---|
//! | [`regrid`] | one regrid |
//! | `pace` | which occasions for a regrid are passed over |
//! | `indicators` | values of criteria |
//! | [`resample`] | splitting and merging |
//! | `reunion` | families that a face cuts in two |
mod indicators;
mod pace;
pub mod regrid;
pub mod resample;
mod reunion;
