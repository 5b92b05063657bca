//! Quantities that a job may give as a number, as a table over time, or as an expression of place and time.
//!
//! | file | what it holds |
//! |---|---|
//! | `expression.rs` | expressions in x, y, z, t, with `libm` behind their functions |
//! | `record.rs` | tables over time from files of comma-separated values |
//! | `table.rs` | tables over time, linear between rows |
//!
//! Knows no particles and no jobs. Values are the same on every machine: `libm` computes all elementary functions.
mod expression;
pub mod record;
mod table;

pub use expression::{Expression, ExpressionError};
pub use table::{Table, TableError};

/// A point x (m from the lower corner of the domain, which lies at `origin`) in the coordinates of the job, where quantities are taken; z is 0 in
/// plane strain.
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
}

impl Quantity {
    /// Value at the place `x` (m, in the job's coordinates; z is 0 in plane strain) and the time `t` (s).
    pub fn at(&self, x: &[f64; 3], t: f64) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Table(table) => table.at(t),
            Self::Expression(expression) => expression.at(x, t),
        }
    }

    /// Whether the value differs from place to place.
    pub fn depends_on_place(&self) -> bool {
        matches!(self, Self::Expression(expression) if expression.depends_on_place())
    }

    /// Whether the value changes in time.
    pub fn depends_on_time(&self) -> bool {
        match self {
            Self::Constant(_) => false,
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
