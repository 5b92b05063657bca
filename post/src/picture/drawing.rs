//! Input of a picture.
use super::camera::Bounds;
use super::layers::vectors::Vectors;
use super::scene::Splat;
use super::tint::Tint;
use agimp::run::scene::Solid;

/// The particles of one rank and what all ranks know.
#[derive(Debug)]
pub(super) struct Drawing {
    pub(super) flat: bool,
    pub(super) domain: Bounds,
    /// Values are not yet scaled.
    pub(super) splats: Vec<Splat>,
    pub(super) tint: Tint,
    pub(super) caption: String,
    pub(super) solids: Vec<Solid>,
    /// Leaves of the tree, if they are drawn: lower corner and edge, m.
    pub(super) leaves: Vec<([f64; 3], f64)>,
    pub(super) vectors: Vectors,
}
