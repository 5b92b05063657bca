//! `agimp check`: the size and cost of a job, without running it.
use super::Failure;
use super::shared::message::{launched, together, warn_of};
use super::shared::settings::Changes;
use super::shared::{ranks, summary};
use crate::job::{self, AnyProblem, Problem};
use crate::particle::chunk::Tag;
use crate::setup;
use crate::setup::estimate::{Estimate, LevelCount, estimate, tree_memory};
use crate::setup::seed::check_counts;
use crate::setup::warnings::warnings;
use crate::solver::state::bookings::CarriedTotals;
use partition::MAX_LEVEL;
use partition::comm::World;
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
    let needs_particles = problem.adaptivity.is_some() || problem.loads.iter().any(|l| l.carried().is_some());
    let is_moderate = !estimate.is_cut && estimate.memory < MOST_MEMORY;
    let start = if needs_particles && is_moderate { start(problem, &estimate, world)? } else { None };
    let (refined, carried) = start.map_or((None, Vec::new()), |(refined, carried)| (Some(refined), carried));
    if world.as_ref().is_none_or(|world| world.comm().rank() == 0) {
        let (shown, is_refined) = (refined.as_ref().unwrap_or(&estimate), refined.is_some());
        let start = summary::Start { is_refined, carried: &carried };
        summary::write(&mut std::io::stdout().lock(), arguments.ranks, problem, shown, &start)?;
        warn_of(&warnings(problem, shown.steps));
    }
    Ok(())
}

/// Memory up to which a job is set up that has criteria or loads which particles carry, bytes: both depend on
/// the particles themselves.
const MOST_MEMORY: f64 = 90e6;

/// The estimate for the tree at the start, which criteria have refined, and the totals that particles carry
/// of each load; if that tree is of moderate size.
fn start<const D: usize>(
    problem: &Problem<D>,
    estimate: &Estimate,
    world: &mut Option<World>,
) -> Result<Option<(Estimate, Vec<CarriedTotals>)>, Failure> {
    let world = match world {
        Some(world) => world,
        None => world.insert(World::init().map_err(|error| Failure::Run(error.to_string()))?),
    };
    let comm = world.comm();
    let fits = |size| if tree_memory::<D>(size) < MOST_MEMORY { Ok(()) } else { Err(()) };
    let solver = setup::solver_within(comm, problem, fits);
    // A fault of the first state is one of the job.
    let Ok(solver) = solver.map_err(|error| Failure::Usage(error.to_string()))? else { return Ok(None) };
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
    Ok(Some((estimate.clone().for_tree(problem, bodies, levels[..=finest].to_vec()), carried)))
}
