//! The job file as it is written: the types that parse it and from which its JSON schema is made.
//!
//! The comments here are the descriptions in the schema and in error messages, so each says its unit.
pub use super::adaptivity::Adaptivity;
pub use super::common::Spin;
use super::common::{two, yes};
pub use super::conditions::boundaries::{Boundaries, Face, Leaving};
pub use super::conditions::colliders::Collider;
pub use super::conditions::contact::BodyContact;
pub use super::conditions::loads::{Load, Quantity};
pub use super::conditions::sources::Source;
pub use super::conditions::stress::Stress;
pub use super::conditions::water::Water;
pub use super::equilibrium::Equilibrium;
pub use super::output::{Checkpoint, History, Output, Telemetry};
pub use super::probes::{Flux, Line, Map, Probe, Track};
pub use super::stages::Stage;
use crate::geometry::written::Shape;
pub use crate::geometry::written::Vector;
use crate::material::parameters::Parameters;
use crate::material::undrained::Undrained;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Version of the job file format that this program reads.
pub const VERSION: u32 = 1;

/// A job of agimp. All quantities are in SI units.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "agimp job")]
pub struct JobFile {
    /// Version of the job file format; 1.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// TOML files that are part of the job, relative to the job file. Their tables are merged with those of
    /// the job, and elements of arrays such as `[[materials]]` follow those of the job. Each key may occur
    /// once. Included files may include others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 64))]
    pub include: Vec<String>,
    /// Title, shown in pictures and reports.
    #[serde(default)]
    pub title: String,
    /// Dimension: 2 for plane strain (one metre thick) or, with `geometry`, bodies of revolution; 3 for
    /// space.
    #[schemars(range(min = 2, max = 3))]
    pub dimension: u32,
    /// Geometry of a job with `dimension = 2`; plane strain by default. With "axisymmetric" bodies are
    /// those of revolution about x = 0: x is the radius, y the height, and component zz that along the hoop.
    /// Masses, volumes, forces, energies and fluxes are then those of the whole circumference, on input and
    /// output; a force or momentum along x is the sum of the radial components.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub geometry: Option<Geometry>,
    /// Components of the acceleration of gravity, m/s², as many as the job has dimensions; each a number, an
    /// expression in t, or a table over time. None by default.
    #[serde(default)]
    #[schemars(length(min = 2, max = 3))]
    pub gravity: Option<Vec<Quantity>>,
    /// The computational domain.
    pub domain: Domain,
    /// Conditions on the faces of the domain.
    #[serde(default)]
    pub boundaries: Boundaries,
    /// Levels of the tree.
    #[serde(default)]
    pub tree: Tree,
    /// Dynamic refinement; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adaptivity: Option<Adaptivity>,
    /// Materials.
    #[schemars(length(max = 65_535))]
    pub materials: Vec<Material>,
    /// Bodies; none in a job with sources alone.
    #[serde(default)]
    #[schemars(length(max = 65_535))]
    pub bodies: Vec<Body>,
    /// Sources: material that enters during the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 12))]
    pub sources: Vec<Source>,
    /// Loads, in the order in which they act.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Load>,
    /// Water in the pores of all material, with a given pressure; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water: Option<Water>,
    /// Rigid bodies that act on the material, in the order in which they act; the faces of the domain act
    /// last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub colliders: Vec<Collider>,
    /// Contact between bodies that deform; all bodies stick where they touch by default.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 25))]
    pub contact: Vec<BodyContact>,
    /// End of the run and time step.
    pub time: Time,
    /// Run to equilibrium; none by default. In a job with stages, set it in the stages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub equilibrium: Option<Equilibrium>,
    /// Load steps to equilibrium in place of time steps; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quasi_static: Option<QuasiStatic>,
    /// Stages of the run; one without changes by default.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 20))]
    pub stages: Vec<Stage>,
    /// Numerical method.
    #[serde(default)]
    pub numerics: Numerics,
    /// Output files.
    #[serde(default)]
    pub output: Output,
    /// Checkpoints.
    #[serde(default)]
    pub checkpoint: Checkpoint,
    /// Table of scalars, `history.csv`.
    #[serde(default)]
    pub history: History,
    /// Measurements of the material, columns of `history.csv`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 1000))]
    pub probes: Vec<Probe>,
    /// Tracked particles, columns of `history.csv`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 100))]
    pub tracks: Vec<Track>,
    /// Mass flow through planes or faces, columns of `history.csv`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 20))]
    pub fluxes: Vec<Flux>,
    /// Lines at whose points the material is shown, each with a table of its own, `JOB.line_NAME.csv`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 100))]
    pub lines: Vec<Line>,
    /// Rasters in plan view with the largest depth and speed during the run, ESRI ASCII grids.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 20))]
    pub maps: Vec<Map>,
    /// Performance of the run, `telemetry.jsonl`.
    #[serde(default)]
    pub telemetry: Telemetry,
}

