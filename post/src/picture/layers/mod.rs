//! Layers of a picture beside the particles themselves.
//!
//! | file | concern |
//! |---|---|
//! | `widths.rs`, `vectors.rs`, `arrows.rs` | widths of particles; vectors; their arrows |
//! | `copies.rs` | mirror images and bodies of revolution |
//! | `solids.rs`, `tree.rs` | colliders; leaves |
pub(super) mod arrows;
pub(super) mod copies;
pub(super) mod solids;
pub(super) mod tree;
pub(super) mod vectors;
pub(super) mod widths;
