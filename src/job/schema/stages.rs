//! Stages of a run as they are written in a job file.
use super::conditions::boundaries::Boundaries;
use super::conditions::loads::Quantity;
use super::equilibrium::Equilibrium;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A stage of the run. Stages run in the order of the file; the first starts at t = 0. A change stays in
/// force until another stage changes it again. Loads and colliders name the stages in which they act, bodies
/// the stage in which they appear.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name, of letters, digits, `_` and `-`.
    pub name: String,
    /// Maximum duration, s: the stage ends with the first step that reaches it. By default the stage lasts
    /// until `time.end`, which ends the run in any stage.
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
    /// Search for the factor of safety in the last stage of a job with `[quasi_static]`; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strength_reduction: Option<StrengthReduction>,
}

/// The strength of all materials is divided by a factor that grows by 1 in 1 s, a load step after the other:
/// cohesion, yield stress and the tangents of friction angles. A step without equilibrium is cut in half. The
/// run ends with the greatest factor that has equilibrium: the factor of safety. Forces balance on the shape
/// of the ground at the start of each step.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrengthReduction {
    /// Factor at the start of the stage.
    #[serde(default = "default_from")]
    #[schemars(range(min = 0.01, max = 100.0))]
    pub from: f64,
    /// Factor at which the run ends if there is still equilibrium; above `from`.
    #[schemars(range(min = 0.01, max = 100.0))]
    pub to: f64,
    /// Growth of the factor in a load step, until the first one that fails.
    #[serde(default = "default_growth")]
    #[schemars(range(min = 1e-4, max = 10.0))]
    pub step: f64,
    /// Greatest difference between the last factor with equilibrium and the first without; at most `step`.
    #[serde(default = "default_difference")]
    #[schemars(range(min = 1e-6, max = 1.0))]
    pub tolerance: f64,
    /// Whether flow is associated, with cohesion and tan φ times `cos ψ cos φ / (1 - sin ψ sin φ)`
    /// (Davis 1968; Sysala et al. 2023): the factor then does not depend on steps. Without, material whose
    /// flow is not associated keeps it.
    #[serde(default = "default_davis")]
    pub davis: bool,
}

fn default_from() -> f64 {
    1.0
}

fn default_growth() -> f64 {
    0.05
}

fn default_difference() -> f64 {
    0.01
}

fn default_davis() -> bool {
    true
}

/// A body gets another material. The elastic strain of its particles stays, so stress follows the new elastic
/// constants; so do masses and volumes. History variables stay between materials that have the same ones, and
/// are reset otherwise.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewMaterial {
    /// Name of the body.
    pub body: String,
    /// Name of its new material.
    pub material: String,
}
