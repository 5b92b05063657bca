//! The first state of a job as far as it is of moderate size, for its size and cost before a run.
use std::cell::RefCell;

use partition::MAX_LEVEL;
use partition::comm::{Comm, World};

use super::Size;
use super::estimate::pace::Pace;
use super::estimate::{Estimate, EstimateError, LevelCount, estimate, tree_memory};
use super::particles::seed::{SeedError, check_counts};
use super::warnings::warnings;
use crate::adaptivity::Adaptivity;
use crate::job::{AnyProblem, Problem};
use crate::particle::chunk::Tag;
use crate::solver::state::bookings::CarriedTotals;

/// Memory up to which a job is set up and stepped, bytes.
const MOST_MEMORY: f64 = 90e6;

/// Wall time of a run that needs no measurement, s.
const SHORT: f64 = 1.4;

/// Time that a step takes at least, s, however few particles there are; roughly.
const SHORTEST_STEP: f64 = 1e-4;

/// Size, cost and likely mistakes of a job, before its run.
#[derive(Clone, Debug)]
pub struct Known {
    /// Its size and cost.
    pub estimate: Estimate,
    /// Whether the counts are of the tree that the job's criteria make.
    pub is_refined: bool,
    /// Totals of the surface and forces that particles carry, by load; empty if unknown.
    pub carried: Vec<CarriedTotals>,
    /// Likely mistakes in the job; on rank 0.
    pub warnings: Vec<String>,
}

/// Why nothing is known.
#[derive(Debug, thiserror::Error)]
pub enum Unknown {
    /// A body cannot be filled.
    #[error(transparent)]
    Seed(#[from] SeedError),
    /// The size of the job cannot be estimated.
    #[error(transparent)]
    Estimate(#[from] EstimateError),
    /// The first state is a fault of the job; in words.
    #[error("{0}")]
    State(String),
    /// MPI or threads do not start; in words.
    #[error("{0}")]
    Machine(String),
}

/// Collective if `world` is there. Size and cost of a job; what only the first state tells, if that is of
/// moderate size. Starts MPI and threads where it takes steps. Not generic, so that a program does not
/// compile the solver anew.
///
/// # Errors
/// The job has no first state, or the machine is not ready.
pub fn known(
    problem: &AnyProblem,
    world: &mut Option<World>,
    start_threads: &dyn Fn(&Comm) -> Result<(), String>,
) -> Result<Known, Unknown> {
    match problem {
        AnyProblem::Two(problem) => known_of(problem, world, start_threads),
        AnyProblem::Three(problem) => known_of(problem, world, start_threads),
    }
}

fn known_of<const D: usize>(
    problem: &Problem<D>,
    world: &mut Option<World>,
    start_threads: &dyn Fn(&Comm) -> Result<(), String>,
) -> Result<Known, Unknown> {
    // On this thread alone: MPI must start before the program starts threads.
    let estimate = estimate(problem)?;
    if !estimate.is_cut {
        (0..problem.stages.len()).try_for_each(|stage| check_counts(problem, &estimate.particles, stage))?;
    }
    let carries = problem.loads.iter().any(|load| load.carried().is_some());
    let is_refined = problem.adaptivity.as_ref().is_some_and(Adaptivity::is_refining);
    let needs_particles = is_refined || problem.seepage.is_some() || carries;
    let is_moderate = !estimate.is_cut && estimate.memory < MOST_MEMORY;
    // MPI takes a moment to start, and jobs of about a second need no measurement.
    let is_short = estimate.wall_time(1) + SHORTEST_STEP * estimate.steps < SHORT;
    let (estimate, carried) = match is_short && !(needs_particles && is_moderate) {
        true => (estimate, None),
        false => {
            let world = match world {
                Some(world) => world,
                None => world.insert(World::init().map_err(|error| Unknown::Machine(error.to_string()))?),
            };
            start_threads(world.comm()).map_err(Unknown::Machine)?;
            match is_moderate {
                true => start(world.comm(), problem, estimate, is_short)?,
                false => {
                    let pace = Pace::of_coarser(world.comm(), problem, &estimate, MOST_MEMORY);
                    // The step of coarser cells is longer.
                    let pace = pace.map(|pace| Pace { time_step: estimate.time_step, ..pace });
                    (estimate.with_pace(problem.time.end, pace), None)
                }
            }
        }
    };
    let speaks = world.as_ref().is_none_or(|world| world.comm().rank() == 0);
    let warnings = if speaks { warnings(problem, estimate.steps) } else { Vec::new() };
    Ok(Known { estimate, is_refined: carried.is_some(), carried: carried.unwrap_or_default(), warnings })
}

/// Collective. Makes the first state of a job, with the tree that criteria refine, if that is of moderate
/// size, and takes some steps unless the run is short. The estimate, and what particles carry if it was made.
fn start<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    estimate: Estimate,
    is_short: bool,
) -> Result<(Estimate, Option<Vec<CarriedTotals>>), Unknown> {
    // Memory of the trees on the way, of those that have particles.
    let memories = RefCell::new(Vec::new());
    let fits = |size: Size| {
        if size[0] > 0 {
            memories.borrow_mut().push(tree_memory::<D>(size));
        }
        if tree_memory::<D>(size) < MOST_MEMORY { Ok(()) } else { Err(()) }
    };
    let solver = super::solver_within(comm, problem, fits);
    // A fault of the first state is one of the job.
    let Ok(mut solver) = solver.map_err(|error| Unknown::State(error.to_string()))? else {
        return Ok((estimate.extrapolated(final_memory(problem, &memories.borrow())), None));
    };
    let mut bodies = vec![0; problem.bodies.len()];
    for &tag in solver.chunks.iter().flat_map(|chunk| chunk.tags()) {
        bodies[usize::from(Tag::unpack(tag).body)] += 1;
    }
    let particles: Vec<u64> = solver.chunks.iter().map(|chunk| chunk.len() as u64).collect();
    // Under `mpirun` leaves beside those of other ranks count as lying beside another level.
    let own = LevelCount::of_levels(problem, solver.forest.leaves(), &particles);
    let mut levels = [LevelCount::default(); MAX_LEVEL as usize + 1];
    levels[..own.len()].copy_from_slice(&own);
    comm.sum_u64(&mut bodies);
    comm.sum_u64(bytemuck::cast_slice_mut(&mut levels));
    let finest = levels.iter().rposition(|level| level.leaves > 0).unwrap_or(0);
    let carried = solver.carried_totals();
    let estimate = estimate.for_tree(problem, bodies, levels[..=finest].to_vec());
    let pace = if is_short { None } else { Pace::of(comm, &mut solver) };
    Ok((estimate.with_pace(problem.time.end, pace), Some(carried)))
}

/// Memory of the tree that criteria ask for, bytes, by the growth of the last of the trees on the way to it,
/// each a level finer.
fn final_memory<const D: usize>(problem: &Problem<D>, memories: &[f64]) -> f64 {
    let [.., before, last] = memories else { return memories.last().copied().unwrap_or(0.0) };
    let criteria = problem.adaptivity.iter().flat_map(|adaptivity| &adaptivity.criteria);
    let finest = criteria.map(|criterion| criterion.level).max().unwrap_or(0);
    let reached = usize::from(problem.finest_level()) + memories.len() - 1;
    let left = usize::from(finest).saturating_sub(reached);
    let growth = (last / before).clamp(1.0, f64::from(1_u32 << D));
    last * growth.powi(left as i32)
}
