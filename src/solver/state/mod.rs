//! The solver and what it owns.
//!
//! | file | what it holds |
//! |---|---|
//! | [`grid`] | plan, arenas, fields and exchanges of one tree and partition |
//! | `inside` | nodes inside colliders, and the surfaces that they are behind |
//! | `walls` | nodes near surfaces that hold material back |
//! | [`bookings`] | states and reactions of colliders; impulse and work of loads |
//! | [`leaf_data`] | data of each own leaf beside its particles |
//! | `node_fill` | how full nodes are |
//! | `regrid_cache` | data kept from one regrid to the next |
//! | [`cost`], `last_partition` | measured cost of leaves, and of the partition |
//! | [`relaxation`] | the way to equilibrium |
//! | [`phases`], [`regrid_timers`] | timers |
use partition::Forest;
use partition::comm::{Comm, Traffic};

use self::grid::Grid;
use super::migration::crossings::Crossings;
use super::migration::migrate::{MigrateError, Moved};
use super::sorting::bins::BinMissing;
use crate::adaptivity::resample::ledger::Ledger;
use crate::exact_sum::ExactSum;
use crate::material::SHOCK_SUMS;
use crate::particle::Chunk;
use crate::probe::{Maxima, Tracked};
use crate::quantity::{FACES, NotFinite};
use crate::solver::physics::Physics;
use crate::solver::state::bookings::{
    Contacts, ExactSums, FACE_SUMS, FAILED_SUMS, LOAD_SUMS, Near, ParticlePush, SOURCE_SUMS, SourcePush,
};
use crate::solver::state::cost::Costs;
use crate::solver::state::last_partition::LastPartition;
use crate::solver::state::leaf_data::LeafData;
use crate::solver::state::phases::Phases;
use crate::solver::state::regrid_cache::RegridCache;
use crate::solver::state::regrid_timers::RegridTimers;
use crate::solver::state::relaxation::Relaxation;

pub mod bookings;
pub mod cost;
pub mod grid;
pub(super) mod inside;
pub(super) mod last_partition;
pub mod leaf_data;
pub(super) mod node_fill;
pub mod phases;
pub(super) mod regrid_cache;
pub mod regrid_timers;
pub mod relaxation;
pub(super) mod walls;

/// Why a step failed on this rank.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// A particle left the domain or moved too far.
    #[error(transparent)]
    Migrate(#[from] MigrateError),
    /// A particle's box cannot be transferred.
    #[error(transparent)]
    Bin(#[from] BinMissing),
    /// A quantity of the job has no finite value.
    #[error(transparent)]
    Quantity(#[from] NotFinite),
    /// The time step is not a positive number.
    #[error("the time step became {dt} s; the run has become unstable")]
    TimeStep {
        /// The time step, s.
        dt: f64,
    },
    /// Forces of a load step do not balance.
    #[error(
        "no equilibrium at t = {to} s, in a load step of {dt} s, the shortest: after {newton} Newton and {linear} linear iterations {residual:.1e} of the forces were not balanced; expected loads that the material can bear, or a smaller quasi_static.min_step"
    )]
    NoBalance {
        /// Time at the end of the step, s.
        to: f64,
        /// Length of the step, s.
        dt: f64,
        /// Newton iterations.
        newton: u32,
        /// Iterations of linear systems.
        linear: u32,
        /// Unbalanced force over that of loads or stress.
        residual: f64,
    },
    /// Material of a quasi-static job has come to a face that only bears pressure.
    #[error(
        "material has reached the face boundaries.{}, which is separating; expected sticky, slip or symmetric faces where material rests in a quasi-static job", FACES[face / 2][face % 2]
    )]
    Face {
        /// The face: `2 axis`, one more for the upper.
        face: usize,
    },
    /// The time after the step is not finite, or no later than that before it.
    #[error("a step of {dt} s from t = {from} s would end at t = {to} s; expected a later, finite time")]
    Time {
        /// The time step, s.
        dt: f64,
        /// Time at its start, s.
        from: f64,
        /// Time at its end, s.
        to: f64,
    },
}

/// The state of a run between two steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clock {
    /// Steps done.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Length of the step done last, s; 0 before the first.
    pub dt: f64,
    /// Bound on the next step from the state of all particles, s.
    pub bound: f64,
}

/// How a load step went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effort {
    /// Newton iterations.
    pub newton: u32,
    /// Iterations of linear systems.
    pub linear: u32,
    /// Unbalanced force over that of loads or stress, whichever is greater.
    pub residual: f64,
    /// Attempts at the step that were given up.
    pub cuts: u32,
}

/// Results of a step, on this rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepReport {
    /// Particles that changed leaf.
    pub moved: Moved,
    /// Requests of all ranks together.
    pub granted: Requests,
    /// Whether the equilibrium is reached that the job asks for.
    pub settled: bool,
}

