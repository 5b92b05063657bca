//! Free rigid bodies.
//!
//! | file | what it holds |
//! |---|---|
//! | `turning` | inertia, orientation, and the turning of a body without torque |
pub mod turning;
