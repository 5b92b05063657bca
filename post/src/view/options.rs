//! Options of a view.
use crate::revolve::Revolve;
use agimp::io::snapshot::PointField;

/// Options of a view.
#[derive(Clone, Debug)]
pub struct Options {
    /// Title; the page shows it above all.
    pub title: String,
    /// Fields; `None` for all but identifiers and components of vectors.
    pub fields: Option<Vec<PointField>>,
    /// Bits for a real value, 4 to 16.
    pub bits: u8,
    /// Bodies of revolution in space; then without the tree.
    pub revolve: Option<Revolve>,
}
