//! What several tables of the job file have.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Components along x, y (and z in 3D): as many as the job has dimensions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, transform = two_or_three)]
pub struct Vector(pub Vec<f64>);

fn two_or_three(schema: &mut schemars::Schema) {
    schema.insert("minItems".into(), 2.into());
    schema.insert("maxItems".into(), 3.into());
    // Metres across a solar system; squares and sums stay finite.
    bound_items(schema, 1e12);
}

fn bound_items(schema: &mut schemars::Schema, limit: f64) {
    if let Some(items) = schema.get_mut("items").and_then(serde_json::Value::as_object_mut) {
        items.insert("minimum".into(), (-limit).into());
        items.insert("maximum".into(), limit.into());
    }
}

/// Greatest component of a velocity, m/s or rad/s: less than light.
const FASTEST: f64 = 1e8;

/// For vectors that are velocities.
pub(super) fn velocity(schema: &mut schemars::Schema) {
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

/// Default of flags that are on.
pub(super) fn yes() -> bool {
    true
}
