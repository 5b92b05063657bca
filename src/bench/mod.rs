//! Measurement of whole steps: built-in jobs, run as any other, with migration, ordered sums, history and
//! telemetry; figures come from the telemetry that they write.
pub mod jobs;
pub mod machine;

use std::path::Path;

use partition::comm::Comm;

use self::jobs::BenchJob;
use crate::io::log::telemetry::Record;
use crate::job::{AnyProblem, Problem, parse};
use crate::particle::chunk::Layout;
use crate::run::record::Recorder;
use crate::run::{Options, RunError};
use crate::setup;
use crate::solver::Requests;
use crate::solver::state::phases::Phase;

/// Extent of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Particles, about.
    pub particles: u64,
    /// Steps of each repeat.
    pub steps: u64,
    /// Repeats.
    pub repeats: u64,
}

/// Figures of one job, medians over repeats. Times are in nanoseconds per particle and step, multiplied by
/// the number of threads of all ranks.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Figures {
    /// Name of the job.
    pub job: &'static str,
    /// Particles.
    pub particles: u64,
    /// Levels of the tree with particles.
    pub levels: usize,
    /// Share of the particles that have flowed.
    pub flowed: f64,
    /// Particle-steps per second and core, the output phase included: median over the repeats.
    pub rate: f64,
    /// The best repeat.
    pub best_rate: f64,
    /// Time of each phase by name.
    pub phases: Vec<(&'static str, f64)>,
    /// Share of the step outside scatter and gather, the output phase not counted.
    pub rest: f64,
    /// Share of the measured bandwidth that the particles' columns alone take.
    pub bandwidth: f64,
    /// Share of the measured rate of fused multiply-adds that the transfers alone take.
    pub fused: f64,
    /// Resident bytes per particle of the rank that has most.
    pub memory: f64,
    /// Processor time over wall time of this rank; well below 1 if other processes have used the core.
    pub core_share: f64,
}

/// Columns that a step reads and writes, each counted once per pass over the particles, of which there are
/// two: P2G and G2P.
fn bytes_per_step(dimension: usize, plastic: bool) -> f64 {
    let columns = match (dimension, plastic) {
        (2, false) => 15 + 7 + 16,
        (2, true) => 18 + 10 + 19,
        (_, false) => 26 + 10 + 27,
        (_, true) => 30 + 13 + 30,
    };
    // And the tags, twice.
    f64::from(8 * (columns + 2))
}

/// Operations of weights, transfers and the update of particles without the material's; a fused one counts as
/// two.
fn operations_per_step(dimension: usize) -> f64 {
    if dimension == 2 { 710.0 } else { 1800.0 }
}

/// Collective. Runs a job and measures it; figures on rank 0.
///
/// # Errors
/// As those of a run.
pub fn measure(
    comm: &Comm,
    job: &BenchJob,
    extent: Extent,
    directory: &Path,
    machine: machine::Machine,
) -> Result<Option<Figures>, RunError> {
    let text = job.text(extent.particles, extent.steps, &directory.to_string_lossy());
    match parse(&text, Path::new("bench.toml")) {
        Ok(AnyProblem::Two(problem)) => run(comm, job, &problem, extent, machine),
        Ok(AnyProblem::Three(problem)) => run(comm, job, &problem, extent, machine),
        Err(faults) => unreachable!("built-in job {}: {faults:?}", job.name),
    }
}

