//! Grid of the octree: blocks of nodes, bins of particles, constraints between levels, and the
//! exchange that completes node sums across ranks.
//!
//! The grid of one rank is described by a [`GridPlan`], which depends on tree and partition only, and
//! filled each time step in a [`NodeFields`]. See `ARCHITECTURE.md`, "Node sums".
pub mod arena;
pub mod census;
pub mod closure;
pub mod constrained;
pub mod constraint;
pub mod direct;
mod entries;
pub mod exchange;
pub mod fields;
pub mod known;
pub mod links;
pub mod mask;
pub mod plan;
pub mod reach;
mod sources;
pub mod window;

pub use exchange::ArenaExchange;
pub use fields::NodeFields;
pub use known::{Cover, KnownTree};
pub use plan::{BinId, GridPlan};
pub use window::Window;
