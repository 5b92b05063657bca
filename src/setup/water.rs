//! Water in the pores at the start of a run and of its stages.
use partition::comm::{Comm, Disagreement};
use rayon::prelude::*;

use super::initial_stress::{Which, put_under_stress};
use super::particles::seed::SeedError;
use crate::job::Problem;
use crate::solver::Solver;
use crate::text::excerpt;

/// Collective. Finds the heads of the water that seeps in the stage of a solver, how full the pores of its
/// particles are, and stress that depends on heads; the first particles of each own leaf, as many as `known`,
/// know that already.
///
/// # Errors
/// A head is held where there is no ground, or a material cannot have the stress; the same on all ranks.
pub(super) fn begin<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    solver: &mut Solver<D>,
    known: &[usize],
) -> Result<(), Disagreement> {
    solver.begin_saturation(known);
    let held = solver.find_heads();
    let empty = held.iter().position(|&nodes| nodes == 0);
    let fault = solver.physics.not_finite().map(SeedError::from);
    let fault = fault.or_else(|| empty.map(|head| no_ground(problem, head)));
    comm.agree(fault.map_or(Ok(()), Err))?;
    if let Some(column) = solver.physics.followed_columns().head {
        let Solver { physics, forest, chunks, .. } = solver;
        let leaves = forest.leaves().par_iter().zip(chunks).zip(known);
        let stressed = leaves.map(|((leaf, chunk), &first)| {
            let which = Which::WithHeads { first, column };
            put_under_stress(problem, &physics.materials, leaf, chunk, which)
        });
        comm.agree(stressed.collect::<Result<(), SeedError>>())?;
    }
    solver.wet_particles(solver.clock.time);
    Ok(())
}

fn no_ground<const D: usize>(problem: &Problem<D>, head: usize) -> SeedError {
    let name = problem.seepage.as_ref().map_or("", |seepage| &seepage.heads[head].name);
    let place = problem.loads.iter().position(|load| load.water().is_some());
    let place = place.map_or(String::new(), |load| problem.load_places[load].to_string());
    SeedError::Head {
        place: format!("{place}: water.seepage.heads[{head}]"),
        head: excerpt(name, 60).into_owned(),
    }
}
