//! Free rigid bodies.
//!
//! | file | what it holds |
//! |---|---|
//! | `turning` | inertia, orientation, and the turning of a body without torque |
//! | `numbers` | the state of a free body as checkpoints keep it |
mod numbers;
pub mod turning;
