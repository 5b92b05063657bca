//! Loads and quantities as they are written in a job file.
use crate::geometry::written::{Shape, Vector};
use crate::job::schema::common::yes;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A quantity: a number; an expression in x, y, z (m) and t (s), of loads on material also in X, Y, Z (m),
/// such as "0.1 * sin(2 * pi * t)"; a table over time, [[time, value], …] or from a file { file =
/// "record.csv" }, linear between its rows and constant outside; or values at places from a file, { points =
/// "standpipes.csv" } or { raster = "table.asc" }.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Quantity {
    /// The same everywhere and always.
    Number(#[schemars(range(min = -1e12, max = 1e12))] f64),
    /// An expression in x, y, z (m), t (s) and, in loads on material, X, Y, Z (m; the place in the undeformed
    /// body), with + - * / ^ < > <= >=, pi, and sin, cos, tan, asin, acos, atan, atan2, sinh, cosh, tanh,
    /// exp, ln, log10, sqrt, abs, sign, step, ramp, floor, ceil, min, max.
    Expression(String),
    /// Rows [time (s), value] with increasing times.
    Table(#[schemars(length(max = 100_000), inner(inner(range(min = -1e12, max = 1e12))))] Vec<[f64; 2]>),
    /// A table in a file.
    Record(Box<Record>),
    /// Values at points from a file.
    Points(Box<Points>),
    /// Values at x and y from a raster.
    Raster(Box<Raster>),
}

/// A table over time from a file with columns separated by semicolons, tabs, commas or spaces, or a record of
/// the PEER database. Lines that start with # are comments, and the first line may hold the names of the
/// columns. If its rows change, a restart is refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Name of the file, relative to the job file.
    pub file: String,
    /// Column of the times, s: its number, from 1, or its name in the first line; the first by default.
    #[serde(default = "first")]
    pub time: Column,
    /// Column of the values: its number or name; the second by default.
    #[serde(default = "second")]
    pub value: Column,
    /// Factor for the values: 9.81 converts g to m/s².
    #[serde(default = "one")]
    #[schemars(range(min = -1e12, max = 1e12))]
    pub scale: f64,
}

/// Values at points from a file with columns, as of a table over time. The first line names them: those of
/// the coordinates x, y and z (m) on which the values depend, and of the values. Points at all combinations
/// of some coordinates are a grid: values between them are linear along each coordinate. Other points over
/// two coordinates make triangles, with linear values. Outside, the nearest place counts. If the file
/// changes, a restart is refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Points {
    /// Name of the file, relative to the job file.
    pub points: String,
    /// Column of the values: its number or name; by default the first that is no coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<Column>,
    /// Factor for the values: 1000 converts kPa to Pa.
    #[serde(default = "one")]
    #[schemars(range(min = -1e12, max = 1e12))]
    pub scale: f64,
    /// Where the origin of the coordinates of the file lies, m; the origin of the job by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Vector>,
}

/// Values at x and y from a raster that covers the domain, every cell with a value; linear between the
/// middles of its cells. If the file changes, a restart is refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Raster {
    /// Name of an ESRI ASCII grid (`.asc`), a GeoTIFF (`.tif`) or an array of NumPy (`.npy`, `.npz`), rows
    /// from north to south; relative to the job file.
    pub raster: String,
    /// Distance of neighbouring values, m: for arrays, which do not have it, or in place of that of the file;
    /// the south-western value then stands at the origin of the raster's coordinates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0))]
    pub cell: Option<f64>,
    /// Name of the array in a file with several (`.npz`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub array: Option<String>,
    /// Factor for the values.
    #[serde(default = "one")]
    #[schemars(range(min = -1e12, max = 1e12))]
    pub scale: f64,
    /// Where the origin of the raster's coordinates lies, m; the origin of the job by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Vector>,
}

/// A column of a file: its number, from 1, or its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Column {
    /// Its number, from 1.
    Number(#[schemars(range(min = 1, max = 1000))] u16),
    /// Its name in the first line.
    Name(String),
}

pub(super) fn first() -> Column {
    Column::Number(1)
}

fn second() -> Column {
    Column::Number(2)
}

pub(super) fn one() -> f64 {
    1.0
}

