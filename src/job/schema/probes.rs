//! Measurements of the material as they are written in a job file.
use crate::geometry::written::{Shape, Vector};
use crate::probe::Measured;
use crate::probe::line::Sampled;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A measurement of the material in a shape, as columns of `history.csv` such as `mass_NAME` and
/// `velocity_NAME_x`. A particle counts where its centre lies in the shape. Means are `NaN` while there is no
/// material.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Name, of letters, digits, `_` and `-`.
    pub name: String,
    /// Where to measure; everywhere by default.
    #[serde(default)]
    pub shape: Option<Shape>,
    /// Names of the bodies that it measures; all by default.
    #[serde(default)]
    #[schemars(length(min = 1, max = 65_535))]
    pub bodies: Option<Vec<String>>,
    /// Recorded quantities; mass, centre and velocity by default.
    #[serde(default = "usual")]
    #[schemars(length(min = 1))]
    pub quantities: Vec<Measured>,
    /// Point on the ground below the middle of a deposit, m, from which `run_out`, `edge` and `height` are
    /// counted: heights along the last axis, distances over the others.
    #[serde(default)]
    pub foot: Option<Vector>,
}

fn usual() -> Vec<Measured> {
    vec![Measured::Mass, Measured::Centre, Measured::Velocity]
}

/// A tracked particle, with columns of `history.csv` such as `centre_NAME_x`: the one nearest to a point at
/// the start. If it splits, the columns are sums and means over its pieces, and those of the whole again once
/// they merge back. If it merges with other particles, the particle nearest to its last position takes over.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Track {
    /// Name, of letters, digits, `_` and `-`; no probe has the same.
    pub name: String,
    /// The point, m.
    pub point: Vector,
    /// Names of the bodies whose particles count; all by default.
    #[serde(default)]
    #[schemars(length(min = 1, max = 65_535))]
    pub bodies: Option<Vec<String>>,
    /// Recorded quantities, none of a deposit; centre and velocity by default.
    #[serde(default = "usual_of_track")]
    #[schemars(length(min = 1))]
    pub quantities: Vec<Measured>,
}

fn usual_of_track() -> Vec<Measured> {
    vec![Measured::Centre, Measured::Velocity]
}

/// Net mass that has passed since the start of the run, the column `passed_NAME` of `history.csv` (kg):
/// through a plane in the direction of its normal, or out of the domain through a face. The sums are exact:
/// the mass inside and the mass that has left add up to the total.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Flux {
    /// Name, of letters, digits, `_` and `-`.
    pub name: String,
    /// A point of the plane, m.
    #[serde(default)]
    pub point: Option<Vector>,
    /// Normal of the plane, any length: mass that passes in this direction counts as positive.
    #[serde(default)]
    pub normal: Option<Vector>,
    /// Lower corner of a box, m: with `max`, only mass that crosses the plane inside the box counts, such as
    /// at a slot or a gate. Masses are then added as particles cross; splits and merges across the plane
    /// count as nothing.
    #[serde(default)]
    pub min: Option<Vector>,
    /// Upper corner of the box, m.
    #[serde(default)]
    pub max: Option<Vector>,
    /// A face of the domain, in place of a plane.
    #[serde(default)]
    pub face: Option<FaceName>,
}

/// A face of the domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaceName {
    /// Lower face along x.
    XMin,
    /// Upper face along x.
    XMax,
    /// Lower face along y.
    YMin,
    /// Upper face along y.
    YMax,
    /// Lower face along z.
    #[schemars(extend("x-dimension" = 3))]
    ZMin,
    /// Upper face along z.
    #[schemars(extend("x-dimension" = 3))]
    ZMax,
}

impl FaceName {
    /// Its axis, and its side: 0 for the lower face, 1 for the upper one.
    pub fn axis_and_side(self) -> (usize, usize) {
        (self as usize / 2, self as usize % 2)
    }
}

/// Points at equal distances on a line at which the material is shown, with a row for each in
/// `JOB.line_NAME.csv` whenever `history.csv` has one. Values are means over the particles within a cell of
/// the point, weighted by max(0, 1 - distance / edge of the cell) along each axis. Means are `NaN` where
/// there is no material.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// Name, of letters, digits, `_` and `-`; part of the name of the file.
    pub name: String,
    /// First point, m.
    pub from: Vector,
    /// Last point, m.
    pub to: Vector,
    /// Number of points, both ends included.
    #[serde(default = "twenty_one")]
    #[schemars(range(min = 2, max = 1000))]
    pub points: u32,
    /// Names of the bodies that count; all by default.
    #[serde(default)]
    #[schemars(length(min = 1, max = 65_535))]
    pub bodies: Option<Vec<String>>,
    /// Recorded quantities; all but pore_pressure by default.
    #[serde(default = "usual_of_line")]
    #[schemars(length(min = 1, max = 7))]
    pub quantities: Vec<Sampled>,
}

fn twenty_one() -> u32 {
    21
}

fn usual_of_line() -> Vec<Sampled> {
    Sampled::USUAL.to_vec()
}

/// A raster in plan, over all axes but the last, with the largest depth (m) and the largest speed of a
/// particle (m/s) at the rows of the history so far: `JOB.map_NAME_depth.asc` and `JOB.map_NAME_speed.asc`,
/// written with each output, and in files of particles as `maps/NAME/depth` and `maps/NAME/speed`. The depth
/// is the volume of the material whose particles lie in a cell over the area of the cell (in axisymmetry a
/// row of rings, and the area of each).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// Name, of letters, digits, `_` and `-`; part of the names of the files.
    pub name: String,
    /// Edge of a cell of the raster, m; at least that of the cells where the material is, or depths are of
    /// single particles.
    #[schemars(range(min = 1e-9, max = 1e7))]
    pub cell: f64,
    /// Lower corner of the raster: as many coordinates as the job has dimensions less one, m; that of the
    /// domain by default.
    #[serde(default)]
    #[schemars(length(min = 1, max = 2), inner(range(min = -1e12, max = 1e12)))]
    pub min: Option<Vec<f64>>,
    /// Upper corner of the raster, m; that of the domain by default.
    #[serde(default)]
    #[schemars(length(min = 1, max = 2), inner(range(min = -1e12, max = 1e12)))]
    pub max: Option<Vec<f64>>,
    /// Names of the bodies that count; all by default.
    #[serde(default)]
    #[schemars(length(min = 1, max = 65_535))]
    pub bodies: Option<Vec<String>>,
}
