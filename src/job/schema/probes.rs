//! Probes as they are written in a job file.
use crate::geometry::written::Shape;
use crate::probe::Measured;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A measurement of the material in a shape, as columns of `history.csv` such as `mass_NAME` and `velocity_NAME_x`. A particle counts
/// where its centre lies in the shape. Means are `NaN` while there is no material.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Name, of letters, digits, `_` and `-`.
    pub name: String,
    /// Where it measures; everywhere by default.
    #[serde(default)]
    pub shape: Option<Shape>,
    /// Names of the bodies that it measures; all by default.
    #[serde(default)]
    #[schemars(length(min = 1, max = 65_535))]
    pub bodies: Option<Vec<String>>,
    /// What it measures; mass, centre and velocity by default.
    #[serde(default = "usual")]
    #[schemars(length(min = 1, max = 13))]
    pub quantities: Vec<Measured>,
}

fn usual() -> Vec<Measured> {
    vec![Measured::Mass, Measured::Centre, Measured::Velocity]
}
