//! What is measured of a state.
pub mod given_boxes;
pub mod probes;
pub mod totals;
