//! Distributed linear octree.
//!
//! Knows no particles, no materials and no files. Only [`comm`] names MPI.
pub mod comm;
pub mod key;

pub use comm::{Comm, CommError, Disagreement, NeighbourExchange, Pending, RawComm, Traffic, World};
pub use key::{Brick, MAX_LEVEL, Octant};
