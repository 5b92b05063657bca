//! Keys and values that several tables of the job file share.
use crate::geometry::written::bound_items;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Greatest component of a velocity, m/s or rad/s: less than light.
pub(in crate::job) const FASTEST: f64 = 1e8;

/// For vectors that are velocities.
pub(in crate::job::schema) fn velocity(schema: &mut schemars::Schema) {
    bound_items(schema, FASTEST);
}

/// An angular velocity.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Spin {
    /// About z, in 2D, rad/s.
    Plane(#[schemars(range(min = -1e8, max = 1e8))] f64),
    /// Components about x, y and z, in 3D, rad/s.
    Space(#[schemars(transform = velocity)] [f64; 3]),
}

/// Name of a coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AxisName {
    /// First axis.
    X,
    /// Second axis.
    Y,
    /// Third axis; 3D only.
    #[schemars(extend("x-dimension" = 3))]
    Z,
}

/// Whether a flag is off.
pub(in crate::job::schema) fn is_off(flag: &bool) -> bool {
    !*flag
}

/// Default of flags that are on.
pub(in crate::job::schema) fn yes() -> bool {
    true
}

pub(in crate::job::schema) fn two() -> f64 {
    2.0
}
