//! Particles into bins: which leaf, level and arena each one scatters into.
//!
//! | file | what it holds |
//! |---|---|
//! | [`bin_view`] | one bin with its members, as the kernels take them |
//! | [`bins`] | the bins of all leaves |
//! | `leaf_bins` | the bins of one leaf |
//! | `leaf_faces` | levels across the faces of a leaf |
//! | `bin_members` | the content of a bin |
//! | `box_bounds` | boxes of particles |
mod bin_members;
pub mod bin_view;
pub mod bins;
pub mod box_bounds;
pub(super) mod leaf_bins;
mod leaf_faces;
