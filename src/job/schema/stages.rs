//! Stages of a run as they are written in a job file.
use super::boundaries::Boundaries;
use super::equilibrium::Equilibrium;
use super::loads::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A stage of the run. Stages run in the order of the file; the first starts at t = 0. A change stays in force until another stage changes
/// it again. Loads and colliders name the stages in which they act, bodies the stage in which they appear.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name, of letters, digits, `_` and `-`.
    pub name: String,
    /// Maximum duration, s: the stage ends with the first step that reaches it. By default the stage lasts until `time.end`, which ends the
    /// run in any stage.
    #[serde(default)]
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub duration: Option<f64>,
    /// Kinetic damping in this stage, which ends when both bounds are met; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub equilibrium: Option<Equilibrium>,
    /// Names of bodies to remove.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remove: Vec<String>,
    /// Bodies that get another material.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<NewMaterial>,
    /// New gravity, as in the job; t counts from the start of the stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 2, max = 3))]
    pub gravity: Option<Vec<Quantity>>,
    /// New conditions on the faces named here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub boundaries: Option<Boundaries>,
    /// Whether all material is at rest at the start of the stage.
    #[serde(default)]
    pub at_rest: bool,
    /// Whether the output fields `displacement` and `strain` restart from zero at the start of the stage.
    #[serde(default)]
    pub reset_displacement: bool,
}

/// A body gets another material. The elastic strain of its particles stays, so stress follows the new elastic constants; so do masses and
/// volumes. History variables stay between materials that have the same ones, and are reset otherwise.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewMaterial {
    /// Name of the body.
    pub body: String,
    /// Name of its new material.
    pub material: String,
}
