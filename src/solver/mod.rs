//! The time integration: one explicit step of the adaptive material point method.
//!
//! [`Solver::step`] is the method; the rooms beside it hold its phases.
//!
//! | room | what it holds, from the bottom up |
//! |---|---|
//! | [`sorting`] | particles into bins |
//! | [`migration`] | particles between leaves and ranks |
//! | [`step`] | phases of a step |
//! | [`refinement`] | the tree follows the material |
//! | [`balance`] | load balance: measured costs, new partitions |
//! | [`diagnostics`] | totals; weights of given boxes |
pub mod balance;
pub mod diagnostics;
pub mod migration;
pub mod refinement;
pub mod sorting;
pub mod step;

use partition::Forest;
use partition::comm::{Comm, Disagreement, Traffic};

use self::balance::cost::Costs;
use self::balance::rebalance::LastPartition;
use self::diagnostics::totals::Weighed;
use self::migration::migrate::{MigrateError, Moved};
use self::refinement::regrid::Recall;
use self::refinement::resample::Books;
use self::sorting::bins::BinMissing;
use self::step::contact::Contacts;
use self::step::grid::Grid;
use self::step::loads::LoadBooks;
use self::step::parts::Parts;
use self::step::phases::{Phase, Phases, thread_time};
use self::step::survey::Survey;
use self::step::time_step::StepControl;
use crate::adaptivity::Adaptivity;
use crate::boundary::{Collider, FaceCondition, Leaving};
use crate::grid::arenas::waves;
use crate::kernel::{BoxPolicy, Transfer};
use crate::load::{Gravity, Load};
use crate::material::Material;
use crate::particle::Chunk;
use crate::particle::chunk::Place;

/// What is solved: the same on every rank, constant over a run.
pub struct Physics<const D: usize> {
    /// Edge of a root octant, m.
    pub root_edge: f64,
    /// Whether neighbouring leaves differ by one level at most.
    pub graded: bool,
    /// Materials by index.
    pub materials: Vec<Box<dyn Material>>,
    /// Acceleration of gravity.
    pub gravity: Gravity<D>,
    /// Loads, in the order in which they act.
    pub loads: Vec<Load<D>>,
    /// Conditions on the lower and upper face of the domain along each axis.
    pub faces: [[FaceCondition; 2]; D],
    /// Rigid bodies that act on the material, in the order in which they act.
    pub colliders: Vec<Collider<D>>,
    /// Dynamic refinement; `None`: tree and particles keep their sizes.
    pub adaptivity: Option<Adaptivity<D>>,
    /// What happens to particles that leave the domain.
    pub leaving: Leaving,
    /// Transfer of velocities.
    pub transfer: Transfer,
    /// How particle boxes follow the deformation.
    pub boxes: BoxPolicy,
    /// Choice of the time step.
    pub control: StepControl,
}

