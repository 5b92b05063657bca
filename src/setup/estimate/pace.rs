//! How long a step takes on this machine: some steps of the job itself, or of the same job on coarser cells.
use std::time::{Duration, Instant};

use partition::comm::Comm;

use super::{Estimate, estimate};
use crate::job::Problem;
use crate::setup;
use crate::solver::{Requests, Solver};

/// Time spent on steps.
const BUDGET: Duration = Duration::from_millis(400);
/// Coarser jobs that are tried.
const TRIALS: usize = 3;
/// Most steps that are measured.
const STEPS: usize = 400;
/// The step whose length counts, so that it is the same in each measurement.
const REPRESENTATIVE: usize = 4;

/// Measured cost of steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Wall time of a step for each particle, s.
    pub seconds_per_particle: f64,
    /// Length of a step after the first ones, s.
    pub time_step: f64,
}

impl Pace {
    /// Collective. Does some steps. The first ones, in which memory is touched for the first time, do not
    /// count. `None` if a step fails.
    pub fn of<const D: usize>(comm: &Comm, solver: &mut Solver<D>) -> Option<Self> {
        let particles = solver.chunks.iter().map(|chunk| chunk.len() as u64).sum();
        let mut particles = [particles];
        comm.sum_u64(&mut particles);
        let (start, mut times, mut time_step) = (Instant::now(), Vec::new(), 0.0);
        while times.len() < STEPS {
            let step = Instant::now();
            solver.step(f64::INFINITY, Requests::default()).ok()?;
            solver.regrid().ok()?;
            times.push(step.elapsed().as_secs_f64());
            if times.len() == REPRESENTATIVE {
                time_step = solver.clock.dt;
            }
            if comm.any(times.len() >= REPRESENTATIVE && start.elapsed() > BUDGET) {
                break;
            }
        }
        let counted = &times[times.len() / 4..];
        let mean = comm.max_f64(counted.iter().sum::<f64>() / counted.len() as f64);
        let seconds_per_particle = mean / particles[0].max(1) as f64;
        Some(Self { seconds_per_particle, time_step })
    }

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
