//! The way to equilibrium.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The way to equilibrium, by kinetic damping: whenever the kinetic energy has passed a peak, all velocities
/// are set to 0. The run ends at rest, once both bounds hold, or at `time.end`. Columns of `history.csv` show
/// the last peak, the last unbalanced force, and how often velocities were set to 0. What has still to fall
/// is stopped with the rest, and hardly moves: let it come down in a stage before, without `equilibrium`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Equilibrium {
    /// Bound on the root mean square of the velocities at a peak of the kinetic energy, m/s; 1e-6 of the wave
    /// speed is small.
    #[schemars(range(max = 1e8), extend("exclusiveMinimum" = 0.0))]
    pub speed: f64,
    /// Bound on the root mean square of the unbalanced force per mass, m/s²; 1e-4 of gravity is small.
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub acceleration: f64,
    /// Whether the material of fine cells moves with more mass than it has, fourfold for each level above
    /// `tree.base_level`, so that the coarsest cells set the time step. Weight and all other forces are those
    /// of its own mass, so the equilibrium is the same; the motion before it is not physical.
    #[serde(default)]
    pub mass_scaling: bool,
}
