//! Particles into bins: which leaf, level and arena each one scatters into.
//!
//! | file | what it holds |
//! |---|---|
//! | [`bin_view`] | one bin with its members, as the kernels take them |
//! | [`bins`] | the bins of all leaves |
//! | `leaf_bins` | the bins of one leaf |
//! | `leaf_faces` | levels across the faces of a leaf |
//! | `bin_members` | the content of a bin |
//! | `box_bounds` `box_widths` | boxes of particles; what sorting asks of them |
mod bin_members;
pub mod bin_view;
pub mod bins;
pub mod box_bounds;
pub mod box_widths;
pub(super) mod leaf_bins;
mod leaf_faces;
