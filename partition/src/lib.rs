//! Distributed linear octree.
//!
//! Knows no particles, no materials and no files. Only [`comm`] names MPI.
pub mod key;

pub use key::{Brick, MAX_LEVEL, Octant};
