//! The time integration: one explicit step of the adaptive material point method.
//!
//! [`Solver::step`] is the method; the rooms beside it hold its phases.
//!
//! | room | what it holds, from the bottom up |
//! |---|---|
//! | [`physics`] | what is solved |
//! | [`sorting`] | particles into bins |
//! | [`migration`] | particles between leaves and ranks |
//! | [`state`] | the solver and what it owns |
//! | [`step`] | phases of a step |
//! | [`refinement`] | the tree follows the material |
//! | [`balance`] | load balance: measured costs, new partitions |
//! | [`diagnostics`] | totals; weights of given boxes |
pub mod balance;
pub mod diagnostics;
pub mod migration;
pub mod physics;
pub mod refinement;
pub mod sorting;
pub mod state;
pub mod step;

pub use physics::{Physics, StepControl};
pub use state::{Clock, Requests, Solver, StepError, StepReport};

use partition::Forest;
use partition::comm::{Comm, Disagreement, Traffic};

use self::migration::migrate::{MigrateError, Moved};
use self::sorting::bins::BinMissing;
use crate::adaptivity::resample::ledger::Books;
use crate::grid::arenas::waves;
use crate::particle::Chunk;
use crate::solver::state::bookings::{Contacts, LoadBooks};
use crate::solver::state::cost::Costs;
use crate::solver::state::grid::Grid;
use crate::solver::state::last_partition::LastPartition;
use crate::solver::state::parts::Parts;
use crate::solver::state::phases::{Phase, Phases, thread_time};
use crate::solver::state::recall::Recall;

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
