//! Particles into bins: which leaf, level and arena each one scatters into.
//!
//! | file | what it holds |
//! |---|---|
//! | [`bin_view`] | one bin with its members, as the kernels take them |
//! | [`bins`] | the bins of all leaves |
//! | `leaf_bins` | the bins of one leaf |
//! | `sides` | levels across the faces of a leaf |
//! | `members` | the content of a bin |
//! | `widths` | boxes of particles |
pub mod bin_view;
pub mod bins;
pub(super) mod leaf_bins;
mod members;
mod sides;
pub mod widths;
