//! Stress at the start of a body, as it is written in a job file.
use super::loads::Quantity;
use crate::geometry::written::bound_items;
use crate::job::schema::common::is_off;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Initial stress of a body. The elastic strain is set to the one that produces this stress; a stress outside
/// the yield surface is refused, or returns to it with `relax`. Vertical is the axis of `gravity` at the
/// start.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Stress {
    /// Overconsolidation ratio: preconsolidation pressure over that of the yield surface through the stress;
    /// 1 is normally consolidated. For models with `preconsolidation_pressure`, in place of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1.0, max = 1e6))]
    pub ocr: Option<f64>,
    /// Preconsolidation pressure, Pa, in place of that of the material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub preconsolidation: Option<f64>,
    /// Whether a stress outside the yield surface returns to it, as the material yields in one step; then it
    /// is not that of the weight above, and the ground moves until it carries it. By default such a stress is
    /// an error.
    #[serde(default, skip_serializing_if = "is_off")]
    pub relax: bool,
    /// Kind of initial stress.
    #[serde(flatten)]
    pub kind: StressKind,
}

/// Kinds of initial stress.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StressKind {
    /// Vertical stress from the weight above, horizontal stresses proportional to it.
    Geostatic {
        /// Horizontal over vertical stress, K0; a number or an expression in x, y, z.
        k0: Quantity,
        /// Level of the surface, m, along the vertical axis: a number or an expression in the horizontal
        /// coordinates. By default it is found: all bodies above count, with their densities.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        surface: Option<Quantity>,
        /// Pressure on the surface, Pa; 0 by default.
        #[serde(default)]
        surcharge: Quantity,
    },
    /// The weight above as a pressure, equal in all directions.
    Hydrostatic {
        /// Level of the surface, m, as for `geostatic`; found by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        surface: Option<Quantity>,
        /// Pressure on the surface, Pa; 0 by default.
        #[serde(default)]
        surcharge: Quantity,
    },
    /// A table over depth, linear between its rows and constant outside.
    Depth {
        /// Rows [depth (m), vertical pressure (Pa), horizontal pressure (Pa)] with increasing depths;
        /// compression is positive.
        #[schemars(transform = limited)]
        table: Vec<[f64; 3]>,
        /// Level of depth 0, m, as for `geostatic`; by default that of the uppermost body.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        surface: Option<Quantity>,
    },
    /// Components of the Cauchy stress, Pa, tension positive: numbers or expressions in x, y, z; 0 by
    /// default.
    Components {
        /// Normal stress along x.
        #[serde(default)]
        xx: Quantity,
        /// Normal stress along y.
        #[serde(default)]
        yy: Quantity,
        /// Normal stress along z.
        #[serde(default)]
        zz: Quantity,
        /// Shear stress in the plane of x and y.
        #[serde(default)]
        xy: Quantity,
        /// Shear stress in the plane of x and z; 3D only.
        #[serde(default)]
        xz: Quantity,
        /// Shear stress in the plane of y and z; 3D only.
        #[serde(default)]
        yz: Quantity,
    },
}

/// Limits of the numbers of a table over depth.
fn limited(schema: &mut schemars::Schema) {
    if let Some(row) = schema.get_mut("items").and_then(|row| row.try_into().ok()) {
        bound_items(row, 1e13);
    }
}
