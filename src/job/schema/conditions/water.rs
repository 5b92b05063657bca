//! Water in the pores as it is written in a job file.
use super::loads::Quantity;
use crate::geometry::written::Shape;
use crate::job::schema::probes::FaceName;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Water in connected pores of all material, with a given pressure: models see the effective stress, and the
/// material carries the total stress. Free water above the ground loads its surface, and bodies under water
/// are buoyant. Materials have their `saturated_density` below the water table, wherever that moves. Columns
/// of `history.csv`: the mean force (N) on the material, `load_water_x` and so on, and its work (J),
/// `work_water`; where densities differ also the mass (kg) of the water that has filled pores since the
/// start, the momentum (kg m/s) and the kinetic and gravitational energy (J) that it had, `pore_water`,
/// `pore_water_x` and so on, `pore_water_energy`; of seepage the flow into the ground (m³/s) at each head,
/// `flow_NAME`, and through its surface, `flow_surface`. Forces on colliders and faces are those of the
/// effective stress; the thrust (N) of water with a `level` or a `pressure` stands beside them, at the time
/// of the row: `water_NAME_x` and so on for a collider that does not deform, and `water_x_min_x` and so on
/// with `history.face_forces`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Water {
    /// Level of the water table along the vertical axis, that of `gravity`, m: a number, an expression in the
    /// horizontal coordinates and t, or a table over time. The pressure below is hydrostatic, with the weight
    /// of the water above. An inclined table makes the water push along its slope. This, `pressure` or
    /// `seepage`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<Quantity>,
    /// The pressure itself, Pa: a number, an expression in x, y, z and t, or a table over time. The water
    /// table is where it falls to 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<Quantity>,
    /// Steady seepage through the ground, from heads that are held to others and to the surface of the
    /// ground: solved on the nodes of the tree at the start and at the start of each stage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seepage: Option<Seepage>,
    /// Names of the stages in which there is water; all by default. If given, times of `level`, `pressure`
    /// and heads count from the start of the first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 20))]
    pub stages: Option<Vec<String>>,
    /// Density of the water, kg/m³.
    #[serde(default = "fresh")]
    #[schemars(range(min = 1.0, max = 1e5))]
    pub density: f64,
    /// Greatest suction above the water table, Pa: the pressure there goes down to its negative. By default
    /// there is none.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e9))]
    pub suction: f64,
}

/// Steady seepage by Darcy's law with the `permeability` of the materials. Where the ground is open to the
/// air, on surfaces that no head and no collider covers, water leaves at the pressure of the air; faces of
/// the domain without a head are tight. Above the free surface the pores conduct next to nothing.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Seepage {
    /// Heads that are held. Where two meet the first holds.
    #[schemars(length(min = 1, max = 12))]
    pub heads: Vec<Head>,
    /// Simulated time between solutions, s; needed where a level changes in time. By default heads are found
    /// at the start of stages alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-12, max = 1e12))]
    pub every: Option<f64>,
}

/// A head that is held on a face or in a shape: that of free water, of a well, of a drain. Where its level
/// lies below the ground there, the ground is open to the air.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Name, of letters, digits, `_` and `-`; part of the name of its column.
    pub name: String,
    /// The face of the domain where it is held. Either this or `shape`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<FaceName>,
    /// The shape in which it is held: nodes of the ground in it, those on its surface among them. For free
    /// water the shape reaches into the water's bed by no more than the cells there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<Shape>,
    /// Level of the water, m along the vertical axis: a number, an expression in x, y, z and t, or a table
    /// over time.
    pub level: Quantity,
}

fn fresh() -> f64 {
    1000.0
}
