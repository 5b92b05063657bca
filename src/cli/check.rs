//! `agimp check`: the size and cost of a job, without running it.
use super::message::{launched, together};
use super::{Failure, ranks};
use crate::adaptivity::{Adaptivity, Criterion, Kind};
use crate::boundary::motion::Motion;
use crate::job::{self, AnyProblem, Problem};
use crate::particle::chunk::Tag;
use crate::setup;
use crate::setup::estimate::{Estimate, LevelCount, estimate};
use crate::setup::seed::check_counts;
use crate::text::{bytes, count as grouped, excerpt, number, quantity};
use partition::MAX_LEVEL;
use partition::comm::World;
use std::ffi::OsStr;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `agimp check`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Job file.
    job: PathBuf,
    /// Ranks that share the memory.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    ranks: u32,
}

/// Reads the job and prints what it will take.
///
/// # Errors
/// The job is wrong.
pub fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let mut world = launched()?;
    let problem = match &world {
        Some(world) => {
            ranks::same_command(world.comm(), &[OsStr::new("check"), arguments.job.as_os_str()])?;
            ranks::load(world.comm(), &arguments.job)?
        }
        None => job::load(&arguments.job)?,
    };
    let report = match problem {
        AnyProblem::Two(problem) => report(arguments, &problem, &mut world),
        AnyProblem::Three(problem) => report(arguments, &problem, &mut world),
    };
    once(world.as_ref(), report)
}

/// What all ranks agree on, if there are several.
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
    let estimate = estimate(problem)?;
    check_counts(problem, &estimate.particles)?;
    let is_refined = problem.adaptivity.is_some() && estimate.total_particles() <= MOST;
    let estimate = match is_refined {
        true => refined(problem, estimate, world)?,
        false => estimate,
    };
    if world.as_ref().is_none_or(|world| world.comm().rank() == 0) {
        write(&mut std::io::stdout().lock(), arguments, problem, &estimate, is_refined)?;
    }
    Ok(())
}

/// Longest name that is printed, in characters.
const NAME: usize = 60;

/// Particles up to which a job with criteria is set up, since these look at the particles themselves.
const MOST: u64 = 2_000_000;

/// The estimate for the tree that the criteria make at the start.
fn refined<const D: usize>(
    problem: &Problem<D>,
    estimate: Estimate,
    world: &mut Option<World>,
) -> Result<Estimate, Failure> {
    let world = match world {
        Some(world) => world,
        None => world.insert(World::init().map_err(|error| Failure::Run(error.to_string()))?),
    };
    let comm = world.comm();
    let solver = setup::solver(comm, problem).map_err(|error| Failure::Run(error.to_string()))?;
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
    Ok(estimate.for_tree(problem, bodies, levels[..=finest].to_vec()))
}

