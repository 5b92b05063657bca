//! Conditions at the start and at boundaries, loads and sources.
//!
//! | file | tables |
//! |---|---|
//! | [`boundaries`] | faces of the domain |
//! | [`colliders`] | colliders and their motion |
//! | [`contact`] | contact between bodies |
//! | [`loads`] | loads, and quantities of all tables |
//! | [`sources`] | material that enters |
//! | [`stress`] | stress at the start of a body |
//! | [`water`] | water in the pores |
pub mod boundaries;
pub mod colliders;
pub mod contact;
pub mod loads;
pub mod sources;
pub mod stress;
pub mod water;
