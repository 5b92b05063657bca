//! What a job writes, as its file has it: outputs, checkpoints, history, telemetry, report.
use super::common::{AxisName, yes};
use crate::geometry::written::Vector;
use crate::job::problem::{CollapseLaw, Field};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Output files.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Directory for all files of the run, relative to where agimp is started; `out/` and the name of
    /// the job file by default.
    #[serde(default)]
    pub directory: Option<String>,
    /// Simulated time between output files, s; only start and end by default.
    #[serde(default)]
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub every: Option<f64>,
    /// Particle fields.
    #[serde(default = "default_fields")]
    pub fields: Vec<Field>,
    /// Whether each output file carries the complete state, so that a run can restart from it.
    #[serde(default = "yes")]
    pub restart: bool,
    /// Whether a picture of the last state is drawn when the run ends.
    #[serde(default = "yes")]
    pub picture: bool,
    /// Field that colours the picture; by default the plastic strain if a material has it, else the speed.
    #[serde(default)]
    pub picture_field: Option<Field>,
    /// Whether the run ends with a page for a browser, `JOB.report.html`, as `agimp report` writes it; also when it fails or is stopped.
    #[serde(default)]
    pub report: bool,
}

impl Output {
    /// Whether the output has one of these fields.
    pub fn has_any(&self, fields: &[Field]) -> bool {
        self.fields.iter().chain(&self.picture_field).any(|field| fields.contains(field))
    }
}

impl Default for Output {
    fn default() -> Self {
        Self {
            directory: None,
            every: None,
            fields: default_fields(),
            restart: true,
            picture: true,
            picture_field: None,
            report: false,
        }
    }
}

fn default_fields() -> Vec<Field> {
    use Field::*;
    vec![Id, Body, Material, LeafLevel, Velocity, Density, Pressure, VonMises, PlasticStrain]
}

/// Checkpoints. With no interval, one is written only when the run is asked to stop, and when it ends if the
/// output files carry no state.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Steps between checkpoints.
    #[serde(default)]
    #[schemars(range(min = 1, max = 1_000_000_000_000_u64))]
    pub every_steps: Option<u64>,
    /// Simulated time between checkpoints, s.
    #[serde(default)]
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub every_time: Option<f64>,
    /// Wall time between checkpoints, minutes.
    #[serde(default)]
    #[schemars(range(max = 1e7), extend("exclusiveMinimum" = 0.0))]
    pub every_wall_minutes: Option<f64>,
    /// Checkpoints kept; older ones are deleted when a newer one is complete.
    #[serde(default = "default_keep")]
    #[schemars(range(min = 1, max = 1000))]
    pub keep: u32,
}

impl Default for Checkpoint {
    fn default() -> Self {
        Self { every_steps: None, every_time: None, every_wall_minutes: None, keep: default_keep() }
    }
}

fn default_keep() -> u32 {
    2
}

/// Table of scalars, `history.csv`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct History {
    /// Steps between rows.
    #[serde(default = "ten")]
    #[schemars(range(min = 1, max = 1_000_000_000_000_u64))]
    pub every_steps: u64,
    /// Whether it has the mean force on each face of the domain since the row before, N: `force_x_min_x` and so on.
    #[serde(default)]
    pub face_forces: bool,
}

impl Default for History {
    fn default() -> Self {
        Self { every_steps: ten(), face_forces: false }
    }
}

fn ten() -> u64 {
    10
}

/// Measurements of the run itself, `telemetry.jsonl`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Telemetry {
    /// Steps between lines; 100 by default.
    #[schemars(range(min = 1, max = 1_000_000_000_000_u64))]
    pub every_steps: u64,
}

impl Default for Telemetry {
    fn default() -> Self {
        Self { every_steps: 100 }
    }
}

/// Evaluation at the end of the run.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Report {
    /// Run-out and height of a collapsed granular column, beside published laws.
    ColumnCollapse {
        /// Centre of the column's foot, m.
        base: Vector,
        /// Axis that points up; the last one by default.
        #[serde(default)]
        up: Option<AxisName>,
        /// Initial radius (axisymmetric) or half width (planar), m.
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        radius: f64,
        /// Initial height, m.
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        height: f64,
        /// Which laws to compare with.
        law: CollapseLaw,
    },
}
