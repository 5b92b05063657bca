//! Stages of a run as they are written in a job file.
use super::job_file::{Boundaries, Equilibrium, Quantity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A stage of the run. Stages follow each other in the order of the file; the first begins at t = 0. What a stage changes at its
/// start stays so until another stage changes it again. Loads and colliders name the stages in which they act, bodies the one in which
/// they come.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name, of letters, digits, `_` and `-`.
    pub name: String,
    /// Longest duration, s: the stage ends with the first step that reaches it. To `time.end` by default, which ends the run in any
    /// stage.
    #[serde(default)]
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub duration: Option<f64>,
    /// Kinetic damping in this stage, which ends once both bounds hold; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub equilibrium: Option<Equilibrium>,
    /// Names of bodies that are taken away.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remove: Vec<String>,
    /// Bodies that get another material.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<NewMaterial>,
    /// New gravity, as in the job; t is counted from the start of the stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 2, max = 3))]
    pub gravity: Option<Vec<Quantity>>,
    /// New conditions on the faces that are named here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub boundaries: Option<Boundaries>,
    /// Whether all material is at rest at the start of the stage.
    #[serde(default)]
    pub at_rest: bool,
    /// Whether the output fields `displacement` and `strain` are counted from the start of the stage.
    #[serde(default)]
    pub reset_displacement: bool,
}

/// A body gets another material. The elastic strain of its particles stays, so stress follows the new elastic constants; so do masses and
/// volumes. History variables stay between materials that have the same ones, and begin anew otherwise.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewMaterial {
    /// Name of the body.
    pub body: String,
    /// Name of its new material.
    pub material: String,
}
