//! Sources as they are written in a job file.
use crate::geometry::written::{Shape, Vector};
use crate::job::schema::common::two;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A source: material that enters during the run, for pours, hoppers, jets and conveyors. Layers of particles
/// enter where the velocity leads into the shape; as long as they are in the shape, they move with that
/// velocity and bear no load. Its particles are a body with the name of the source. The mass (kg), the
/// momentum (kg m/s) and the kinetic energy (J) that it has brought since the start are columns of
/// `history.csv`: `fed_NAME`, `fed_NAME_x` and so on, `fed_energy_NAME`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Name, of letters, digits, `_` and `-`; that of its body in loads, probes, contacts and stages.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// Where material enters: at least one distance of particles long along the velocity, and free of other
    /// material. The section across the main axis of the velocity is that of the stream.
    pub shape: Shape,
    /// Components of the velocity, m/s, as many as the job has dimensions. Along its main axis it leads out
    /// of the shape.
    pub velocity: Vector,
    /// Mass per time, kg/s (in plane strain per metre of thickness); by default what fills the section at
    /// this velocity, density times area times speed, which is the most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub rate: Option<f64>,
    /// Time from which it feeds, s.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub from: f64,
    /// Time until which it feeds, s; to the end by default. The mass fed is rate times time to half a
    /// particle, of bodies of revolution to half a layer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub until: Option<f64>,
    /// Names of the stages in which it feeds; all by default. If given, `from` and `until` count from the
    /// start of the first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 20))]
    pub stages: Option<Vec<String>>,
    /// Particles per cell along each axis, on the lattice of bodies; need not be whole. Cells are those that
    /// `tree` asks for at the shape.
    #[serde(default = "two")]
    #[schemars(range(min = 0.5, max = 8.0))]
    pub particles_per_cell: f64,
}
