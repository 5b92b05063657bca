//! How long a step takes on this machine: some steps of the job itself, or of the same job on coarser cells.
use std::time::{Duration, Instant};

use partition::comm::Comm;

use crate::solver::{Requests, Solver};

/// Time spent on steps.
const BUDGET: Duration = Duration::from_millis(400);
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
}
