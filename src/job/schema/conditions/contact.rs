//! Contact between bodies as it is written in a job file.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Contact between deformable bodies: each moves with its own velocity field, and they meet at their
/// surfaces. Bodies that no contact names stick where they touch, as if glued. Columns of `history.csv`: the
/// mean force (N) on the first of two sides since the previous row, `contact_NAME_x` and so on, and the work
/// (J) since the start, `contact_work_NAME`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyContact {
    /// Name, of letters, digits, `_` and `-`; by default the number of the contact in the job, from 1.
    #[serde(default)]
    pub name: Option<String>,
    /// The sides of the contact, each the name of a body or a list of names: bodies on different sides are in
    /// contact. By default each body is a side. If several contacts name the same pair of bodies, the last
    /// one applies.
    #[serde(default)]
    #[schemars(length(min = 2, max = 250))]
    pub between: Option<Vec<Side>>,
    /// Law of contact where they touch.
    #[serde(default)]
    pub kind: PairKind,
    /// Friction coefficient, the tangent of the friction angle; 0 by default. For `separating` only.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub friction: Option<f64>,
    /// Shear strength of the interface at zero pressure, Pa; 0 by default. For `separating` only.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e15))]
    pub cohesion: Option<f64>,
    /// Tensile strength of the interface, Pa; 0 by default. For `separating` only.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e15))]
    pub tension: Option<f64>,
}

/// One side of a contact.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Side {
    /// A body.
    One(String),
    /// Bodies that belong together.
    Several(Vec<String>),
}

/// Law of contact where bodies touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PairKind {
    /// They move as one.
    Sticky,
    /// Once in touch, they stay together and slide freely.
    Slip,
    /// They may separate; Coulomb friction acts under pressure.
    #[default]
    Separating,
}