impl JobFile {
    /// Names of all bodies by their numbers: those of the job, then those of its sources.
    pub fn body_names(&self) -> Vec<&str> {
        let bodies = self.bodies.iter().map(|body| body.name.as_str());
        bodies.chain(self.sources.iter().map(|source| source.name.as_str())).collect()
    }
}

/// Geometry of a job with `dimension = 2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// Plane strain, one metre thick.
    PlaneStrain,
    /// Bodies of revolution: x is the radius, y the height.
    Axisymmetric,
}

/// The computational domain: a box of cubic root octants.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Lower corner, m; the coordinate origin by default.
    #[serde(default)]
    pub min: Option<Vector>,
    /// Edge lengths, m; 1 to 64 times the root edge, whole multiples of it.
    pub size: Vector,
    /// Edge of a root octant (level 0), m. A leaf of level L has the edge `root_edge / 2^L` and 4 cells
    /// along it. A domain has at most 64 root octants along each axis: for finer cells in a large domain, a
    /// greater root edge and a higher `tree.base_level` give the same cells.
    #[schemars(range(min = 1e-9, max = 1e7))]
    pub root_edge: f64,
}

/// Levels of the tree.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tree {
    /// Level of all leaves outside the regions.
    #[serde(default)]
    #[schemars(range(max = 15))]
    pub base_level: u8,
    /// Whether neighbouring leaves (across faces, edges and corners) differ by at most one level.
    #[serde(default = "yes")]
    pub graded: bool,
    /// Regions with finer cells. Particles split where they come into them.
    #[serde(default)]
    pub regions: Vec<Region>,
}

impl Default for Tree {
    fn default() -> Self {
        Self { base_level: 0, graded: true, regions: Vec::new() }
    }
}

/// A region with finer cells: every leaf that intersects it is refined to this level.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Where.
    pub shape: Shape,
    /// Level of the leaves there; above `base_level`.
    #[schemars(range(max = 15))]
    pub level: u8,
}

/// A material: a name, a density, a model and the model's parameters.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Material {
    /// Name, by which bodies refer to it.
    pub name: String,
    /// Density of the undeformed material, kg/m³.
    #[schemars(range(min = 1e-6, max = 1e5))]
    pub density: f64,
    /// Density of the undeformed material with full pores, kg/m³, for what lies below the table of `[water]`:
    /// weight and inertia change as the table moves. `density` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-6, max = 1e5))]
    pub saturated_density: Option<f64>,
    /// Permeability to water, m/s: the flow per area under a gradient of the head of 1. Needed, and used,
    /// with `seepage` in `[water]` only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-20, max = 1e3))]
    pub permeability: Option<f64>,
    /// Divides the strength, to find a factor of safety: cohesion, yield stress and their hardening, and the
    /// tangents of friction angles, of `mohr_coulomb`, `drucker_prager`, `tresca` and `von_mises`; the
    /// dilation angle is at most the new friction angle. 1 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 100.0))]
    pub strength_factor: Option<f64>,
    /// Water in the pores that cannot leave, for solid models: the model sees the effective stress, and the
    /// water has the excess pressure `-(bulk_modulus / porosity) ln J` with the volume ratio J since the
    /// start, or since the stress that the body starts with. `density` is that of skeleton and water. By
    /// default there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undrained: Option<Undrained>,
    /// Fate of particles that fail, of materials with `damage`: by default they stay, with what their law
    /// leaves them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<Failed>,
    /// Constitutive model and its parameters.
    #[serde(flatten)]
    pub model: Parameters,
}

