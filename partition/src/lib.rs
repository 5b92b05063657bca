//! Distributed linear octree.
//!
//! Knows no particles, no materials and no files. Only [`comm`] names MPI.
//!
//! | file | concern |
//! |---|---|
//! | `key.rs` | octants, Morton keys, the brick of roots |
//! | `forest.rs` | the tree: leaves of this rank, markers of all ranks, look-up |
//! | `adapt.rs` | refining and coarsening by marks |
//! | `balance.rs` | 2:1 balance over faces, edges and corners |
//! | `weight.rs` | where to cut the curve |
//! | `migrate.rs` | moving leaves and what belongs to them |
//! | `search.rs` | leaves of any rank near given boxes |
//! | `check.rs` | validity and checksum |
//!
//! Deliberately absent: no rank stores anything that grows with the number of leaves of all ranks, and no
//! call sends a message from every rank to every rank.
mod adapt;
mod balance;
mod check;
pub mod comm;
mod forest;
pub mod key;
mod migrate;
mod search;
mod weight;

pub use adapt::{Mark, correspondence};
pub use check::ForestError;
pub use comm::{Comm, CommError, Disagreement, NeighbourExchange, Pending, Traffic, World};
pub use forest::Forest;
pub use key::{Brick, MAX_LEVEL, MAX_ROOTS, Octant};
pub use migrate::Shipment;
pub use search::Region;
pub use weight::{CutAt, Cuts};
