//! Constraints between levels: nodes that interpolate their parents one level coarser.
//!
//! | file | what it holds |
//! |---|---|
//! | [`parents`] | parents of a node from its place |
//! | [`parent_table`] | the same as tables by parity of a block |
//! | [`moments`] | first moments of the nodes of a block |
pub mod moments;
pub mod parent_table;
pub mod parents;