/// Fate of particles that have failed: those of `von_mises` with a damage of 0.99 of strength, those of
/// `hencky` with a hundredth of their strength left. How many they are, and the mass, momentum and energy
/// that go with them, are columns of `history.csv`: `failed`, `failed_mass`, `failed_x` and so on,
/// `failed_kinetic_energy`, `failed_elastic_energy`, `failed_gravitational_energy`, `failed_plastic_work`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Failed {
    /// They stay, with what their law leaves them: pressure alone in `von_mises`.
    Stays,
    /// They are deleted, with the loads that they carry.
    Delete,
    /// They become another material of the job, of this name, a solid of the same density, such as sand:
    /// rubble. Mass, velocity and volume stay; shear stress goes, and the pressure is that of the volume in
    /// the new material. Bodies of `stages` that change their material do not change that of their rubble.
    Material(
        /// Name of the material.
        String,
    ),
}

/// A body: a shape filled with particles of a material.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name.
    pub name: String,
    /// Name of its material.
    pub material: String,
    /// Region that it fills. Unbounded shapes end at the faces of the domain.
    pub shape: Shape,
    /// Particles per cell along each axis, on a lattice through the whole domain; need not be whole.
    #[serde(default = "two")]
    #[schemars(range(min = 0.5, max = 8.0))]
    pub particles_per_cell: f64,
    /// How particles lie. By default on the lattice; bodies of elastic material, metal and clay whose surface
    /// lies off it have a lattice of their own, if whole boxes fill them on cells of one size, else they are
    /// `fitted`, if `particles_per_cell` is a multiple of 0.25 (inclined plane faces in jobs with
    /// `[[contact]]` only).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
    /// Number that chooses one of many arrangements of `jittered` and `poisson`; 0 by default. Runs that
    /// differ in it alone show by how much a result depends on where particles lie.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1_000_000_000))]
    pub seed: Option<u32>,
    /// Components of the velocity, m/s, as many as the job has dimensions; each a number or an expression in
    /// x, y, z. At rest by default.
    #[serde(default)]
    #[schemars(length(min = 2, max = 3))]
    pub velocity: Option<Vec<Quantity>>,
    /// Angular velocity about the centre of the body's bounding box, rad/s: three components in 3D, one
    /// number in 2D (about z, counter-clockwise).
    #[serde(default)]
    pub angular_velocity: Option<Spin>,
    /// Name of the stage at whose start it comes, into the cells that the tree then has; it is there from the
    /// start by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    /// Stress at the start; none by default. With it, `density` is the initial density of the body, under
    /// this stress.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<Stress>,
}

/// How the particles of a body lie. Every point of the lattice in the body has one particle; with `fitted`,
/// every box of it that the body fills to a tenth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// On the lattice: exact for uniform states, but material that flows shows its planes.
    Lattice,
    /// On the lattice, and where the surface of the body cuts a box of it, with the volume, the mass and the
    /// centroid of the part of the body in the box: the masses and the frequencies of curved bodies are
    /// right. In 2D such boxes have half the edge, but in sand and snow. `particles_per_cell` is a multiple
    /// of 0.25.
    Fitted,
    /// At random, by at most 0.35 of their distance from the points of the lattice along each axis.
    Jittered,
    /// As blue noise: apart from each other by about their distance, without order. `particles_per_cell` is a
    /// multiple of 0.25.
    Poisson,
}

/// End of the run and time step.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// End of the run, s. It ends with the first step that reaches this time.
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub end: f64,
    /// Courant number: the part of a cell that the fastest wave may cross in one step.
    #[serde(default = "default_cfl")]
    #[schemars(range(min = 1e-3, max = 1.0))]
    pub cfl: f64,
    /// Longest time step, s; unlimited by default.
    #[serde(default)]
    #[schemars(range(min = 1e-15, max = 1e12))]
    pub dt_max: Option<f64>,
    /// Most that a time step may exceed the one before it, as a factor.
    #[serde(default = "default_growth")]
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 1.0))]
    pub growth: f64,
}

fn default_cfl() -> f64 {
    0.4
}

