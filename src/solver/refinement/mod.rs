//! Dynamic refinement: the tree follows the material.
//!
//! | file | what it holds |
//! |---|---|
//! | [`regrid`] | one regrid |
//! | `cohesion` | stretched elastic particles are halved |
//! | `indicators` | values of criteria |
//! | [`split_merge`] | splitting and merging |
//! | `merge_across_leaves` | families that a face cuts in two |
mod cohesion;
mod indicators;
mod merge_across_leaves;
pub mod regrid;
pub mod split_merge;
