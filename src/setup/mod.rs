//! From a job to the first state: tree, partition and particles.
//!
//! | file or folder | what it holds |
//! |---|---|
//! | this | the first tree, and the solver on it |
//! | `constant`, [`stages`] | physics without the changes of stages, and with them |
//! | [`particles`] | particles that come with a stage; surfaces under loads |
//! | `materials`, [`walls`], `water` | materials of bodies by stage; colliders that hold fluids; heads of water |
//! | [`initial_stress`] | stress at the start |
//! | [`estimate`], [`warnings`], [`known`] | size and duration of a job; likely mistakes in it; both before a run |
use std::convert::Infallible;

use partition::comm::{Comm, Disagreement};
use partition::{Forest, MAX_LEVEL, Octant};
use rayon::prelude::*;

use self::particles::seed::{SeedError, check_counts, count_leaf};
use self::particles::{carried, new_particles};
use crate::job::Problem;
use crate::particle::chunk::{Chunk, Tag};
use crate::solver::balance::rebalance::cut_at;
use crate::solver::state::cost::leaf_cost;
use crate::solver::{Clock, Physics, Solver};

mod constant;
pub mod estimate;
pub mod initial_stress;
pub mod known;
mod materials;
pub mod particles;
pub mod stages;
pub mod walls;
pub mod warnings;
mod water;

/// Physics of the first stage of a run.
pub fn physics<const D: usize>(problem: &Problem<D>) -> Physics<D> {
    stages::physics(problem, &[0.0])
}

/// Collective. A solver in the initial state of the job: tree, partition and numbered particles.
///
/// # Errors
/// Two bodies overlap or one has no particle; the same on all ranks.
pub fn solver<const D: usize>(comm: &Comm, problem: &Problem<D>) -> Result<Solver<D>, Disagreement> {
    let Ok(solver) = solver_within::<D, Infallible>(comm, problem, |_| Ok(()))?;
    Ok(solver)
}

/// Particles, leaves and leaves with particles of all ranks.
pub type Size = [u64; 3];

/// Collective. As [`solver`], unless `fits` refuses the size of a tree on the way there: then its refusal,
/// before any particle of that tree is made.
///
/// # Errors
/// Two bodies overlap or one has no particle; the same on all ranks.
pub fn solver_within<const D: usize, R>(
    comm: &Comm,
    problem: &Problem<D>,
    fits: impl Fn(Size) -> Result<(), R>,
) -> Result<Result<Solver<D>, R>, Disagreement> {
    let mut forest = match first_forest(comm, problem, &fits) {
        Ok(forest) => forest,
        Err(refusal) => return Ok(Err(refusal)),
    };
    if let Err(refusal) = fits(comm.agree(partition_by_seeds(comm, problem, &mut forest))?) {
        return Ok(Err(refusal));
    }
    let mut solver = seeded(comm, problem, forest)?;
    // Criteria depend on particles, and finer leaves have other particles: until the tree stays.
    let mut passes = 0;
    while passes < MAX_LEVEL && solver.regrid_before_start() {
        let mut forest = forest_of(solver);
        if let Err(refusal) = fits(comm.agree(partition_by_seeds(comm, problem, &mut forest))?) {
            return Ok(Err(refusal));
        }
        solver = seeded(comm, problem, forest)?;
        passes += 1;
    }
    let mut counts = vec![0; problem.bodies.len()];
    for tag in solver.chunks.iter().flat_map(Chunk::tags) {
        counts[usize::from(Tag::unpack(*tag).body)] += 1;
    }
    comm.sum_u64(&mut counts);
    comm.agree(check_counts(problem, &counts, 0))?;
    let mut chunks = std::mem::take(&mut solver.chunks);
    carried::carry(comm, problem, &solver, &mut chunks, 0)?;
    solver.chunks = chunks;
    let none = vec![0; solver.chunks.len()];
    water::begin(comm, problem, &mut solver, &none)?;
    Ok(Ok(solver))
}

/// The tree of a solver, whose particles go: those of the next tree need the room.
fn forest_of<const D: usize>(solver: Solver<D>) -> Forest<D> {
    solver.forest
}

/// Collective. Fills the leaves of a tree with numbered particles.
fn seeded<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    forest: Forest<D>,
) -> Result<Solver<D>, Disagreement> {
    let physics = physics(problem);
    let chunks = new_particles(comm, problem, &forest, &physics, 0)?;
    Ok(Solver::new(comm, physics, forest, chunks, Clock::default()))
}

/// Collective. The tree that the job asks for before its criteria are evaluated; level by level, so that
/// `fits` may refuse it before it is built.
fn first_forest<const D: usize, R>(
    comm: &Comm,
    problem: &Problem<D>,
    fits: &impl Fn(Size) -> Result<(), R>,
) -> Result<Forest<D>, R> {
    let mut forest = Forest::uniform(comm, problem.brick, problem.tree.base_level);
    for level in problem.tree.base_level..problem.finest_level() {
        forest.refine_where(comm, |leaf| leaf.level == level && problem.wants_refinement(leaf));
        fits([0, forest.global_len(), 0])?;
    }
    if problem.tree.graded {
        forest.balance(comm);
    }
    Ok(forest)
}

/// Collective. Partitions a tree by the particles that its leaves will hold. Returns its size.
///
/// # Errors
/// Two bodies overlap; on the rank that found it.
fn partition_by_seeds<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    forest: &mut Forest<D>,
) -> Result<Size, SeedError> {
    // Counted, not filled: leaves of other ranks must take no memory here.
    let count = |leaf: &Octant<D>| {
        let mut counts = vec![0; problem.bodies.len()];
        count_leaf(problem, leaf, 0, &mut counts).map(|()| counts.iter().sum())
    };
    let counted: Result<Vec<u64>, SeedError> = forest.leaves().par_iter().map(count).collect();
    let weights = match &counted {
        Ok(counts) => counts.iter().map(|&count| leaf_cost::<D>(count)).collect(),
        Err(_) => vec![1; forest.leaves().len()],
    };
    forest.partition(comm, &weights, cut_at(problem.adaptivity.as_ref()));
    let mut size = counted.as_ref().map_or([0; 3], |counts| {
        let filled = counts.iter().filter(|count| **count > 0).count();
        [counts.iter().sum(), counts.len() as u64, filled as u64]
    });
    comm.sum_u64(&mut size);
    counted.map(|_| size)
}
