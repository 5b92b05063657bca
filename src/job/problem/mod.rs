//! A job that has been checked, typed by its dimension.
//!
//! All positions are relative to the lower corner of the domain; only output adds
//! [`Problem::origin`]. All quantities are in SI units.
//!
//! | module | |
//! |---|---|
//! | `body` | bodies, their materials and their stress at the start |
//! | `stage` | stages, and when something acts |
//! | `output` | time steps, output, checkpoints, reports |
use crate::adaptivity::{Adaptivity, least_level};
use crate::boundary::BodyContacts;
use crate::boundary::Collider;
use crate::boundary::absorbing::AbsorbingFaces;
pub use crate::boundary::{Contact, Leaving as LeavingPolicy};
use crate::geometry::{Aabb, Shape};
pub use crate::io::snapshot::PointField as Field;
use crate::job::parse::error::Position;
pub use crate::kernel::{BoxPolicy, Coordinates, Transfer};
use crate::load::{Gravity, Load, Seepage, Water};
use crate::material::Viscosity;
use crate::probe::{Flux, Line, Map, Probe, Track};
use crate::quantity::in_job;
use crate::solver::{QuasiStatic, Ties};
use crate::source::Source;
use partition::{Brick, Octant};
use std::path::PathBuf;
use std::sync::OnceLock;

mod body;
mod output;
mod stage;

pub use body::{Body, InitialStress, MaterialSetup, StressKind};
pub use output::{CheckpointSetup, OutputSetup, TimeSetup};
pub use stage::{FactorSearch, InStages, Stage};

/// Cells along the edge of a leaf.
pub const CELLS_PER_LEAF: u32 = 4;

/// Particles along the edge of a leaf. Where this is a whole number, the box of each lies in one leaf.
pub fn particles_per_leaf(particles_per_cell: f64) -> f64 {
    f64::from(CELLS_PER_LEAF) * particles_per_cell
}

/// A checked job of either dimension.
#[derive(Clone, Debug)]
pub enum AnyProblem {
    /// Plane strain.
    Two(Problem<2>),
    /// Three dimensions.
    Three(Problem<3>),
}

impl AnyProblem {
    /// See [`Problem::digest`].
    pub fn digest(&self) -> u64 {
        match self {
            Self::Two(problem) => problem.digest,
            Self::Three(problem) => problem.digest,
        }
    }

    /// End of the run, s.
    pub fn end(&self) -> f64 {
        match self {
            Self::Two(problem) => problem.time.end,
            Self::Three(problem) => problem.time.end,
        }
    }

    /// Name of the job.
    pub fn name(&self) -> &str {
        match self {
            Self::Two(problem) => &problem.name,
            Self::Three(problem) => &problem.name,
        }
    }

    /// Outputs of the run, and their directory.
    pub fn output(&self) -> &OutputSetup {
        match self {
            Self::Two(problem) => &problem.output,
            Self::Three(problem) => &problem.output,
        }
    }
}

impl TryFrom<AnyProblem> for Problem<2> {
    type Error = Box<Problem<3>>;

    /// The problem, if it is one of plane strain.
    fn try_from(problem: AnyProblem) -> Result<Self, Self::Error> {
        match problem {
            AnyProblem::Two(problem) => Ok(problem),
            AnyProblem::Three(problem) => Err(problem.into()),
        }
    }
}

impl TryFrom<AnyProblem> for Problem<3> {
    type Error = Box<Problem<2>>;

    /// The problem, if it is one in space.
    fn try_from(problem: AnyProblem) -> Result<Self, Self::Error> {
        match problem {
            AnyProblem::Two(problem) => Err(problem.into()),
            AnyProblem::Three(problem) => Ok(problem),
        }
    }
}

