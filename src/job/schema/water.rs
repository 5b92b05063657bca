//! Water in the pores as it is written in a job file.
use super::loads::Quantity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Water in connected pores of all material, with a given pressure: models see the effective stress, and the material carries the total
/// stress. Free water above the ground loads its surface, and bodies under water are buoyant. Materials have their `saturated_density`
/// below the water table at the start. Columns of `history.csv`: the mean force (N) on the material, `load_water_x` and so on, and its
/// work (J), `work_water`. Forces on colliders and faces are those of the effective stress, without the pressure of the water on them.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Water {
    /// Level of the water table along the vertical axis, that of `gravity`, m: a number, an expression in the horizontal coordinates and t, or
    /// a table over time. The pressure below is hydrostatic, with the weight of the water above. An inclined table makes the water push
    /// along its slope. Either this or `pressure`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<Quantity>,
    /// The pressure itself, Pa, such as that of seepage: a number, an expression in x, y, z and t, or a table over time. The water table is
    /// where it falls to 0. Either this or `level`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<Quantity>,
    /// Density of the water, kg/m³.
    #[serde(default = "fresh")]
    #[schemars(range(min = 1.0, max = 1e5))]
    pub density: f64,
    /// Greatest suction above the water table, Pa: the pressure there goes down to its negative. By default there is none.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e9))]
    pub suction: f64,
}

fn fresh() -> f64 {
    1000.0
}
