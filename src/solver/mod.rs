//! The time integration: one explicit step of the adaptive material point method.
//!
//! `Solver::advance` is the method, and `docs/time-step.md` goes through it; the rooms beside it hold its
//! phases. [`Solver::step`] adds clock, measured costs and the reduction.
//!
//! | room | what it holds, from the bottom up |
//! |---|---|
//! | [`physics`] | the problem |
//! | [`sorting`] | particles into bins |
//! | [`migration`] | particles between leaves and ranks |
//! | [`state`] | the solver and what it owns |
//! | [`step`] | phases of a step |
//! | `seepage` | heads of water that seeps |
//! | `quasi_static` | load steps: equilibrium by Newton's method |
//! | [`refinement`] | dynamic refinement |
//! | [`balance`] | load balance: measured costs, new partitions |
//! | [`stage`] | the next stage of a run |
//! | `saved` | scalars of the state in files |
//! | [`diagnostics`] | totals; weights of given boxes |
pub mod balance;
pub mod diagnostics;
pub mod migration;
pub mod physics;
mod quasi_static;
pub mod refinement;
mod saved;
mod seepage;
pub mod sorting;
pub mod stage;
pub mod state;
pub mod step;

pub use physics::{Equilibrium, Physics, QuasiStatic, StepControl, Ties};
pub use state::{Clock, Effort, Requests, Solver, StepError, StepReport};

use partition::Forest;
use partition::comm::{Comm, Disagreement, Traffic};

use self::migration::migrate::Moved;
use crate::grid::KnownTree;
use crate::leapfrog::Lengths;
use crate::particle::Chunk;
use crate::solver::state::bookings::Contacts;
use crate::solver::state::cost::Costs;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::inside::KnownInside;
use crate::solver::state::last_partition::LastPartition;
use crate::solver::state::leaf_data::LeafData;
use crate::solver::state::parts::{Adaptation, Balance, EquilibriumState, Measured, ParticleForces, Sums};
use crate::solver::state::phases::{Phase, Phases, thread_time};
use crate::solver::state::relaxation::RelaxPhase;

/// Length of the step before, over the bound on the next, of which half counts as lag at most. Bounds that
/// vary with the motion stay well below it, and so do those of trees that are refined by a level.
const MOST_BEFORE: f64 = 2.1;

impl<const D: usize> Solver<D> {
    /// Collective. A solver for particles that lie in their leaves (`chunks[i]` in leaf `i`). For a state
    /// read from a file `clock` is that of the file; for a new run it is the default.
    pub fn new(
        comm: &Comm,
        mut physics: Physics<D>,
        forest: Forest<D>,
        chunks: Vec<Chunk<D>>,
        clock: Clock,
    ) -> Self {
        let start = thread_time();
        physics.deform_colliders(clock.time);
        physics.weaken(clock.time);
        let grid = Grid::build(comm, &forest, &physics, 0);
        let partitioned = LastPartition::at_start(start);
        let mut solver = Self {
            comm: comm.clone(),
            leaf_data: LeafData::default(),
            contacts: Contacts::new(&physics, clock.time),
            sums: Sums::new(&physics, clock.time),
            particle_forces: ParticleForces::default(),
            equilibrium: EquilibriumState::default(),
            physics,
            forest,
            chunks,
            clock,
            phases: Phases::default(),
            grid,
            measured: Measured::default(),
            adaptation: Adaptation::default(),
            balance: Balance {
                sent_before: Traffic::default(),
                surface_bytes: 0,
                costs: Costs::new(clock.step),
                partitioned,
                partitions: 0,
                is_to_weigh: false,
                weighed: None,
            },
        };
        if let Some(load_steps) = solver.physics.quasi_static {
            solver.equilibrium.next_load_step =
                if clock == Clock::default() { load_steps.step } else { clock.bound };
        }
        solver.physics.has_halves = solver.find_halves();
        solver.leaf_data.reset(solver.chunks.len());
        solver.adaptation.ledger.next_root = solver.first_free_root();
        let reach = solver.agreed_reach();
        solver.provide_reach(reach);
        if clock == Clock::default() {
            solver.start_from(&vec![0; solver.chunks.len()]);
        }
        solver
    }

    /// Collective. Prepares the first step of particles as a job gives them: their affine states for the
    /// transfer, and the bound on the step. In each own leaf the first particles, as many as `done`, have had
    /// steps.
    fn start_from(&mut self, done: &[usize]) {
        // A box without a bin is reported by the first step, which fails.
        let _ = self.moments_from_affine(done);
        self.leaf_data.signal = self.signals_under_stress();
        self.clock.bound = self.comm.min_f64(self.local_bound());
    }

    /// Collective. One time step, not beyond the time `end`, which has to be finite where no material bounds
    /// the step. Requests of any rank are granted to all.
    ///
    /// # Errors
    /// On all ranks when any rank failed, with that rank and its reason, or the step would not end at a
    /// later, finite time.
    pub fn step(&mut self, end: f64, requests: Requests) -> Result<StepReport, Disagreement> {
        let left = end - self.clock.time;
        let dt = self.choose_dt(left);
        let to = if dt < left { self.clock.time + dt } else { end };
        if !to.is_finite() || to <= self.clock.time {
            // All ranks find the same.
            return self.comm.agree(Err(StepError::Time { dt, to, from: self.clock.time }));
        }
        if self.heads_are_due() {
            self.find_heads();
        }
        self.comm.begin_step(self.clock.step);
        self.leaf_data.begin_step(self.clock.step, self.chunks.len());
        self.weigh_particles();
        let lengths = Lengths::new(self.caught_up_lag(), dt);
        let (to, dt, advanced) = match self.physics.quasi_static {
            None => (to, dt, self.advance(to, lengths)),
            Some(_) => {
                let (whole, start) = (dt, self.clock.time);
                let (dt, advanced) = self.load_step(dt);
                if dt == 0.0 && advanced.is_ok() {
                    // The state stays that of the last factor with equilibrium.
                    self.clock.bound = self.equilibrium.next_load_step;
                    return Ok(StepReport::default());
                }
                (if dt < whole { start + dt } else { to }, dt, advanced)
            }
        };
        (self.clock.step, self.clock.time, self.clock.dt) = (self.clock.step + 1, to, dt);
        let settled = self.relax(lengths);
        self.weigh_nodes();
        self.leaf_data.times.end_step();
        self.close_step(advanced, requests).map(|report| StepReport { settled, ..report })
    }

