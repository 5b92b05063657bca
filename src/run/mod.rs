//! A whole run: from a checked job to its last file.
pub mod history;
pub mod record;
pub mod report;
pub mod restart;
pub mod schedule;
pub mod setup;
pub mod stop;

use std::path::PathBuf;

use partition::comm::{Comm, Disagreement};

use self::record::Recorder;
use self::restart::From;
use self::schedule::Schedule;
use self::stop::StopRequest;
use crate::io::hdf5_file::FileError;
use crate::io::snapshot::{Outputs, Scalars, View};
use crate::job::Problem;
use crate::solver::{Requests, Solver};

/// How a run is started.
#[derive(Clone, Debug)]
pub struct Options {
    /// File to go on from; a new run without it.
    pub restart: Option<From>,
    /// Whether this process tells the user how the run goes on.
    pub speaks: bool,
    /// Threads of this rank.
    pub threads: usize,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// At its end time.
    Finished,
    /// On request, after writing this checkpoint.
    Stopped {
        /// The checkpoint.
        checkpoint: PathBuf,
    },
}

/// Why a run could not be started or finished; the same on all ranks.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Some rank failed.
    #[error(transparent)]
    Rank(#[from] Disagreement),
    /// A step failed.
    #[error("step {step}, time {time} s: {source}")]
    Step {
        /// Number of the step.
        step: u64,
        /// Time at its start, s.
        time: f64,
        /// Rank and reason.
        source: Disagreement,
    },
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// There is nothing to restart from.
    #[error("no restart file of `{name}` in {directory}; start without --restart or name a file")]
    NoRestart {
        /// Name of the run.
        name: String,
        /// Where it was looked for.
        directory: PathBuf,
    },
}

/// Steps between looks at the imbalance.
const BALANCE_EVERY: u64 = 20;
/// Imbalance above which leaves are partitioned anew.
const IMBALANCE_LIMIT: f64 = 1.05;

/// Collective. Runs a job to its end, or until it is asked to stop.
///
/// # Errors
/// The same on all ranks.
pub fn run<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    options: &Options,
    stop: &StopRequest,
) -> Result<Outcome, RunError> {
    let mut run = match &options.restart {
        None => Run::start(comm, problem, options)?,
        Some(from) => Run::resume(comm, problem, options, from)?,
    };
    while run.solver.clock.time < problem.time.end {
        let requests = Requests { stop: stop.is_set(), checkpoint: run.schedule.wall_due() };
        let granted = run.step(requests)?;
        run.write_due(granted.checkpoint)?;
        if granted.stop {
            let checkpoint = run.checkpoint()?;
            return Ok(Outcome::Stopped { checkpoint });
        }
        run.balance();
    }
    run.finish()?;
    Ok(Outcome::Finished)
}

/// A run under way.
struct Run<'a, const D: usize> {
    comm: &'a Comm,
    problem: &'a Problem<D>,
    solver: Solver<D>,
    outputs: Outputs,
    schedule: Schedule,
    recorder: Recorder,
    materials: Vec<String>,
    histories: Vec<String>,
}

impl<'a, const D: usize> Run<'a, D> {
    /// Collective. A new run: directory, first output and first row of the history.
    fn start(comm: &'a Comm, problem: &'a Problem<D>, options: &Options) -> Result<Self, RunError> {
        let solver = setup::solver(comm, problem)?;
        let setup = &problem.output;
        let outputs = Outputs::create(comm, &setup.directory, &problem.name, restart::options(problem))?;
        let mut run = Self::with(comm, problem, options, solver, outputs)?;
        run.recorder.write(comm, &mut run.solver, true, true)?;
        run.write_output()?;
        Ok(run)
    }

    /// Collective. Goes on from a file.
    fn resume(
        comm: &'a Comm,
        problem: &'a Problem<D>,
        options: &Options,
        from: &From,
    ) -> Result<Self, RunError> {
        let (solver, scalars) = restart::solver(comm, problem, from)?;
        let next = scalars.count(restart::NEXT_OUTPUT).unwrap_or(0);
        let outputs = Outputs::resume(
            comm,
            &problem.output.directory,
            &problem.name,
            restart::options(problem),
            next,
            solver.clock.time,
        )?;
        Self::with(comm, problem, options, solver, outputs)
    }

