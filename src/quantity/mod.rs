//! Quantities that a job may give as a number, as a table over time, or as an expression of place and time.
//!
//! | file | what it holds |
//! |---|---|
//! | `expression/` | expressions in x, y, z, t, X, Y, Z, with `libm` behind their functions |
//! | `field/` | values at places from files: rasters, tables of points |
//! | `record.rs` | tables over time from files of comma-separated values |
//! | `table.rs` | tables over time, linear between rows |
//!
//! Knows no particles and no jobs. Values are the same on every machine: `libm` computes all elementary
//! functions.
mod expression;
pub mod field;
pub mod record;
mod table;

pub use expression::{Expression, ExpressionError, NotFinite};
pub use field::Field;
pub use table::{Table, TableError};

use std::sync::Arc;

/// Names of the coordinates.
pub const AXES: [&str; 3] = ["x", "y", "z"];
/// Names of the faces of the domain, by axis and side.
pub const FACES: [[&str; 2]; 3] = [["x_min", "x_max"], ["y_min", "y_max"], ["z_min", "z_max"]];

/// From 0 at 0 to 1 at 1 on half a period of a cosine, `(1 - cos(π s)) / 2`; constant outside.
pub fn smooth_step(s: f64) -> f64 {
    if s <= 0.0 {
        0.0
    } else if s >= 1.0 {
        1.0
    } else {
        0.5 * (1.0 - libm::cos(std::f64::consts::PI * s))
    }
}

/// A place of material, m, in the coordinates of the job; z is 0 in plane strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The present place.
    pub now: [f64; 3],
    /// The place in the undeformed body: `now` less the displacement.
    pub undeformed: [f64; 3],
}

impl From<[f64; 3]> for Place {
    /// A place of material that has not moved, or of none.
    fn from(now: [f64; 3]) -> Self {
        Self { now, undeformed: now }
    }
}

/// A point x (m from the lower corner of the domain, which lies at `origin`) in the coordinates of the job,
/// the argument of quantities; z is 0 in plane strain.
pub fn in_job<const D: usize>(origin: &[f64; D], x: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|a| if a < D { origin[a] + x[a] } else { 0.0 })
}

/// A scalar that may depend on place and time.
#[derive(Clone, Debug)]
pub enum Quantity {
    /// The same everywhere and always.
    Constant(f64),
    /// A function of time.
    Table(Table),
    /// A function of place and time.
    Expression(Box<Expression>),
    /// Values at places.
    Field(Arc<Field>),
}

impl Quantity {
    /// Value at a place and the time `t` (s).
    pub fn at(&self, place: impl Into<Place>, t: f64) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Table(table) => table.at(t),
            Self::Expression(expression) => expression.at(&place.into(), t),
            Self::Field(field) => field.at(place.into().now),
        }
    }

    /// Whether the value differs from place to place.
    pub fn depends_on_place(&self) -> bool {
        (0..3).any(|axis| self.depends_on(axis)) || self.names_undeformed()
    }

    /// Whether the value differs along a coordinate; 0: x.
    pub fn depends_on(&self, axis: usize) -> bool {
        match self {
            Self::Constant(_) | Self::Table(_) => false,
            Self::Expression(expression) => expression.names(axis),
            Self::Field(field) => field.has(axis),
        }
    }

    /// Whether the value belongs to places of the undeformed body.
    pub fn names_undeformed(&self) -> bool {
        matches!(self, Self::Expression(expression) if expression.names_undeformed())
    }

    /// Where it has had no finite value so far, if it has been evaluated there.
    pub fn not_finite(&self) -> Option<NotFinite> {
        if let Self::Expression(expression) = self { expression.not_finite() } else { None }
    }

    /// Whether the value changes in time.
    pub fn depends_on_time(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Field(_) => false,
            Self::Table(_) => true,
            Self::Expression(expression) => expression.depends_on_time(),
        }
    }
}

impl Default for Quantity {
    fn default() -> Self {
        Self::Constant(0.0)
    }
}