    /// Collective over neighbours. The method: one step of these lengths to the time `to`, s. Forces act over
    /// the kick; all that moves does so over the drift, Δt. `docs/time-step.md` goes through it.
    fn advance(&mut self, to: f64, lengths: Lengths) -> Result<Moved, StepError> {
        let dt = lengths.drift;
        let mut rates = self.collider_rates(dt);
        let pushes = self.meet_bodies(&mut rates, dt);
        let sorted = self.sort_into_bins();
        self.particles_to_nodes(lengths);
        let (mut impulses, held) = self.update_node_velocities(lengths, &rates);
        self.prolong_velocities();
        self.fill_nodes();
        let departed = self.nodes_to_particles(&rates, to, dt);
        self.book_pushes(lengths);
        self.book_conveyed();
        self.book_met(&mut impulses);
        let moved = self.migrate_particles(departed);
        self.feed(to);
        self.wet_particles(to);
        self.move_colliders(&rates, &pushes, impulses, to, dt);
        // A rank that has failed serves its neighbours to the end of the step.
        sorted?;
        held?;
        Ok(moved?)
    }

    /// How long before the present time the velocities belong to, s: half of the last step; 0 at the start
    /// and where velocities have been set since.
    pub fn lag(&self) -> f64 {
        match self.equilibrium.relaxation.phase {
            _ if self.physics.quasi_static.is_some() => 0.0,
            RelaxPhase::Stopped => 0.0,
            _ => 0.5 * self.clock.dt,
        }
    }

    /// Not collective. The lag ahead of a step. After a sudden fall of the bound on the step, as where a
    /// shock begins, forces act over no more than the material bears: the rest of the lag is left out.
    fn caught_up_lag(&mut self) -> f64 {
        let (lag, most) = (self.lag(), 0.5 * MOST_BEFORE * self.clock.bound);
        if lag <= most {
            return lag;
        }
        self.skip_forces(lag - most);
        most
    }

    /// The time to which velocities belong, and up to which forces have acted, s.
    pub fn time_of_velocities(&self) -> f64 {
        self.clock.time - self.lag()
    }

    /// The own leaves and those around them.
    pub fn known_tree(&self) -> &KnownTree<D> {
        &self.grid.plan.tree
    }

    /// Collective. Makes the grid anew for the current tree, partition and width of boxes.
    pub(super) fn rebuild_grid(&mut self, reach: u32) {
        self.balance.sent_before = self.traffic();
        // Fresh memory costs as much as the first scatter into it.
        let (arenas, sum_bytes) = (std::mem::take(&mut self.grid.fields[0].arenas), self.grid.sum_bytes);
        let inside = KnownInside::of(&self.grid.plan, std::mem::take(&mut self.grid.inside_still));
        // Free the old grid first: both at once would double the peak of memory.
        self.grid.clear();
        self.grid = Grid::build(&self.comm, &self.forest, &self.physics, reach);
        (self.grid.fields[0].arenas, self.grid.sum_bytes) = (arenas, sum_bytes);
        self.grid.inside_still = inside.for_plan(&self.grid.plan);
    }

    /// The one reduction of a step: the bound on the next, and whether a rank failed or was asked to stop.
    fn close_step(
        &mut self,
        advanced: Result<Moved, StepError>,
        requests: Requests,
    ) -> Result<StepReport, Disagreement> {
        // Reported ahead of the bound, which needs gravity after the step, and in place of later faults that
        // the value has caused.
        let advanced = self.physics.not_finite().map_or(advanced, |fault| Err(fault.into()));
        let (bound, reach) = (self.local_bound(), self.reach_now());
        let outcome = advanced.and_then(|moved| match bound.is_nan() || bound <= 0.0 {
            true => Err(StepError::TimeStep { dt: bound }),
            false => Ok(moved),
        });
        let flag = |set: bool| if set { -1.0 } else { 0.0 };
        let bound = if outcome.is_ok() { bound } else { 0.0 };
        let mut least = [
            bound,
            flag(outcome.is_err()),
            flag(requests.stop),
            flag(requests.checkpoint),
            -f64::from(reach),
            flag(self.has_wide_boxes()),
            flag(self.is_near_walls()),
        ];
        self.phases.time(Phase::Reduce, || self.comm.min_f64s(&mut least));
        let [bound, failed, stop, checkpoint, reach, wide, near] = least;
        self.adaptation.has_wide = wide < 0.0;
        let moved = if failed < 0.0 { self.comm.agree(outcome)? } else { outcome.unwrap_or_default() };
        self.clock.bound = bound;
        self.grid.walls.is_near = near < 0.0;
        self.provide_reach(-reach as u32);
        let granted = Requests { stop: stop < 0.0, checkpoint: checkpoint < 0.0 };
        Ok(StepReport { moved, granted, settled: false })
    }
}
