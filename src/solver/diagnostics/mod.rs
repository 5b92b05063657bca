//! Measurements of a state.
mod deposit;
pub mod given_boxes;
pub mod lines;
pub mod maps;
pub mod pieces;
mod pores;
pub mod probes;
pub mod thrust;
pub mod totals;
pub mod tracks;
pub mod weights;
