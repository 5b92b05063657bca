//! Questions of a criterion to the job that it is a part of.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::adaptivity::Criterion;
use crate::boundary::motion::Motion;
use crate::geometry::Shape;
use crate::geometry::written::{self, Vector};

/// The parameters of a criterion as they stand in a job file. Descriptions and ranges of the keys are those
/// of the schema.
pub(crate) trait Keys {
    /// The criterion with these parameters, or faults of the job.
    fn criterion<const D: usize>(&self, job: &mut dyn Job<D>) -> Option<Criterion<D>>;
}

/// The rest of the job, for criteria that refer to parts of it. `key` is the key of that criterion, for
/// reports of faults.
pub(crate) trait Job<const D: usize> {
    /// A shape in coordinates relative to the domain's lower corner.
    fn shape(&mut self, shape: &written::Shape, key: &'static str) -> Option<Shape<D>>;

    /// The motion of a region by its rows.
    fn motion(&mut self, rows: &[Way], key: &'static str) -> Option<Motion<D>>;

    /// Index of the collider of that name.
    fn collider(&mut self, name: &str, key: &'static str) -> Option<usize>;

    /// Index of the material of that name.
    fn material(&mut self, name: &str, key: &'static str) -> Option<usize>;

    /// That water seeps in the job.
    fn seepage(&mut self, key: &'static str) -> Option<()>;
}

/// A row of the motion of a region.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Way {
    /// Time, s.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub time: f64,
    /// Way from its place in the job, m.
    pub translation: Vector,
}