/// A checked job in `D` dimensions.
#[derive(Clone, Debug)]
pub struct Problem<const D: usize> {
    /// Name of the job: the stem of its file; prefix of output files.
    pub name: String,
    /// The job file, as given; for messages.
    pub path: PathBuf,
    /// Text of the job file.
    pub text: String,
    /// Title for people; may be empty.
    pub title: String,
    /// Checksum of everything that changes the state (not of outputs, checkpoints or the end time).
    pub digest: u64,
    /// Lower corner of the domain, m.
    pub origin: [f64; D],
    /// Edge of a root octant, m.
    pub root_edge: f64,
    /// Root octants along each axis.
    pub brick: Brick<D>,
    /// Levels of the tree.
    pub tree: TreeSetup<D>,
    /// Dynamic refinement, if wanted.
    pub adaptivity: Option<Adaptivity<D>>,
    /// Materials.
    pub materials: Vec<MaterialSetup>,
    /// Bodies, in the order of the job file; then those of the sources.
    pub bodies: Vec<Body<D>>,
    /// Sources, in the order of the job file.
    pub sources: Vec<Source<D>>,
    /// Acceleration of gravity.
    pub gravity: Gravity<D>,
    /// Loads, in the order in which they act; last the water in the pores.
    pub loads: Vec<Load<D>>,
    /// Place of each load in the files of the job, for messages.
    pub load_places: Vec<Position>,
    /// Steady seepage, if the pressure of the water in the pores is that of one.
    pub seepage: Option<Seepage<D>>,
    /// Conditions on the lower and the upper face of the domain along each axis.
    pub faces: [[Contact; 2]; D],
    /// Material beyond the faces that absorb waves.
    pub absorbing: AbsorbingFaces<D>,
    /// Which of them the job names; the others have the default.
    pub named_faces: [[bool; 2]; D],
    /// Rigid bodies that act on the material, in the order in which they act.
    pub colliders: Vec<Collider<D>>,
    /// Whether each is thick enough to hold fluids at nodes, once that has been asked (`setup::walls`).
    pub thick: OnceLock<Vec<bool>>,
    /// Contact between bodies that deform.
    pub body_contacts: BodyContacts,
    /// Stages of the run, at least one.
    pub stages: Vec<Stage<D>>,
    /// Stages in which each load acts.
    pub load_stages: Vec<InStages>,
    /// Stages in which each collider is there.
    pub collider_stages: Vec<InStages>,
    /// Stages in which each source feeds.
    pub source_stages: Vec<InStages>,
    /// Treatment of particles that leave the domain.
    pub leaving: LeavingPolicy,
    /// End and time step.
    pub time: TimeSetup,
    /// Transfer of velocity between particles and grid.
    pub transfer: Transfer,
    /// Coordinates of the domain.
    pub coordinates: Coordinates,
    /// How particle boxes follow the deformation.
    pub boxes: BoxPolicy,
    /// Whether particles strain with the mean rate of dilation of their cell (F-bar).
    pub f_bar: bool,
    /// Artificial viscosity, if there is any.
    pub viscosity: Option<Viscosity>,
    /// Load steps in place of time steps; `None`: none.
    pub quasi_static: Option<QuasiStatic>,
    /// Velocity fields whose surface nodes are tied.
    pub ties: Ties,
    /// Output files.
    pub output: OutputSetup,
    /// Checkpoints.
    pub checkpoint: CheckpointSetup,
    /// Steps between rows of `history.csv`.
    pub history_every: u64,
    /// Whether it has the forces on the faces of the domain.
    pub face_forces: bool,
    /// Measurements of the material.
    pub probes: Vec<Probe<D>>,
    /// Particles that the history follows.
    pub tracks: Vec<Track<D>>,
    /// Sections through which passing mass is counted.
    pub fluxes: Vec<Flux>,
    /// Lines with tables of their own, with rows at those of the history.
    pub lines: Vec<Line<D>>,
    /// Rasters with the largest depths and speeds.
    pub maps: Vec<Map>,
    /// Steps between lines of `telemetry.jsonl`.
    pub telemetry_every: u64,
}

impl<const D: usize> Problem<D> {
    /// Edge lengths of the domain, m.
    pub fn size(&self) -> [f64; D] {
        self.brick.roots.map(|n| f64::from(n) * self.root_edge)
    }

    /// Edge of a leaf of this level, m. Exact: a division by a power of two.
    pub fn leaf_edge(&self, level: u8) -> f64 {
        self.root_edge / f64::from(1_u32 << level)
    }

    /// Edge of a cell of this level, m.
    pub fn cell_edge(&self, level: u8) -> f64 {
        self.leaf_edge(level) / f64::from(CELLS_PER_LEAF)
    }

    /// The box that an octant covers.
    pub fn octant_box(&self, octant: &Octant<D>) -> Aabb<D> {
        let edge = self.leaf_edge(octant.level);
        Aabb::new(octant.coord.map(|c| f64::from(c) * edge), octant.coord.map(|c| f64::from(c + 1) * edge))
    }

    /// A point in the coordinates of the job, m, with z = 0 in plane strain: the argument of quantities.
    pub fn place(&self, x: &[f64; D]) -> [f64; 3] {
        in_job(&self.origin, x)
    }

