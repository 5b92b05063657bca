//! Contact between bodies as it is written in a job file.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Contact between bodies that deform: they move with velocities of their own and meet at their surfaces. Bodies that no contact names stick
/// where they touch, as if they were one. The mean force (N) on the first of two sides since the row before, and the work (J) since the
/// start, are columns of `history.csv`: `contact_NAME_x` and so on, `contact_work_NAME`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyContact {
    /// Name, of letters, digits, `_` and `-`; the number of the contact in the job, from 1, by default.
    #[serde(default)]
    pub name: Option<String>,
    /// The sides between which it holds, each the name of a body or a list of names: bodies of different sides are in contact. Each
    /// body is a side by default. Where several contacts name the same two bodies, the last holds.
    #[serde(default)]
    #[schemars(length(min = 2, max = 250))]
    pub between: Option<Vec<Side>>,
    /// What happens where they touch.
    #[serde(default)]
    pub kind: PairKind,
    /// Friction coefficient, the tangent of the friction angle; 0 by default. Of `separating` only.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub friction: Option<f64>,
    /// Shear stress that holds while they touch, whatever the pressure, Pa; 0 by default. Of `separating` only.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e15))]
    pub cohesion: Option<f64>,
    /// Tension up to which they do not part, Pa; 0 by default. Of `separating` only.
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

/// What happens where bodies touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PairKind {
    /// They move as one.
    Sticky,
    /// Once they touch they stay together and slide freely.
    Slip,
    /// They part freely; Coulomb friction while they press.
    #[default]
    Separating,
}