fn run<const D: usize>(
    comm: &Comm,
    job: &BenchJob,
    problem: &Problem<D>,
    extent: Extent,
    machine: machine::Machine,
) -> Result<Option<Figures>, RunError> {
    let mut solver = setup::solver(comm, problem).map_err(RunError::Seed)?;
    let options = Options {
        restart: None,
        overwrite: true,
        speaks: false,
        threads: rayon::current_num_threads(),
        warnings: Vec::new(),
    };
    let mut recorder = Recorder::open(comm, problem, &options, &mut solver, None)?;
    let warm_up = job.warm_up.next_multiple_of(extent.steps);
    let (mut busy, mut start) = (busy_seconds(), std::time::Instant::now());
    for step in 0..warm_up + extent.repeats * extent.steps {
        if step == warm_up {
            (busy, start) = (busy_seconds(), std::time::Instant::now());
        }
        let clock = solver.clock;
        let done = solver.step(problem.time.end, Requests::default());
        done.map_err(|source| RunError::Step { step: clock.step, time: clock.time, source })?;
        recorder.after_step(comm, &mut solver)?;
        solver.balance_if_due();
    }
    let core_share = busy.zip(busy_seconds()).map_or(1.0, |(before, after)| {
        (after - before) / (start.elapsed().as_secs_f64() * rayon::current_num_threads() as f64)
    });
    let mut counts = [0, 0];
    for chunk in &solver.chunks {
        counts[0] += chunk.len() as u64;
        counts[1] +=
            chunk.column(Layout::<D>::PLASTIC_STRAIN).iter().filter(|&&shear| shear > 0.0).count() as u64;
    }
    comm.sum_u64(&mut counts);
    if comm.rank() != 0 {
        return Ok(None);
    }
    let lines = problem.output.directory.join(format!("{}.telemetry.jsonl", problem.name));
    let records = read(&lines, extent.repeats as usize);
    let flowed = counts[1] as f64 / counts[0].max(1) as f64;
    Ok(Some(figures(job, &records, flowed, core_share, machine)))
}

/// The last records of a telemetry file.
fn read(path: &Path, count: usize) -> Vec<Record> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let records: Vec<Record> = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    records[records.len().saturating_sub(count)..].to_vec()
}

fn figures(
    job: &BenchJob,
    records: &[Record],
    flowed: f64,
    core_share: f64,
    machine: machine::Machine,
) -> Figures {
    let cores = records.last().map_or(1, |record| record.ranks * record.threads) as f64;
    let rates: Vec<f64> = records.iter().map(|record| record.particle_steps_per_second / cores).collect();
    let rate = median(rates.clone());
    let phases: Vec<(&'static str, f64)> = Phase::ALL
        .iter()
        .map(|phase| {
            let times = records.iter().map(|record| {
                let spent = record.phases.iter().find(|time| time.phase == phase.name());
                let work = record.particles as f64 * record.steps as f64;
                spent.map_or(0.0, |time| time.seconds.max) * 1e9 * cores / work
            });
            (phase.name(), median(times.collect()))
        })
        .collect();
    let total: f64 =
        phases.iter().filter(|(name, _)| *name != Phase::Output.name()).map(|(_, time)| time).sum();
    let of =
        |wanted: Phase| phases.iter().find(|(name, _)| *name == wanted.name()).map_or(0.0, |(_, time)| *time);
    let last = records.last();
    Figures {
        job: job.name,
        particles: last.map_or(0, |record| record.particles),
        levels: last.map_or(0, |record| record.levels.iter().filter(|level| level.particles > 0).count()),
        flowed,
        rate,
        best_rate: rates.iter().copied().fold(0.0, f64::max),
        rest: if total > 0.0 { 1.0 - (of(Phase::Scatter) + of(Phase::Gather)) / total } else { 0.0 },
        phases,
        bandwidth: rate * bytes_per_step(job.dimension(), job.is_plastic()) / machine.triad,
        fused: rate * operations_per_step(job.dimension()) / machine.fused,
        memory: last.map_or(0.0, |r| r.memory.max * r.ranks as f64 / r.particles.max(1) as f64),
        core_share,
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

/// Processor time of this process so far, s; `None` where the system does not say.
fn busy_seconds() -> Option<f64> {
    let mut total = 0.0;
    for thread in std::fs::read_dir("/proc/self/task").ok()? {
        let text = std::fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
        total += text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9;
    }
    Some(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![3.0, 1.0]), 2.0);
        assert_eq!(median(Vec::new()), 0.0);
    }
}