    fn with(
        comm: &'a Comm,
        problem: &'a Problem<D>,
        options: &Options,
        solver: Solver<D>,
        outputs: Outputs,
    ) -> Result<Self, RunError> {
        let mut recorder = Recorder::open(comm, problem, options, &solver)?;
        let (cores, wanted) = (available_cores(), comm.size() * options.threads);
        recorder.message(&format!(
            "{}: {} ranks x {} threads on {cores} cores, {} leaves",
            problem.name,
            comm.size(),
            options.threads,
            solver.forest.global_len()
        ));
        if wanted > cores {
            recorder.message(&format!(
                "warning: {wanted} threads share {cores} cores here; expect less speed (several machines \
                 count as one here)"
            ));
        }
        let histories = solver.physics.materials.iter().map(|m| m.history_names().join(" ")).collect();
        Ok(Self {
            comm,
            problem,
            schedule: Schedule::new(problem, solver.clock.time),
            solver,
            outputs,
            recorder,
            materials: problem.materials.iter().map(|material| material.name.clone()).collect(),
            histories,
        })
    }

    fn step(&mut self, requests: Requests) -> Result<Requests, RunError> {
        let clock = self.solver.clock;
        let report = self.solver.step(self.problem.time.end, requests);
        Ok(report.map_err(|source| RunError::Step { step: clock.step, time: clock.time, source })?.granted)
    }

    /// Collective. Writes what is due after a step.
    fn write_due(&mut self, checkpoint: bool) -> Result<(), RunError> {
        self.recorder.after_step(self.comm, &mut self.solver)?;
        let clock = self.solver.clock;
        if self.schedule.output_due(self.outputs.next(), clock.time) {
            self.write_output()?;
        }
        if self.schedule.checkpoint_due(clock.step, clock.time) || checkpoint {
            self.checkpoint()?;
        }
        Ok(())
    }

    /// Collective. Partitions anew if ranks have become unequal.
    fn balance(&mut self) {
        let step = self.solver.clock.step;
        if self.comm.size() > 1
            && step.is_multiple_of(BALANCE_EVERY)
            && self.solver.imbalance().0 > IMBALANCE_LIMIT
        {
            self.solver.rebalance();
        }
    }

    /// Collective. Last row, last output, report.
    fn finish(&mut self) -> Result<(), RunError> {
        let row = !self.solver.clock.step.is_multiple_of(self.problem.history_every);
        self.recorder.write(self.comm, &mut self.solver, row, true)?;
        self.write_output()?;
        self.recorder.finish(&self.solver);
        if let Some(setup) = &self.problem.report {
            let mass = self.solver.particle_totals().mass;
            let size = self.problem.size();
            let collapse = report::evaluate(self.comm, setup, size, &self.solver.chunks, mass);
            self.recorder.message(&collapse.to_string());
        }
        Ok(())
    }

    fn write_output(&mut self) -> Result<(), RunError> {
        let scalars = restart::scalars(self.comm, &self.solver, self.outputs.next() + 1);
        let view = view(self.problem, &self.solver, &self.materials, &self.histories, &scalars);
        self.outputs.write(self.comm, &view)?;
        Ok(())
    }

    fn checkpoint(&mut self) -> Result<PathBuf, RunError> {
        let scalars = restart::scalars(self.comm, &self.solver, self.outputs.next());
        let view = view(self.problem, &self.solver, &self.materials, &self.histories, &scalars);
        self.schedule.checkpoint_written(self.solver.clock.time);
        Ok(self.outputs.checkpoint(self.comm, &view, self.problem.checkpoint.keep)?)
    }
}

/// Cores that this process may use; `mpirun` binds it to some of them.
fn available_cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The state of a run as files show it.
fn view<'a, const D: usize>(
    problem: &Problem<D>,
    solver: &'a Solver<D>,
    materials: &'a [String],
    histories: &'a [String],
    scalars: &'a Scalars,
) -> View<'a, D> {
    View {
        leaves: solver.forest.leaves(),
        chunks: &solver.chunks,
        leaf_fields: &[],
        origin: problem.origin,
        root_edge: problem.root_edge,
        brick: problem.brick,
        materials,
        histories,
        job_digest: problem.digest,
        step: solver.clock.step,
        time: solver.clock.time,
        dt: solver.clock.dt,
        scalars,
    }
}
