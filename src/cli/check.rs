//! `agimp check`: the size and cost of a job, without running it.
use super::Failure;
use super::run::start_threads;
use super::shared::message::{launched, together, warn_of};
use super::shared::settings::Changes;
use super::shared::{ranks, summary};
use crate::job::{self, AnyProblem, Problem};
use crate::memory::Limits;
use crate::particle::chunk::Tag;
use crate::setup;
use crate::setup::Size;
use crate::setup::estimate::pace::Pace;
use crate::setup::estimate::{Estimate, LevelCount, estimate, tree_memory};
use crate::setup::seed::check_counts;
use crate::setup::warnings::warnings;
use crate::solver::state::bookings::CarriedTotals;
use crate::text::bytes;
use partition::MAX_LEVEL;
use partition::comm::{Comm, World};
use std::cell::RefCell;
use std::ffi::OsStr;
use std::path::PathBuf;

/// Arguments of `agimp check`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Job file.
    job: PathBuf,
    /// Ranks that share the memory.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    ranks: u32,
    /// Values that replace those of the job.
    #[command(flatten)]
    changes: Changes,
}

/// Reads the job and prints its size and cost.
///
/// # Errors
/// The job is wrong.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let settings = arguments.changes.settings()?;
    let mut world = launched()?;
    let problem = match &world {
        Some(world) => {
            let mut words = vec![OsStr::new("check"), arguments.job.as_os_str()];
            words.extend(settings.words());
            ranks::same_command(world.comm(), &words)?;
            ranks::load(world.comm(), &arguments.job, &settings)?
        }
        None => job::load_with(&arguments.job, &settings)?,
    };
    let report = match problem {
        AnyProblem::Two(problem) => report(arguments, &problem, &mut world),
        AnyProblem::Three(problem) => report(arguments, &problem, &mut world),
    };
    once(world.as_ref(), report)
}

/// The result on which all ranks agree, if there are several; the own one otherwise.
fn once<T>(world: Option<&World>, result: Result<T, Failure>) -> Result<T, Failure> {
    match world {
        Some(world) => together(world.comm(), result),
        None => result,
    }
}

fn report<const D: usize>(
    arguments: &Arguments,
    problem: &Problem<D>,
    world: &mut Option<World>,
) -> Result<(), Failure> {
    // On this thread alone: MPI must start before the program starts threads.
    let estimate = estimate(problem).map_err(|error| Failure::Usage(error.to_string()))?;
    if !estimate.is_cut {
        (0..problem.stages.len()).try_for_each(|stage| check_counts(problem, &estimate.particles, stage))?;
    }
    let carries = problem.loads.iter().any(|load| load.carried().is_some());
    let needs_particles = problem.adaptivity.is_some() || problem.seepage.is_some() || carries;
    let is_moderate = !estimate.is_cut && estimate.memory < MOST_MEMORY;
    // MPI takes a moment to start, and jobs of about a second need no measurement.
    let is_short = estimate.wall_time(1) + SHORTEST_STEP * estimate.steps < SHORT;
    let looked = match is_short && !(needs_particles && is_moderate) {
        true => Start::Unknown(estimate),
        false => {
            let world = match world {
                Some(world) => world,
                None => world.insert(World::init().map_err(|error| Failure::Run(error.to_string()))?),
            };
            start_threads(world.comm(), None)?;
            match is_moderate {
                true => start(world.comm(), problem, estimate, is_short)?,
                false => {
                    let pace = Pace::of_coarser(world.comm(), problem, &estimate, MOST_MEMORY);
                    // The step of coarser cells is longer.
                    let pace = pace.map(|pace| Pace { time_step: estimate.time_step, ..pace });
                    Start::Unknown(estimate.with_pace(problem.time.end, pace))
                }
            }
        }
    };
    let (shown, is_refined, carried) = match looked {
        Start::Made { estimate, carried } => (estimate, true, carried),
        Start::Unknown(estimate) => (estimate, false, Vec::new()),
    };
    if world.as_ref().is_none_or(|world| world.comm().rank() == 0) {
        let start = summary::Start { is_refined, carried: &carried };
        summary::write(&mut std::io::stdout().lock(), arguments.ranks, problem, &shown, &start)?;
        let mut all = warnings(problem, shown.steps);
        all.extend(lack_of_memory(&shown, arguments.ranks));
        warn_of(&all);
    }
    Ok(())
}

/// Memory of this machine that the job exceeds: with one rank, or with each of some that may be on machines
/// of their own.
fn lack_of_memory(estimate: &Estimate, ranks: u32) -> Option<String> {
    let (needed, has) = (estimate.memory_per_rank(ranks), Limits::of_machine().per_rank(1));
    let each = if ranks == 1 { String::new() } else { format!(" on each of {ranks} ranks") };
    (needed > has).then(|| {
        format!(
            "tree: the job takes about {} of memory{each}, and this machine has {}; a run here is refused: use coarser cells, lower levels, or more machines",
            bytes(needed),
            bytes(has)
        )
    })
}

/// Memory up to which a job is set up and stepped, bytes.
const MOST_MEMORY: f64 = 90e6;

/// Wall time of a run that needs no measurement, s.
const SHORT: f64 = 1.4;

/// Time that a step takes at least, s, however few particles there are; roughly.
const SHORTEST_STEP: f64 = 1e-4;

/// The first state of a job, as far as it is known.
enum Start {
    /// It was made: the estimate for its tree, and what particles carry of each load.
    Made { estimate: Estimate, carried: Vec<CarriedTotals> },
    /// It was not made, or is too large.
    Unknown(Estimate),
}

/// Collective. Makes the first state of a job, with the tree that criteria refine, if that is of moderate
/// size, and takes some steps unless the run is short.
fn start<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    estimate: Estimate,
    is_short: bool,
) -> Result<Start, Failure> {
    // Memory of the trees on the way, of those that have particles.
    let memories = RefCell::new(Vec::new());
    let fits = |size: Size| {
        if size[0] > 0 {
            memories.borrow_mut().push(tree_memory::<D>(size));
        }
        if tree_memory::<D>(size) < MOST_MEMORY { Ok(()) } else { Err(()) }
    };
    let solver = setup::solver_within(comm, problem, fits);
    // A fault of the first state is one of the job.
    let Ok(mut solver) = solver.map_err(|error| Failure::Usage(error.to_string()))? else {
        return Ok(Start::Unknown(estimate.extrapolated(final_memory(problem, &memories.borrow()))));
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
    Ok(Start::Made { estimate: estimate.with_pace(problem.time.end, pace), carried })
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
