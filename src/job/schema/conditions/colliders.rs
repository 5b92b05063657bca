//! Colliders as they are written in a job file.
use super::loads::{Column, first, one};
use crate::geometry::written::{Shape, Vector};
use crate::job::schema::common::{AxisName, Spin, is_off, velocity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rigid body that acts on material, by default on the nodes inside it: then nothing less than two cells
/// thick stops material. Forces, torques and places are columns of `history.csv`: `force_NAME_x` and so on,
/// each force the mean since the row before.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Collider {
    /// Name, of letters, digits, `_` and `-`.
    pub name: String,
    /// Initial shape; may extend beyond the domain.
    pub shape: Shape,
    /// Law of contact for material that touches it; by default it may leave, without friction.
    #[serde(default)]
    pub contact: Option<Contact>,
    /// Where it acts: on nodes or on particles; `nodes` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acts_on: Option<ActsOn>,
    /// Motion; fixed by default.
    #[serde(default)]
    pub motion: Option<Motion>,
    /// Meshes that follow that of `shape`, for a collider that deforms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<Frames>,
    /// Names of the stages in which it exists; all by default. If given, the times of its motion count from
    /// the start of the first of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 20))]
    pub stages: Option<Vec<String>>,
    /// Centre of its rotation and reference point of its torque, m. By default the centre of mass for a free
    /// body whose inertia follows from its shape, and otherwise the centre of its bounding box, cut by the
    /// domain.
    #[serde(default)]
    pub reference: Option<Vector>,
}

/// Meshes of a surface that deforms. Vertices move on straight lines from one mesh to the next, and stop at
/// the last one. `motion` is added.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Frames {
    /// Time between two meshes, s.
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub every: f64,
    /// Names of the files, in the order of time, with the vertices and triangles of the mesh of `shape`, in
    /// the same order; `scale`, `origin` and `solid` are those of `shape`.
    #[schemars(length(min = 1, max = 10_000))]
    pub files: Vec<String>,
}

/// On what a collider acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ActsOn {
    /// On the grid nodes inside it: the cheapest way. Contact of elastic solids is at its surface, that of
    /// others a fraction of a cell off; walls thinner than two cells leak.
    Nodes,
    /// On the particles that touch it: walls of any thickness hold. This includes sheets: boxes that are
    /// flat along one axis, and open meshes. Walls two cells thick hold fluids at nodes as well, in jobs
    /// that have fluids alone.
    Particles,
}

/// Law of contact for material that touches a collider.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Contact {
    /// Material moves with the collider.
    Sticky {},
    /// Material slides along the surface without friction and never leaves it.
    Slip {},
    /// Material may leave the surface; Coulomb friction acts while it presses, cohesion and turbulent
    /// friction while it touches.
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
}

