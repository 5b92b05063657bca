//! The solver and what it owns.
//!
//! | file | what it holds |
//! |---|---|
//! | [`parts`] | sums, forces on particles, measures, equilibrium, adaptation, balance |
//! | [`grid`] | plan, velocity fields and exchanges of one tree and partition; nodes at surfaces |
//! | [`bookings`] | states and reactions of colliders; impulse and work of loads |
//! | [`leaf_data`] | data of each own leaf beside its particles |
//! | `regrid_cache` | data kept from one regrid to the next |
//! | [`cost`], `last_partition` | measured cost of leaves, and of the partition |
//! | [`relaxation`] | the way to equilibrium |
//! | [`phases`], [`regrid_timers`] | timers |
use partition::Forest;
use partition::comm::Comm;

use self::grid::Grid;
pub use self::parts::Effort;
pub(in crate::solver) use self::parts::Weighed;
use self::parts::{Adaptation, Balance, EquilibriumState, Measured, ParticleForces, Sums};
use super::migration::error::MigrateError;
use super::migration::migrate::Moved;
use super::sorting::box_widths::BinMissing;
use crate::particle::Chunk;
use crate::quantity::NotFinite;
use crate::solver::physics::Physics;
use crate::solver::state::bookings::Contacts;
use crate::solver::state::leaf_data::LeafData;
use crate::solver::state::phases::Phases;

pub mod bookings;
pub mod cost;
pub mod grid;
pub(super) mod last_partition;
pub mod leaf_data;
pub mod parts;
pub mod phases;
pub(super) mod regrid_cache;
pub mod regrid_timers;
pub mod relaxation;

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
        "no equilibrium at t = {to} s, in a load step of {dt} s, the shortest: after {newton} Newton and {linear} linear iterations {residual:.1e} of the forces were not balanced, most at {}{}; expected loads that the material can bear, or a smaller quasi_static.min_step",
        crate::text::place(place),
        if *slides { ", and material slides wherever friction should hold it" } else { "" }
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
        /// Where most of it is, in the coordinates of the job, m.
        place: Vec<f64>,
        /// Whether material slides wherever friction should hold it.
        slides: bool,
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
    /// Impulses, work and masses summed for the history.
    pub sums: Sums,
    /// Forces on particles themselves in the last step.
    pub(super) particle_forces: ParticleForces<D>,
    /// The way to equilibrium.
    pub equilibrium: EquilibriumState,
    /// Wall time by phase since the last report.
    pub phases: Phases,
    pub(super) grid: Grid<D>,
    /// Data of each own leaf.
    pub(super) leaf_data: LeafData<D>,
    /// Measures that go on over the run.
    pub measured: Measured<D>,
    /// Changes of the tree, and of particles with it.
    pub adaptation: Adaptation<D>,
    /// Measured work and traffic, and what follows for the partition.
    pub balance: Balance,
}
