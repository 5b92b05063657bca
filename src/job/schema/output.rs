//! Files of a run, as a job has them: outputs, checkpoints, history, telemetry.
use super::common::yes;
use crate::job::problem::Field;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Output files.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Directory for the files of the run, relative to the current directory; `out/` and the name of the job
    /// file by default.
    #[serde(default)]
    pub directory: Option<String>,
    /// Simulated time between outputs, s; by default only the start and the end.
    #[serde(default)]
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub every: Option<f64>,
    /// Particle fields; by default id, body, material, leaf_level, velocity, density, pressure, von_mises and
    /// plastic_strain, and pore_pressure in jobs with water in pores.
    #[serde(default)]
    pub fields: Option<Vec<Field>>,
    /// Whether each output contains the complete state, so that a run can restart from it.
    #[serde(default = "yes")]
    pub restart: bool,
    /// Whether the run draws a picture of its final state.
    #[serde(default = "yes")]
    pub picture: bool,
    /// Field that colours the picture; by default the damage if a material has it, else the
    /// plastic strain, else the speed.
    #[serde(default)]
    pub picture_field: Option<Field>,
    /// Whether the run writes the HTML page `JOB.report.html` when it ends, fails or is stopped, as
    /// `agimp report` does.
    #[serde(default)]
    pub report: bool,
}

impl Output {
    /// Whether the output has one of these fields, of which none is there by default.
    pub fn has_any(&self, fields: &[Field]) -> bool {
        self.chosen().iter().chain(&self.picture_field).any(|field| fields.contains(field))
    }

    /// The fields that the job names.
    pub fn chosen(&self) -> &[Field] {
        self.fields.as_deref().unwrap_or_default()
    }

    /// The fields of a job with or without water in pores.
    pub fn fields(&self, has_water: bool) -> Vec<Field> {
        use Field::*;
        let usual = || {
            let fields =
                [Id, Body, Material, LeafLevel, Velocity, Density, Pressure, VonMises, PlasticStrain];
            fields.into_iter().chain(has_water.then_some(PorePressure)).collect()
        };
        self.fields.clone().unwrap_or_else(usual)
    }
}

impl Default for Output {
    fn default() -> Self {
        Self {
            directory: None,
            every: None,
            fields: None,
            restart: true,
            picture: true,
            picture_field: None,
            report: false,
        }
    }
}

/// Checkpoints. Without an interval, a run writes one only when asked to stop, and at its end if the outputs
/// contain no state.
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
    /// Number of checkpoints to keep; older ones are deleted once a newer one is complete.
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
    /// Whether to record the mean force on each face of the domain since the previous row, N: `force_x_min_x`
    /// and so on.
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

/// Performance of the run, `telemetry.jsonl`.
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
