//! Faces of the domain.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::loads::Quantity;

/// Conditions on the faces of the domain. By default a face is `separating` without friction.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boundaries {
    /// Lower face along x.
    #[serde(default)]
    pub x_min: Option<Face>,
    /// Upper face along x.
    #[serde(default)]
    pub x_max: Option<Face>,
    /// Lower face along y.
    #[serde(default)]
    pub y_min: Option<Face>,
    /// Upper face along y.
    #[serde(default)]
    pub y_max: Option<Face>,
    /// Lower face along z; 3D only.
    #[serde(default)]
    #[schemars(extend("x-dimension" = 3))]
    pub z_min: Option<Face>,
    /// Upper face along z; 3D only.
    #[serde(default)]
    #[schemars(extend("x-dimension" = 3))]
    pub z_max: Option<Face>,
    /// Fate of particles that leave the domain through a face of another kind than `outflow`; an
    /// error by default. Particles that cross a face only by rounding are always put back and counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leaving: Option<Leaving>,
}

/// Condition on a face of the domain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Face {
    /// No velocity on the face.
    Sticky {},
    /// No velocity through the face, no friction.
    Slip {},
    /// Material may leave the face; Coulomb friction acts while it presses, cohesion and turbulent friction
    /// while it touches.
    Separating {
        /// Friction coefficient, the tangent of the friction angle; 0 by default.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 100.0))]
        friction: f64,
        /// Shear stress that holds without pressure where material touches, Pa; 0 by default.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 1e15))]
        cohesion: f64,
        /// Voellmy's coefficient ξ of turbulent friction, m/s²: a shear stress of `ρ g v² / ξ` more, with
        /// the density ρ and the velocity v of the material at the surface and g = 9.80665 m/s². Snow has 400
        /// to 4000; none by default.
        #[schemars(range(min = 1e-3, max = 1e12))]
        turbulent_friction: Option<f64>,
    },
    /// A plane of symmetry.
    Symmetric {},
    /// An open boundary: no condition on velocities. Particles that cross it leave the run, whatever
    /// `leaving` says, and are counted with their mass.
    Outflow {},
    /// Waves go out, as if the material went on: dashpots in proportion to the velocity (Lysmer and
    /// Kuhlemeyer). Alone they creep under a lasting stress, so `pressure` holds the material at rest.
    Absorbing {
        /// Speed of compression waves, m/s.
        #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
        p_speed: f64,
        /// Speed of shear waves, m/s.
        #[schemars(range(min = 0.0, max = 1e6))]
        s_speed: f64,
        /// Density of the material at the face, kg/m³.
        #[schemars(range(min = 1e-6, max = 1e5))]
        density: f64,
        /// Pressure from beyond the face, Pa: a number, an expression in x, y, z and t, or a table over time;
        /// none by default.
        #[serde(default)]
        pressure: Quantity,
    },
}

/// Fate of particles that leave the domain.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Leaving {
    /// The run ends with an error that names them.
    #[default]
    Error,
    /// They are deleted and counted.
    Delete,
    /// They are moved back to the face and counted.
    Clamp,
}