/// How a collider moves.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Motion {
    /// None.
    Fixed {},
    /// Constant velocities.
    Steady {
        /// Velocity of the reference point, m/s; 0 by default.
        #[serde(default)]
        #[schemars(transform = velocity)]
        velocity: Option<Vector>,
        /// Angular velocity about the reference point, rad/s: three components in 3D, one number in 2D.
        #[serde(default)]
        angular_velocity: Option<Spin>,
        /// Time over which it reaches these velocities from rest, s, smoothly, on half a period of a cosine;
        /// at once by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        ramp: Option<f64>,
    },
    /// Prescribed by a table, linear between rows, at rest before the first and after the last one. The
    /// velocity in a time step is the mean over the step.
    Table {
        /// Axis of the rotations, any length; 3D only, z by default.
        #[serde(default)]
        #[schemars(extend("x-dimension" = 3))]
        axis: Option<Vector>,
        /// Rows with increasing times; at least two. Either these or `record`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(length(max = 100_000))]
        rows: Option<Vec<Row>>,
        /// The rows from a file.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        record: Option<MotionRecord>,
        /// Whether it comes to rest at each row, on half a period of a cosine from one row to the next; the
        /// speed then reaches π/2 times that of a linear motion.
        #[serde(default, skip_serializing_if = "is_off")]
        smooth: bool,
    },
    /// As a rigid body under gravity and the forces of the material. It should be heavier than the material
    /// that it touches within a cell of its surface. Unless `collides = false` it collides with the faces
    /// of the domain, other than `symmetric`, `outflow` and `absorbing` ones, and other colliders.
    Free {
        /// Mass, kg; in plane strain of one metre of thickness, of bodies of revolution of the whole. Either
        /// this or `density`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(range(max = 1e24), extend("exclusiveMinimum" = 0.0))]
        mass: Option<f64>,
        /// Density, kg/m³, from which mass and inertia follow with the shape.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        density: Option<f64>,
        /// Velocity at the start, m/s; 0 by default.
        #[serde(default)]
        #[schemars(transform = velocity)]
        velocity: Option<Vector>,
        /// Axes along which it may move; all by default.
        #[serde(default)]
        along: Option<Vec<AxisName>>,
        /// Whether it rotates; by default in 3D, and in 2D if `density` or `inertia` is given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        turns: Option<bool>,
        /// A number: moment of inertia about a fixed axis through the reference point, kg m²; in 2D of one
        /// metre of thickness. Three numbers, in 3D: principal moments about the centre of mass, with x, y
        /// and z as principal axes at the start, for a body that turns about any axis. By default that of the
        /// shape, filled evenly.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        inertia: Option<Inertia>,
        /// Fixed axis of rotation, any length; 3D only. By default the body rotates about any axis, or about
        /// z if `inertia` is a number.
        #[serde(default)]
        #[schemars(extend("x-dimension" = 3))]
        axis: Option<Vector>,
        /// Angular velocity at the start, rad/s: a number about z or the fixed axis, or three components of a
        /// body that turns about any axis; 0 by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        angular_velocity: Option<Spin>,
        /// Whether it collides with faces of the domain and other colliders; true by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        collides: Option<bool>,
        /// Coefficient of friction in these collisions; between two free bodies the smaller value applies;
        /// 0.5 by default. Friction with the material is in `contact`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(range(min = 0.0, max = 100.0))]
        friction: Option<f64>,
        /// Coefficient of restitution in these collisions; between two free bodies the smaller value applies;
        /// 0 by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(range(min = 0.0, max = 1.0))]
        restitution: Option<f64>,
        /// Table of its motion along the axes that `along` leaves out, and of its rotation about `axis` where
        /// `turns = false`: rows as with `kind = "table"`. A wheel that a vehicle drives is free along z
        /// alone. It is at rest there by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(length(max = 100_000))]
        rows: Option<Vec<Row>>,
        /// These rows from a file.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        record: Option<MotionRecord>,
    },
}

/// A motion over time from a file with columns separated by semicolons, tabs, commas or spaces. Lines that
/// start with # are comments, and the first line may hold the names of the columns. If its rows change, a
/// restart is refused.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionRecord {
    /// Name of the file, relative to the job file.
    pub file: String,
    /// Column of the times, s: its number, from 1, or its name in the first line; the first by default.
    #[serde(default = "first")]
    pub time: Column,
    /// Column of the displacement of the reference point along x, m: its number or name; 0 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<Column>,
    /// The same along y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<Column>,
    /// The same along z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-dimension" = 3))]
    pub z: Option<Column>,
    /// Column of the angle, degrees: its number or name; 0 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Column>,
    /// Factor for the displacements: 0.001 converts mm to m.
    #[serde(default = "one")]
    #[schemars(range(min = -1e12, max = 1e12))]
    pub scale: f64,
}

/// Inertia of a free body: a number, about a fixed axis, or three principal moments, kg m².
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Inertia {
    /// About a fixed axis, kg m².
    Axis(#[schemars(range(max = 1e30), extend("exclusiveMinimum" = 0.0))] f64),
    /// Principal moments, kg m².
    Principal(#[schemars(inner(range(min = 1e-30, max = 1e30)))] [f64; 3]),
}

/// A row of a table of motion.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Time, s.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub time: f64,
    /// Displacement of the reference point from its initial position, m; 0 by default.
    #[serde(default)]
    pub translation: Option<Vector>,
    /// Angle from the initial orientation, degrees, counter-clockwise seen against the axis; may exceed a
    /// full turn.
    #[serde(default)]
    #[schemars(range(min = -1e9, max = 1e9))]
    pub rotation: f64,
}