fn default_growth() -> f64 {
    1.1
}

/// Load steps: at the end of each, the forces on all nodes balance (Newton's method). Velocities are 0, and
/// the time of the job orders loads and motions. Steps end where an output, a stage or the run does.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuasiStatic {
    /// Longest load step, s; also the first. Steps become shorter where the iteration fails, and longer again
    /// after.
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub step: f64,
    /// Shortest load step, s: one that fails ends the run; `step / 1024` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub min_step: Option<f64>,
    /// Bound on the unbalanced force, over the force of loads or of stress, whichever is greater (norms over
    /// all nodes).
    #[serde(default = "default_tolerance")]
    #[schemars(range(max = 0.1), extend("exclusiveMinimum" = 1e-12))]
    pub tolerance: f64,
}

fn default_tolerance() -> f64 {
    1e-6
}

/// Numerical method.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Numerics {
    /// Transfer of velocity between particles and grid.
    #[serde(default)]
    pub transfer: Transfer,
    /// Share of FLIP for `transfer = "flip"`: 1 is pure FLIP, 0 pure PIC; 0.99 by default.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub flip: Option<f64>,
    /// Order for `transfer = "xpic"`: 1 is PIC, high orders approach FLIP; 2 by default. Each order above
    /// the first costs one more sweep between particles and nodes with one more exchange between ranks.
    #[serde(default)]
    #[schemars(range(min = 1, max = 16))]
    pub xpic_order: Option<u32>,
    /// How the box of a particle follows its deformation.
    #[serde(default)]
    pub boxes: Boxes,
    /// Bounds of half width over undeformed half width for `boxes = "volume"`; [0.25, 2] by default. The
    /// upper one is for materials that flow: particles of elastic ones become two along an axis where their
    /// box is 0.6 cells wide.
    #[serde(default)]
    #[schemars(inner(range(min = 0.0, max = 8.0)))]
    pub box_stretch: Option<[f64; 2]>,
    /// Whether the particles of a cell share one rate of dilation, the mean over those of their material
    /// (F-bar). For plastic flow that keeps the volume, which is too stiff without; a step costs up to half
    /// as much again. Off by default.
    #[serde(default)]
    pub f_bar: bool,
    /// Whether nodes at the surface that belong to no cell at least half full move with the plane through the
    /// corners of the nearest such cell. Left free, they take the stress of the outermost particles, and bent
    /// bodies are too soft. By default those of elastic bodies, metals and clay do, in plane strain and in
    /// space, if `[[contact]]` parts them from sand, snow and fluids.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tied_surfaces: Option<bool>,
    /// Artificial viscosity against compression that is too quick for the cells (von Neumann and Richtmyer
    /// 1950): without, shocks ring, and gas behind them is too cold. Off by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub artificial_viscosity: Option<ArtificialViscosity>,
}

/// Artificial viscosity: where material is compressed at the rate `d = -tr D > 0`, its pressure is
/// greater by `density h d (quadratic h d + linear c)`, with cells of edge h and waves of speed c.
/// `viscous_work` of `history.csv` is its work since the start, J, and `viscous_heat` the part of it that is
/// in `elastic_energy`: that in gas, in explosives that burn or have burned, and in metal with `eos`, which
/// it heats.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArtificialViscosity {
    /// Coefficient of the wave speed; damps the ringing behind shocks.
    #[serde(default = "half")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub linear: f64,
    /// Coefficient of the difference of velocity over a cell; makes strong shocks a few cells wide.
    #[serde(default = "four")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub quadratic: f64,
}

fn half() -> f64 {
    0.5
}

fn four() -> f64 {
    4.0
}

/// Transfer of velocity between particles and grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Transfer {
    /// Affine particle-in-cell.
    #[default]
    Apic,
    /// Blend of FLIP and PIC.
    Flip,
    /// Taylor particle-in-cell.
    Tpic,
    /// Extended particle-in-cell of order `xpic_order`.
    Xpic,
}

/// How the box of a particle follows its deformation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Boxes {
    /// Half widths follow the stretch along each axis, within bounds.
    #[default]
    Volume,
    /// Half widths never change.
    Fixed,
    /// One cell of the particle's own level.
    Cell,
}
