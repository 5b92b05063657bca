//! Grid of the octree: blocks of nodes, bins of particles, constraints between levels, and the
//! exchange that completes node sums across ranks.
//!
//! The grid of one rank is described by a [`GridPlan`], which depends on tree and partition only, and filled
//! each time step in a [`NodeFields`]. See `docs/design/node-sums.md`.
//!
//! | room | what it holds, from the bottom up |
//! |---|---|
//! | [`mask`] | sets of nodes of a block as bits; offsets between blocks |
//! | [`leaf_geometry`] | boxes of leaves, and the leaf of a position |
//! | [`order`] | in which order the arenas that reach a node are added |
//! | [`constraints`] | which nodes are parents of which, with which weights |
//! | [`plan`] | bins and blocks of one tree and partition; requests to other ranks |
//! | [`arenas`] | memory that bins scatter into |
//! | [`sums`] | node fields of a step: sums of arenas, exchange, restriction, prolongation |
//! | [`ties`] | nodes at surfaces that move with the material beside them |
//! | [`direct`] | weights by definition, cell by cell: the oracle of tests |
pub mod arenas;
pub mod constraints;
pub mod direct;
pub mod leaf_geometry;
pub mod mask;
pub mod order;
pub mod plan;
pub mod sums;
pub mod ties;

pub use arenas::arena_schedule::Seam;
pub use arenas::window::Window;
pub use plan::GridPlan;
pub use plan::ghost_layer::{Cover, KnownTree};
pub use sums::exchange::ArenaExchange;
pub use sums::node_fields::NodeFields;
