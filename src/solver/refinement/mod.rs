//! Dynamic refinement: the tree follows the material.
//!
//! | file | what it holds |
//! |---|---|
//! | [`regrid`] | one regrid |
//! | `indicators` | values of criteria |
//! | [`split_merge`] | splitting and merging |
//! | `merge_across_leaves` | families that a face cuts in two |
mod indicators;
mod merge_across_leaves;
pub mod regrid;
pub mod split_merge;
