//! Boundary conditions on the velocities of real nodes.
pub mod face;

pub use face::FaceCondition;
