//! Grid of the octree: blocks of nodes, bins of particles, constraints between levels, and the
//! exchange that completes node sums across ranks.
//!
//! The grid of one rank is described by a [`GridPlan`], which depends on tree and partition only, and
//! filled each time step in a [`NodeFields`]. See `ARCHITECTURE.md`, "Node sums".
pub mod arena;
pub mod census;
pub mod closure;
pub mod columns;
pub mod constrained;
pub mod constraint;
mod cutter;
pub mod direct;
pub mod exchange;
pub mod feeders;
pub mod fields;
pub mod known;
mod levels;
pub mod links;
pub mod mask;
mod mixed;
pub mod order;
pub mod parents;
pub mod plan;
pub mod reach;
pub mod region;
pub mod sources;
mod sums;
pub mod waves;
pub mod window;

pub use exchange::ArenaExchange;
pub use fields::NodeFields;
pub use known::{Cover, KnownTree};
pub use plan::GridPlan;
pub use waves::Seam;
pub use window::Window;