    /// The water in the pores, if the job has any.
    pub fn water(&self) -> Option<&Water> {
        self.loads.iter().find_map(Load::water)
    }

    /// The water in the pores, if there is any in a stage.
    pub fn water_of_stage(&self, stage: usize) -> Option<&Water> {
        let mut loads = self.loads.iter().zip(&self.load_stages);
        loads.find_map(|(load, stages)| load.water().filter(|_| stages.has(stage)))
    }

    /// Whether a stage looks for a factor of safety.
    pub fn has_reduction(&self) -> bool {
        self.stages.iter().any(|stage| stage.reduction.is_some())
    }

    /// Whether stages or the run end at an equilibrium.
    pub fn has_equilibrium(&self) -> bool {
        self.stages.iter().any(|stage| stage.equilibrium.is_some())
    }

    /// Bodies that come with a stage, in the order of the job.
    pub fn bodies_of_stage(&self, stage: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.bodies.len())
            .filter(move |&body| self.bodies[body].fed.is_none() && self.bodies[body].stage == stage)
    }

    /// Whether two bodies with shapes of their own come with the same stage, or their sources feed at the
    /// same time. The place of earlier bodies by then is not that of their shapes.
    pub fn come_together(&self, first: usize, second: usize) -> bool {
        let [first, second] = [first, second].map(|body| &self.bodies[body]);
        if first.given.is_some() || second.given.is_some() {
            return false;
        }
        let begins = |source: usize| self.source_stages[source].has(0) && self.sources[source].from == 0.0;
        match (first.fed, second.fed) {
            (None, None) => first.stage == second.stage,
            (Some(source), None) => second.stage == 0 && begins(source),
            (None, Some(source)) => first.stage == 0 && begins(source),
            (Some(first), Some(second)) => {
                let spans = [first, second].map(|source| {
                    let source = &self.sources[source];
                    [
                        source.from,
                        (source.total as f64 / source.entries.len() as f64)
                            .mul_add(source.period, source.from),
                    ]
                });
                self.source_stages[first] == self.source_stages[second]
                    && spans[0][0] < spans[1][1]
                    && spans[1][0] < spans[0][1]
            }
        }
    }

    /// The key of a body in the job: `bodies[0]`, or `sources[0]` for that of a source.
    pub fn key_of_body(&self, body: usize) -> String {
        match self.bodies[body].fed {
            Some(source) => format!("sources[{source}]"),
            None => format!("bodies[{body}]"),
        }
    }

    /// Particles of the body of a source, if it is one, by the end of the run; those of the longest run where
    /// stages decide when it feeds.
    pub fn fed_by_end(&self, body: usize) -> u64 {
        self.bodies[body].fed.map_or(0, |source| self.sources[source].particles_before(self.time.end))
    }

    /// Gravity of a stage, its time counted from the start of the stage that has set it.
    pub fn gravity_of_stage(&self, stage: usize) -> &Gravity<D> {
        let mut changes = self.stages[..=stage].iter().rev().filter_map(|stage| stage.gravity.as_ref());
        changes.next().unwrap_or(&self.gravity)
    }

    /// The finest level that the job asks for.
    pub fn finest_level(&self) -> u8 {
        self.tree.regions.iter().map(|region| region.level).fold(self.tree.base_level, u8::max)
    }

    /// The finest level that the job asks for or a criterion of refinement may.
    pub fn finest_level_refined(&self) -> u8 {
        let refined = self.adaptivity.as_ref().map_or(0, Adaptivity::finest_level);
        self.finest_level().max(refined)
    }

    /// True when the job asks for a finer leaf: a region that it crosses or lies in asks for a deeper level.
    pub fn wants_refinement(&self, octant: &Octant<D>) -> bool {
        let regions = self.tree.regions.iter().map(|region| (&region.shape, region.level));
        octant.level < least_level(self.tree.base_level, regions, &self.octant_box(octant))
    }
}

/// Levels of the tree at the start.
#[derive(Clone, Debug)]
pub struct TreeSetup<const D: usize> {
    /// Level of all leaves outside the regions.
    pub base_level: u8,
    /// Whether neighbours may differ by one level at most, over faces, edges and corners.
    pub graded: bool,
    /// Regions with a deeper level; a leaf is split while it intersects one whose level it has not reached.
    pub regions: Vec<Region<D>>,
}

/// A region of given refinement.
#[derive(Clone, Debug)]
pub struct Region<const D: usize> {
    /// Where.
    pub shape: Shape<D>,
    /// Level that leaves have there at least.
    pub level: u8,
}
