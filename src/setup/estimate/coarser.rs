//! The cost of steps of a job that is too large to be tried: that of the same job on coarser cells.
use partition::comm::Comm;

use super::pace::Pace;
use super::{Estimate, estimate};
use crate::job::Problem;
use crate::setup;

/// Coarser jobs that are tried.
const TRIALS: usize = 3;

impl Pace {
    /// Collective. The same of a job that takes more than `most` bytes: on cells so much coarser that it
    /// takes less. The time step is not that of the job. `None` if there are no such cells, or the coarser
    /// job cannot be made.
    pub fn of_coarser<const D: usize>(
        comm: &Comm,
        problem: &Problem<D>,
        of_job: &Estimate,
        most: f64,
    ) -> Option<Self> {
        if of_job.is_cut {
            return None;
        }
        // A level less leaves at least a quarter or an eighth. Counting takes time, so there are few trials.
        let least = ((of_job.memory / most).log2() / D as f64).floor().max(0.0) as u8;
        let levels = (least + 1..=problem.finest_level()).take(TRIALS);
        let coarser = levels.map(|by| coarser(problem, by)).find(|coarser| {
            estimate(coarser).is_ok_and(|estimate| {
                let has_particles = estimate.particles.iter().all(|&count| count > 0);
                has_particles && !estimate.is_cut && estimate.memory < most
            })
        })?;
        let mut solver = setup::solver(comm, &coarser).ok()?;
        Self::of(comm, &mut solver)
    }
}

/// The job with all levels lower. Criteria may no longer ask for more than the tree has.
fn coarser<const D: usize>(problem: &Problem<D>, by: u8) -> Problem<D> {
    let mut coarser = problem.clone();
    coarser.tree.base_level = coarser.tree.base_level.saturating_sub(by);
    coarser.tree.regions.iter_mut().for_each(|region| region.level = region.level.saturating_sub(by));
    for criterion in coarser.adaptivity.iter_mut().flat_map(|adaptivity| &mut adaptivity.criteria) {
        criterion.level = criterion.level.saturating_sub(by).max(coarser.tree.base_level);
    }
    coarser
}