/// Why a step failed on this rank.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// A particle left the domain or moved too far.
    #[error(transparent)]
    Migrate(#[from] MigrateError),
    /// A particle's box cannot be transferred.
    #[error(transparent)]
    Bin(#[from] BinMissing),
    /// The time step is not a positive number.
    #[error("the time step became {dt} s; the run has become unstable")]
    TimeStep {
        /// The time step, s.
        dt: f64,
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

/// What a step did on this rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepReport {
    /// Particles that changed leaf.
    pub moved: Moved,
    /// What any rank asked for.
    pub granted: Requests,
}

/// What a rank wants all ranks to do after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Requests {
    /// Stop.
    pub stop: bool,
    /// Write a checkpoint.
    pub checkpoint: bool,
}

/// Particles, tree and clock of one rank, and what advances them.
pub struct Solver<const D: usize> {
    comm: Comm,
    /// What is solved.
    pub physics: Physics<D>,
    /// The distributed tree.
    pub forest: Forest<D>,
    /// Particles of each own leaf.
    pub chunks: Vec<Chunk<D>>,
    /// Step and time.
    pub clock: Clock,
    /// Where the colliders are, and their reactions.
    pub contacts: Contacts<D>,
    /// What is booked of the loads.
    pub load_books: LoadBooks,
    /// Wall time by phase since the last report.
    pub phases: Phases,
    grid: Grid<D>,
    /// Per own leaf, the greatest sum of wave speed and particle speed after the last step, m/s.
    signal: Vec<f64>,
    /// Particles that this rank deleted because they left the domain.
    pub deleted: u64,
    /// Splits and merges of particles so far.
    pub books: Books,
    /// Changes of the tree since the start of this process.
    pub regrids: u64,
    /// Where the time of regrids went since the start of this process.
    pub parts: Parts,
    /// What was noted of each own leaf in the last step.
    surveys: Vec<Survey<D>>,
    /// Where the columns of each own leaf were at the start of the last G2P.
    places: Vec<Place>,
    /// What regrids remember; nothing that a bit depends on.
    recall: Recall<D>,
    /// What grids of earlier trees and partitions have sent.
    sent_before: Traffic,
    /// Bytes of the last exchange of arenas.
    arena_bytes: u64,
    /// Least bytes that these nodes need, as of the last step that was weighed.
    surface_bytes: u64,
    costs: Costs,
    partitioned: LastPartition,
    /// New partitions since the start of this process.
    pub partitions: u64,
    is_to_weigh: bool,
    weighed: Option<Weighed>,
}

impl<const D: usize> Solver<D> {
    /// Collective. A solver for particles that lie in their leaves (`chunks[i]` in leaf `i`). For a state read
    /// from a file `clock` is that of the file; for a new run it is the default.
    pub fn new(
        comm: &Comm,
        physics: Physics<D>,
        forest: Forest<D>,
        chunks: Vec<Chunk<D>>,
        clock: Clock,
    ) -> Self {
        let start = thread_time();
        let grid = Grid::build(comm, &forest, &physics, 0);
        let partitioned = LastPartition::at_start(start);
        let mut solver = Self {
            comm: comm.clone(),
            signal: vec![0.0; chunks.len()],
            contacts: Contacts::new(&physics, clock.time),
            load_books: LoadBooks::new(physics.loads.len(), clock.time),
            physics,
            forest,
            chunks,
            clock,
            phases: Phases::default(),
            grid,
            deleted: 0,
            books: Books::default(),
            regrids: 0,
            parts: Parts::default(),
            surveys: Vec::new(),
            places: Vec::new(),
            recall: Recall::default(),
            sent_before: Traffic::default(),
            arena_bytes: 0,
            surface_bytes: 0,
            costs: Costs::new(clock.step),
            partitioned,
            partitions: 0,
            is_to_weigh: false,
            weighed: None,
        };
        solver.books.next_root = solver.first_free_root();
        let reach = solver.agreed_reach();
        solver.provide_reach(reach);
        if clock == Clock::default() {
            // A box without a bin stops the first step, which says so.
            let _ = solver.moments_from_affine();
            solver.signal = solver.signals_at_rest();
            solver.clock.bound = comm.min_f64(solver.local_bound());
        }
        solver
    }

    /// Collective. One time step, not beyond the time `end`. Requests of any rank are granted to all.
    ///
    /// # Errors
    /// On all ranks when any rank failed, with that rank and its reason.
    pub fn step(&mut self, end: f64, requests: Requests) -> Result<StepReport, Disagreement> {
        self.comm.begin_step(self.clock.step);
        self.costs.begin_step(self.clock.step, self.chunks.len());
        let left = end - self.clock.time;
        let dt = self.choose_dt(left);
        let rates = self.collider_rates(dt);

        let sorted = self.sort_into_bins();
        self.note_velocities();
        self.nodes_from_particles(dt);
        self.weigh();
        let impulses = self.update_nodes(dt, &rates);
        self.form_increments();
        self.prolong();
        let departed = self.gather(dt);
        self.costs.end_step();
        let moved = self.arrive(departed);
        let reach = self.reach_now();

        self.clock.step += 1;
        self.clock.time = if dt < left { self.clock.time + dt } else { end };
        self.clock.dt = dt;
        self.advance_colliders(&rates, impulses, dt);
        self.close_step(sorted, moved, reach, requests)
    }

    /// Collective over neighbours. P2G, exchange, node sums and restriction: momentum with the impulse of stress
    /// over `dt`, and mass, on real nodes.
    pub(super) fn nodes_from_particles(&mut self, dt: f64) {
        self.scatter(dt, waves::FIRST);
        self.sum_nodes(waves::FIRST);
        let pending = self.send_sums();
        for wave in waves::FIRST + 1..self.grid.waves() {
            self.scatter(dt, wave);
            self.sum_nodes(wave);
        }
        self.add_sums_of_neighbours(pending);
        self.restrict();
    }

    /// Collective. Makes the grid anew for the current tree, partition and width of boxes.
    pub(super) fn rebuild_grid(&mut self, reach: u32) {
        self.sent_before = self.traffic();
        // Fresh memory costs as much as the first scatter into it.
        let arenas = std::mem::take(&mut self.grid.arenas);
        // The new one shall not stand beside all of the old one.
        self.grid.clear();
        self.grid = Grid::build(&self.comm, &self.forest, &self.physics, reach);
        self.grid.arenas = arenas;
    }

    /// The one reduction of a step: the bound on the next, and whether a rank failed or was asked to stop.
    fn close_step(
        &mut self,
        sorted: Result<(), BinMissing>,
        moved: Result<Moved, MigrateError>,
        reach: u32,
        requests: Requests,
    ) -> Result<StepReport, Disagreement> {
        let bound = self.local_bound();
        let outcome: Result<Moved, StepError> = match (sorted, moved) {
            (Err(error), _) => Err(error.into()),
            (_, Err(error)) => Err(error.into()),
            _ if bound.is_nan() || bound <= 0.0 => Err(StepError::TimeStep { dt: bound }),
            (_, Ok(moved)) => Ok(moved),
        };
        let flag = |set: bool| if set { -1.0 } else { 0.0 };
        let bound = if outcome.is_ok() { bound } else { 0.0 };
        let mut least = [
            bound,
            flag(outcome.is_err()),
            flag(requests.stop),
            flag(requests.checkpoint),
            -f64::from(reach),
        ];
        self.phases.time(Phase::Reduce, || self.comm.min_f64s(&mut least));
        let [bound, failed, stop, checkpoint, reach] = least;
        let moved = if failed < 0.0 { self.comm.agree(outcome)? } else { outcome.unwrap_or_default() };
        self.clock.bound = bound;
        self.provide_reach(-reach as u32);
        let granted = Requests { stop: stop < 0.0, checkpoint: checkpoint < 0.0 };
        Ok(StepReport { moved, granted })
    }
}
