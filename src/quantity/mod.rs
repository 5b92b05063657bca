//! Quantities that a job may give as a number, as a table over time, or as an expression of place and time.
//!
//! | file | what it holds |
//! |---|---|
//! | `expression/` | expressions in x, y, z, t, X, Y, Z, with `libm` behind their functions |
//! | `field/` | values at places from files: rasters, tables of points |
//! | `record/` | tables over time from files of comma-separated values |
//! | `place.rs` | places at which quantities are taken |
//! | `smooth_step.rs` | a smooth rise |
//! | `table.rs` | tables over time, linear between rows |
//!
//! Knows no particles and no jobs. Values are the same on every machine: `libm` computes all elementary
//! functions.
mod expression;
pub mod field;
mod place;
pub mod record;
mod smooth_step;
mod table;

pub use expression::{Expression, ExpressionError, NotFinite};
pub use field::Field;
pub use place::{Place, in_job};
pub use smooth_step::smooth_step;
pub use table::{Table, TableError};

use std::sync::Arc;

/// Names of the coordinates.
pub const AXES: [&str; 3] = ["x", "y", "z"];
/// Names of the faces of the domain, by axis and side.
pub const FACES: [[&str; 2]; 3] = [["x_min", "x_max"], ["y_min", "y_max"], ["z_min", "z_max"]];

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

/// Processor time of this thread (s), to which other programs on the machine do not add.
#[cfg(test)]
fn thread_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
