//! Shapes: signed distance and its gradient, membership, bounds, and classification of boxes against them.
//!
//! Shapes fill bodies with particles and select the leaves to refine. Distances are exact for the
//! primitives; for booleans the value is a bound, never larger in magnitude than the distance to the
//! surface and with the right sign, so that a ball of that radius lies on one side.
//!
//! | file or folder | what it holds |
//! |---|---|
//! | `aabb`, `frustum` | axis-aligned boxes; truncated cones |
//! | `shape/` | shapes and their queries |
//! | [`moments`], `part/` | volume and inertia of shapes, and of their parts in boxes |
//! | [`mesh`] | solids from triangles and rasters |
//! | [`sampling`], [`surface`] | particles off the lattice; pieces of surface |
//! | [`written`] | shapes as they stand in a job |
//! | `rotation`, `vector` | rotations; vectors of space |
mod aabb;
mod frustum;
pub mod mesh;
pub mod moments;
mod part;
mod rotation;
pub mod sampling;
mod shape;
pub mod surface;
pub mod vector;
pub mod written;

pub use aabb::Aabb;
pub use frustum::Frustum;
pub use mesh::Mesh;
pub use moments::Moments;
pub use rotation::rotation;
pub use sampling::Sampling;
pub use shape::{Faces, Placement, Shape, Side, common_point};
