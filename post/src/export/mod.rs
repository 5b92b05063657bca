//! Outputs for other programs.
//!
//! | file | output |
//! |---|---|
//! | [`points`] | particles: PLY, CSV, VTP |
//! | [`surface`] | the surface of the material as a mesh: PLY, OBJ |
//! | [`tree`] | the tree as VTK's HyperTreeGrid |
pub mod points;
pub mod surface;
pub mod tree;
