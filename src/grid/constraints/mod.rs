//! Constraints between levels: nodes that interpolate their parents one level coarser.
//!
//! | file | what it holds |
//! |---|---|
//! | [`constraint`] | parents of a node from its place |
//! | [`parents`] | the same as tables by parity of a block |
//! | [`columns`] | which columns of first moments are kept |
pub mod columns;
pub mod constraint;
pub mod parents;