impl Default for Quantity {
    fn default() -> Self {
        Self::Number(0.0)
    }
}

/// A load: what acts on the material beside gravity, contact and the faces of the domain. Body forces, grips
/// and damping act in their shape at all times; tractions, pressures and point forces on the material that
/// lies there at the start, wherever it goes. Its mean force (N) since the row before and its work (J) since
/// the start are columns of `history.csv`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Load {
    /// Name, of letters, digits, `_` and `-`.
    pub name: String,
    /// Where the load acts; everywhere by default. A traction or a pressure acts on the part of the bodies'
    /// surfaces that lies in the shape or on its surface. Material at a face of the domain or against another
    /// body has no surface there.
    #[serde(default)]
    pub shape: Option<Shape>,
    /// Names of the stages in which it acts; all by default. If given, all times of the load count from the
    /// start of the first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 20))]
    pub stages: Option<Vec<String>>,
    /// Time from which it acts, s; 0 by default.
    #[serde(default)]
    #[schemars(range(min = -1e12, max = 1e12))]
    pub from: f64,
    /// Time until which it acts, s; to the end by default.
    #[serde(default)]
    #[schemars(range(min = -1e12, max = 1e12))]
    pub until: Option<f64>,
    /// Kind of load.
    #[serde(flatten)]
    pub kind: LoadKind,
}

/// Kinds of loads.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum LoadKind {
    /// A force per mass.
    BodyForce {
        /// Components of the acceleration, m/s²: as many as the job has dimensions.
        acceleration: Vec<Quantity>,
    },
    /// A grip: it prescribes the velocity of the material along the named axes.
    Velocity {
        /// Component along x, m/s; free by default.
        #[serde(default)]
        x: Option<Quantity>,
        /// Component along y, m/s; free by default.
        #[serde(default)]
        y: Option<Quantity>,
        /// Component along z, m/s; free by default; 3D only.
        #[serde(default)]
        z: Option<Quantity>,
    },
    /// Drag proportional to mass: velocities decay as exp(-rate time).
    Damping {
        /// Rate, 1/s.
        rate: Quantity,
    },
    /// Local, non-viscous damping (Cundall): on each node a force of `factor` times its unbalanced force,
    /// against its velocity, component by component. It brings a body to rest in proportion to its own
    /// period, and leaves one that moves steadily, or is in equilibrium, as it is. The unbalanced force is
    /// that of stress, gravity and the loads before it in the job.
    LocalDamping {
        /// Share of the unbalanced force. From one turn to the next amplitudes fall by √((1 - factor) / (1 +
        /// factor)).
        #[schemars(range(min = 0.0, max = 0.99))]
        factor: f64,
    },
    /// A dead force per undeformed area on the surface of bodies.
    Traction {
        /// Components, Pa: as many as the job has dimensions.
        traction: Vec<Quantity>,
        /// Bodies whose surfaces count; all by default.
        #[serde(default)]
        bodies: Option<Vec<String>>,
        /// Restricts the load to surface whose outward normal at the start is within 45° of this vector; all
        /// by default.
        #[serde(default)]
        facing: Option<Vector>,
    },
    /// A pressure on the surface of bodies, against its outward normal.
    Pressure {
        /// The pressure, Pa; a negative value pulls.
        pressure: Quantity,
        /// Whether it acts on the deformed surface, along its normal, or on the undeformed one.
        #[serde(default = "yes")]
        follow: bool,
        /// Bodies whose surfaces count; all by default.
        #[serde(default)]
        bodies: Option<Vec<String>>,
        /// Restricts the load to surface whose outward normal at the start is within 45° of this vector; all
        /// by default.
        #[serde(default)]
        facing: Option<Vector>,
    },
    /// A dead force, distributed over the particles that lie in the shape at the start.
    PointForce {
        /// Components of the total force, N; in plane strain per metre of thickness.
        force: Vec<Quantity>,
        /// How it is distributed.
        #[serde(default)]
        share: Sharing,
        /// Bodies whose particles count; all by default.
        #[serde(default)]
        bodies: Option<Vec<String>>,
    },
}

/// How a force is shared over particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sharing {
    /// In proportion to their volumes.
    #[default]
    Volume,
    /// Equally.
    Equal,
}