fn write<const D: usize>(
    out: &mut impl Write,
    arguments: &Arguments,
    problem: &Problem<D>,
    estimate: &Estimate,
    is_refined: bool,
) -> std::io::Result<()> {
    if !problem.title.is_empty() {
        writeln!(out, "{}", excerpt(&problem.title, 200))?;
    }
    let size: Vec<String> = problem.size().iter().map(|edge| number(*edge, 7)).collect();
    let roots: Vec<String> = problem.brick.roots.iter().map(u32::to_string).collect();
    writeln!(out, "domain       {} m, {} root octants", size.join(" x "), roots.join(" x "))?;
    writeln!(out, "particles    {}", grouped(estimate.total_particles()))?;
    for (body, count) in problem.bodies.iter().zip(&estimate.particles) {
        writeln!(
            out,
            "  {:18} {:>14}  {}",
            excerpt(&body.name, NAME),
            grouped(*count),
            excerpt(&problem.materials[body.material].name, NAME)
        )?;
    }
    if !problem.colliders.is_empty() {
        writeln!(out, "colliders    {}", problem.colliders.len())?;
        for collider in &problem.colliders {
            writeln!(out, "  {:18} {}", collider.name, collider)?;
        }
    }
    writeln!(out, "leaves       {}", grouped(estimate.total_leaves()))?;
    writeln!(out, "  level      cell edge         leaves         filled          cells      particles")?;
    let cells_per_leaf = 4_u64.pow(D as u32);
    for (level, count) in estimate.levels.iter().enumerate().filter(|(_, count)| count.leaves > 0) {
        writeln!(
            out,
            "  {level:5}   {:>12} {:>14} {:>14} {:>14} {:>14}",
            quantity(problem.cell_edge(level as u8), "m"),
            grouped(count.leaves),
            grouped(count.filled),
            grouped(count.leaves * cells_per_leaf),
            grouped(count.particles)
        )?;
    }
    if let Some(adaptivity) = &problem.adaptivity {
        write_refinement(out, problem, adaptivity, is_refined)?;
    }
    writeln!(
        out,
        "memory       about {} per rank on {} at the start; outputs and material that spreads add to it",
        bytes(estimate.memory_per_rank(arguments.ranks)),
        plural(arguments.ranks)
    )?;
    writeln!(out, "time step    about {}", quantity(estimate.time_step, "s"))?;
    let (steps, end) = (number(estimate.steps, 4), quantity(problem.time.end, "s"));
    writeln!(out, "steps        about {steps} to {end}")?;
    writeln!(
        out,
        "outputs      {} of about {} each",
        grouped(estimate.outputs),
        bytes(estimate.output_bytes)
    )?;
    writeln!(
        out,
        "checkpoints  about {} each, the last {} kept",
        bytes(estimate.checkpoint_bytes),
        problem.checkpoint.keep
    )?;
    Ok(())
}

/// Criteria in words, and what they mean for the numbers above and below.
fn write_refinement<const D: usize>(
    out: &mut impl Write,
    problem: &Problem<D>,
    adaptivity: &Adaptivity<D>,
    is_refined: bool,
) -> std::io::Result<()> {
    let merging = if adaptivity.merge.is_some() { "split and merge" } else { "split" };
    writeln!(
        out,
        "refinement   every {} steps, {} leaves around what is wanted, particles {merging}",
        adaptivity.every, adaptivity.buffer
    )?;
    for criterion in &adaptivity.criteria {
        writeln!(out, "  level {:5}        {}", criterion.level, words(problem, criterion))?;
    }
    writeln!(
        out,
        "  Counts and memory are those {}; time step and steps are for the finest level",
        if is_refined { "at the start, with the criteria" } else { "of the job's tree, before the criteria" }
    )?;
    writeln!(out, "  that criteria want.")
}

/// A criterion in words.
fn words<const D: usize>(problem: &Problem<D>, criterion: &Criterion<D>) -> String {
    let (refine, coarsen) = (criterion.refine, criterion.coarsen);
    let amount = |value: f64, unit: &str| quantity(value, unit);
    let near = |what: &str| {
        format!("within {} of {what}, until {} from it", amount(refine, "m"), amount(coarsen, "m"))
    };
    let above = |what: &str, unit: &str| {
        format!("{what} from {} on, until below {}", amount(refine, unit), amount(coarsen, unit))
    };
    match &criterion.kind {
        Kind::Region { motion: Motion::Fixed, .. } => near("a region"),
        Kind::Region { .. } => near("a region that moves"),
        Kind::Collider(index) => near(&format!("collider {}", problem.colliders[*index].name)),
        Kind::FreeSurface => "at free surfaces".into(),
        Kind::VelocityGradient => above("velocity gradient", "1/s"),
        Kind::PlasticStrain => above("plastic strain", ""),
        Kind::PlasticStrainRate => above("plastic strain rate", "1/s"),
        Kind::Stretch => above("stretch of particles", ""),
        Kind::Material(index) => {
            format!("where there is {}", excerpt(&problem.materials[usize::from(*index)].name, NAME))
        }
    }
}

fn plural(ranks: u32) -> String {
    if ranks == 1 { "1 rank".into() } else { format!("{ranks} ranks") }
}