/// Requests of a rank to all ranks, after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Requests {
    /// Stop.
    pub stop: bool,
    /// Write a checkpoint.
    pub checkpoint: bool,
}

/// Mass of the particles, and on the real nodes, in one step, on one rank.
#[derive(Clone, Debug)]
pub(in crate::solver) struct Weighed {
    pub(in crate::solver) particles: ExactSum,
    pub(in crate::solver) nodes: ExactSum,
}

/// Particles, tree and clock of one rank, and the data to advance them.
pub struct Solver<const D: usize> {
    pub(super) comm: Comm,
    /// The problem.
    pub physics: Physics<D>,
    /// The distributed tree.
    pub forest: Forest<D>,
    /// Particles of each own leaf.
    pub chunks: Vec<Chunk<D>>,
    /// Step and time.
    pub clock: Clock,
    /// States of the colliders, and their reactions.
    pub contacts: Contacts<D>,
    /// Impulse of each load since the last row of the history, and its work since the start.
    pub load_sums: ExactSums<LOAD_SUMS>,
    /// Impulse on each face of the domain since the last row, kg m/s: lower and upper along each axis; empty
    /// if the job does not ask for them.
    pub face_sums: ExactSums<FACE_SUMS>,
    /// Impulse of each contact between bodies since the last row of the history, and its work since the
    /// start.
    pub body_sums: ExactSums<LOAD_SUMS>,
    /// Work of the shifts that keep fluids in their volume since the start, J; none without fluids.
    pub shift_sums: ExactSums<1>,
    /// Work of artificial viscosity since the start and the part of it that is heat of the material, J; none
    /// without.
    pub shock_sums: ExactSums<SHOCK_SUMS>,
    /// Mass, momentum and kinetic energy that sources have added since the start.
    pub source_sums: ExactSums<SOURCE_SUMS>,
    /// Particles that have failed and gone since the start, with what went with them; none where none can.
    pub failed_sums: ExactSums<FAILED_SUMS>,
    /// Mass, momentum and energy of the water that has come into pores since the start; none where ground
    /// weighs the same with and without it.
    pub pore_sums: ExactSums<SOURCE_SUMS>,
    /// Flow into the ground at each head that is held, and last through its surface, m³/s; none where no
    /// water seeps.
    pub flow_sums: ExactSums<1>,
    /// How often heads have been looked for in vain since the start of this process.
    pub unsettled_heads: u64,
    /// Particles that each source has fed on this rank since the start of this process, and those among them
    /// that entered where other material was.
    pub fed: Vec<[u64; 2]>,
    /// Impulse and work of sources on particles in their shapes in the last step, by own leaf; empty without
    /// sources.
    pub(super) conveyed: Vec<Vec<SourcePush<D>>>,
    /// Forces that particles carried in the last step, by own leaf; empty without such loads.
    pub(super) pushes: Vec<Vec<ParticlePush<D>>>,
    /// Particles near colliders that act on particles, by own leaf; empty without such colliders.
    pub(super) near: Vec<Vec<Near<D>>>,
    /// How the last load step went.
    pub effort: Effort,
    /// Length of the next load step, s, unless something is due earlier.
    pub(super) next_load_step: f64,
    /// Progress of kinetic damping towards equilibrium.
    pub relaxation: Relaxation,
    /// Kinetic energy (J) and mass (kg) of the nodes of this rank in the last step, in jobs that ask for
    /// equilibrium.
    pub(super) motion: [ExactSum; 3],
    /// Wall time by phase since the last report.
    pub phases: Phases,
    pub(super) grid: Grid<D>,
    /// Data of each own leaf.
    pub(super) leaf_data: LeafData<D>,
    /// Particles that crossed the faces of the domain so far.
    pub crossings: Crossings,
    /// Particles that are followed.
    pub tracked: Vec<Tracked<D>>,
    /// Largest values of maps so far; the same on all ranks.
    pub maxima: Vec<Maxima>,
    /// Splits and merges of particles so far.
    pub ledger: Ledger,
    /// Changes of the tree since the start of this process.
    pub regrids: u64,
    /// Wall time of the parts of regrids since the start of this process.
    pub regrid_timers: RegridTimers,
    /// Data kept from one regrid to the next; no bit of the state depends on it.
    pub(super) regrid_cache: RegridCache<D>,
    /// Messages and bytes that grids of earlier trees and partitions have sent.
    pub(super) sent_before: Traffic,
    /// Least bytes that the exchanged nodes need, in the last step that measured the mass error.
    pub(super) surface_bytes: u64,
    pub(super) costs: Costs,
    pub(super) partitioned: LastPartition,
    /// New partitions since the start of this process.
    pub partitions: u64,
    pub(super) is_to_weigh: bool,
    pub(super) weighed: Option<Weighed>,
    /// Whether boxes of any rank may have to be halved after this step.
    pub(super) has_wide: bool,
    /// In how many pieces each body was when the first particle was halved; empty where that is not known.
    pub pieces_before: Vec<u64>,
}
