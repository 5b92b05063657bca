//! Conditions at the start and at boundaries, loads and sources.
//!
//! | file or folder | subject |
//! |---|---|
//! | `colliders/` | colliders and their motion |
//! | `contact` | contact between bodies |
//! | `loads` | loads |
//! | `quantities` | numbers, expressions, tables over time, values at places |
//! | `sources` | sources |
//! | `stress` | stress of bodies at the start |
//! | `water` | water in the pores |
pub(super) mod colliders;
pub(super) mod contact;
pub(super) mod loads;
pub(super) mod quantities;
pub(super) mod sources;
pub(super) mod stress;
pub(super) mod water;
