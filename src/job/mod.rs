//! Job files: what a run is asked to do.
pub mod problem;

pub use problem::{AnyProblem, Problem};
