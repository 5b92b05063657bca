//! Constraints between levels: nodes that interpolate their parents one level coarser.
//!
//! | file | what it holds |
//! |---|---|
//! | [`constraint`] | parents of a node from its place |
//! | [`parents`] | the same as tables by parity of a block |
//! | [`moments`] | first moments of the nodes of a block |
pub mod constraint;
pub mod moments;
pub mod parents;
