//! Layers of a picture beside the particles themselves.
//!
//! | file | concern |
//! |---|---|
//! | `boxes.rs`, `vectors.rs`, `arrows.rs` | widths of particles; vectors; their arrows |
//! | `copies.rs` | mirror images and bodies of revolution |
//! | `solids.rs`, `tree.rs` | colliders; leaves |
pub(super) mod arrows;
pub(super) mod boxes;
pub(super) mod copies;
pub(super) mod solids;
pub(super) mod tree;
pub(super) mod vectors;
