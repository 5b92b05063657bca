//! A whole run: from a checked job to its last file.
mod claim;
pub mod history;
pub mod record;
pub mod report;
pub mod restart;
pub mod schedule;
pub mod stop;

use std::path::PathBuf;
use std::time::Instant;

use partition::comm::{Comm, Disagreement};

use self::claim::Claim;
use self::record::Recorder;
use self::report::Collapse;
use self::restart::From;
use self::schedule::Schedule;
use self::stop::StopRequest;
use crate::io::hdf5_file::FileError;
use crate::io::history::Kept;
use crate::io::picture;
use crate::io::snapshot::{Outputs, PointField, Scalars, View};
use crate::job::Problem;
use crate::setup;
use crate::solver::state::phases::Phase;
use crate::solver::{Clock, Requests, Solver, StepReport};
use crate::text::quantity;

/// How a run is started.
#[derive(Clone, Debug)]
pub struct Options {
    /// File to go on from; a new run without it.
    pub restart: Option<From>,
    /// Whether a new run may replace the results of another job, or checkpoints.
    pub overwrite: bool,
    /// Whether this process shows the progress of the run.
    pub speaks: bool,
    /// Threads of this rank.
    pub threads: usize,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// At its end time.
    Finished(Box<Summary>),
    /// On request, after writing this checkpoint.
    Stopped {
        /// The checkpoint.
        checkpoint: PathBuf,
    },
}

/// What a finished run leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Index of the output files, for ParaView.
    pub series: PathBuf,
    /// Picture of the last state, or why there is none; `Ok(None)` if the job wants none.
    pub picture: Result<Option<PathBuf>, String>,
    /// Evaluation that the job asks for.
    pub collapse: Option<Collapse>,
}

/// Why a run could not be started or finished; the same on all ranks.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The bodies of the job cannot be filled with particles.
    #[error("{0}")]
    Seed(Disagreement),
    /// Some rank failed.
    #[error(transparent)]
    Rank(#[from] Disagreement),
    /// A step failed.
    #[error("step {step}, time {}: {source}", crate::text::quantity_to(*time, "s", 7))]
    Step {
        /// Number of the step.
        step: u64,
        /// Time at its start, s.
        time: f64,
        /// Rank and reason.
        source: Disagreement,
    },
    /// Something failed after a step, while files were written.
    #[error("step {step}, time {}: {source}", crate::text::quantity_to(*time, "s", 7))]
    After {
        /// Number of steps done.
        step: u64,
        /// Time, s.
        time: f64,
        /// What failed.
        source: Box<RunError>,
    },
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// What the run was asked for cannot be done, and nothing has been written.
    #[error("{0}")]
    Refused(String),
}

impl RunError {
    /// The same with step and time, if it does not name them yet.
    fn after(self, clock: Clock) -> Self {
        match self {
            Self::Step { .. } | Self::After { .. } => self,
            other => Self::After { step: clock.step, time: clock.time, source: Box::new(other) },
        }
    }
}

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
    let outcome = run.advance(stop).map_err(|error| error.after(run.solver.clock));
    // Also after an error: the checkpoint on its way to disk is what the next run can start from.
    let settled = run.settle(true);
    let outcome = outcome?;
    settled?;
    Ok(outcome)
}

/// Names that files carry, in the order of the numbers in tags.
struct Names {
    materials: Vec<String>,
    bodies: Vec<String>,
    histories: Vec<String>,
}

impl Names {
    fn of<const D: usize>(problem: &Problem<D>, solver: &Solver<D>) -> Self {
        Self {
            materials: problem.materials.iter().map(|material| material.name.clone()).collect(),
            bodies: problem.bodies.iter().map(|body| body.name.clone()).collect(),
            histories: solver.physics.materials.iter().map(|m| m.history_names().join(" ")).collect(),
        }
    }
}

/// A run under way.
struct Run<'a, const D: usize> {
    comm: &'a Comm,
    problem: &'a Problem<D>,
    solver: Solver<D>,
    outputs: Outputs,
    schedule: Schedule,
    recorder: Recorder,
    names: Names,
    /// Step of the last output.
    output_step: Option<u64>,
    /// Until the last file has its name.
    _claim: Claim,
}

impl<'a, const D: usize> Run<'a, D> {
    /// Collective. A new run: directory, first output and first row of the history.
    fn start(comm: &'a Comm, problem: &'a Problem<D>, options: &Options) -> Result<Self, RunError> {
        let mut claim = Claim::default();
        claim.take(comm, problem)?;
        if !options.overwrite {
            claim::spare_results(comm, problem)?;
        }
        let solver = setup::solver(comm, problem).map_err(RunError::Seed)?;
        let setup = &problem.output;
        let outputs = Outputs::create(comm, &setup.directory, &problem.name, restart::options(problem))?;
        claim.take(comm, problem)?;
        let mut run = Self::with(comm, problem, options, solver, outputs, None, None, claim)?;
        run.recorder.write(comm, &mut run.solver, true, true)?;
        run.write_output(true)?;
        Ok(run)
    }

    /// Collective. Goes on from a file.
    fn resume(
        comm: &'a Comm,
        problem: &'a Problem<D>,
        options: &Options,
        from: &From,
    ) -> Result<Self, RunError> {
        let mut claim = Claim::default();
        claim.take(comm, problem)?;
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
        let output_step = scalars.count(restart::OUTPUT_STEP);
        let Clock { step, time, .. } = solver.clock;
        claim.take(comm, problem)?;
        let expected = scalars.count(restart::ROW_STEP);
        // The row of the end stays where the end stays.
        let to = expected.filter(|_| time < problem.time.end).unwrap_or(step);
        let kept = (step > 0).then_some(Kept { to, expected });
        let mut run = Self::with(comm, problem, options, solver, outputs, output_step, kept, claim)?;
        if step == 0 {
            // The history starts anew as well.
            run.recorder.write(comm, &mut run.solver, true, true)?;
        }
        Ok(run)
    }

    fn with(
        comm: &'a Comm,
        problem: &'a Problem<D>,
        options: &Options,
        mut solver: Solver<D>,
        outputs: Outputs,
        output_step: Option<u64>,
        kept: Option<Kept>,
        claim: Claim,
    ) -> Result<Self, RunError> {
        let mut recorder = Recorder::open(comm, problem, options, &mut solver, kept)?;
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
        Ok(Self {
            comm,
            problem,
            schedule: Schedule::new(problem, solver.clock.time),
            names: Names::of(problem, &solver),
            solver,
            outputs,
            recorder,
            output_step,
            _claim: claim,
        })
    }

    /// Collective. Steps until the end time is reached, or until it is asked to stop. No step is shortened to meet the
    /// end, so that a run to a later end takes the same steps.
    fn advance(&mut self, stop: &StopRequest) -> Result<Outcome, RunError> {
        let mut settled = self.is_settled();
        while self.solver.clock.time < self.problem.time.end && !settled {
            let requests = Requests { stop: stop.is_set(), checkpoint: self.schedule.wall_due() };
            let report = self.step(requests)?;
            let granted = report.granted;
            settled = report.settled;
            self.solver.regrid().map_err(|source| self.step_error(source))?;
            self.write_due(granted.checkpoint)?;
            if granted.stop {
                let checkpoint = self.checkpoint()?;
                return Ok(Outcome::Stopped { checkpoint });
            }
            if self.solver.clock.time < self.problem.time.end && !settled {
                self.solver.balance_if_due();
            }
        }
        Ok(Outcome::Finished(Box::new(self.finish()?)))
    }

    /// Not collective. Whether the equilibrium is reached that the job asks for.
    fn is_settled(&self) -> bool {
        let solver = &self.solver;
        solver.physics.equilibrium.is_some_and(|asked| solver.relaxation.is_settled(&asked))
    }

    /// Not collective. Says how the way to equilibrium has ended.
    fn tell_equilibrium(&mut self) {
        if self.problem.equilibrium.is_none() {
            return;
        }
        let (Clock { step, time, .. }, way) = (self.solver.clock, self.solver.relaxation);
        let time = quantity(time, "s");
        if self.is_settled() {
            self.recorder.message(&format!("equilibrium at t = {time} (step {step}): {way}"));
        } else {
            self.recorder.warning(&format!("no equilibrium until the end, t = {time}: {way}"));
        }
    }

    fn step(&mut self, requests: Requests) -> Result<StepReport, RunError> {
        let clock = self.solver.clock;
        let report = self.solver.step(f64::INFINITY, requests);
        report.map_err(|source| RunError::Step { step: clock.step, time: clock.time, source })
    }

    fn step_error(&self, source: Disagreement) -> RunError {
        RunError::Step { step: self.solver.clock.step, time: self.solver.clock.time, source }
    }

    /// Collective. Writes what is due after a step.
    fn write_due(&mut self, checkpoint: bool) -> Result<(), RunError> {
        self.recorder.after_step(self.comm, &mut self.solver)?;
        let clock = self.solver.clock;
        if clock.step.is_multiple_of(self.problem.telemetry_every) {
            self.settle(false)?;
        }
        if self.schedule.output_due(self.outputs.next(), clock.time) {
            self.write_output(true)?;
        }
        if self.schedule.checkpoint_due(clock.step, clock.time) || checkpoint {
            self.checkpoint()?;
        }
        Ok(())
    }

    /// Collective. Last output, last row, picture, evaluation.
    fn finish(&mut self) -> Result<Summary, RunError> {
        let step = self.solver.clock.step;
        // State before row: a run with a later end has no row at this step, and can go on from here.
        if self.output_step != Some(step) {
            self.write_output(false)?;
        }
        if !self.problem.output.restart {
            // The end state, to compare it or to go on from with a later end time.
            self.checkpoint()?;
        }
        let row = self.recorder.last_row() != Some(step);
        self.recorder.write(self.comm, &mut self.solver, row, true)?;
        self.recorder.finish(self.comm, &self.solver);
        self.tell_equilibrium();
        let picture = self.picture();
        let collapse = self.problem.report.as_ref().map(|setup| {
            let mass = self.solver.particle_totals().mass;
            report::evaluate(self.comm, setup, self.problem.size(), &self.solver.chunks, mass)
        });
        Ok(Summary { series: self.outputs.series().to_owned(), picture, collapse })
    }

    /// Collective. Draws the last state. All results are on disk by now, so a failure is only a message.
    fn picture(&self) -> Result<Option<PathBuf>, String> {
        let problem = self.problem;
        if !problem.output.picture {
            return Ok(None);
        }
        let plastic = self.solver.physics.materials.iter().any(|material| material.is_plastic());
        let usual = if plastic { PointField::PlasticStrain } else { PointField::Speed };
        let field = problem.output.picture_field.unwrap_or(usual);
        let title = if problem.title.is_empty() { &problem.name } else { &problem.title };
        let path = problem.output.directory.join(format!("{}.png", problem.name));
        let scalars = Scalars::default();
        let view = view(problem, &self.solver, &self.names, &scalars);
        picture::draw(self.comm, &view, field, &picture::Settings::new(title), &path)
            .map_err(|error| error.to_string())?;
        Ok(Some(path))
    }

    /// Collective. Writes the next output. One that `is_due` by its time keeps its number; any other is written because the
    /// run ends here, and the next output of a run that goes on takes its place.
    fn write_output(&mut self, is_due: bool) -> Result<(), RunError> {
        let start = Instant::now();
        let step = Some(self.solver.clock.step);
        let next = self.outputs.next() + u64::from(is_due);
        let scalars = self.scalars(next, step);
        let fields = self.leaf_fields();
        let view = view(self.problem, &self.solver, &self.names, &scalars);
        let view = View { leaf_fields: &fields, ..view };
        self.comm.agree(self.recorder.sync())?;
        self.outputs.write(self.comm, &view)?;
        if !is_due {
            self.outputs.give_back_number();
        }
        self.output_step = step;
        self.solver.phases.book(Phase::Output, start.elapsed());
        Ok(())
    }

    /// Collective. What a state holds beside particles and tree.
    fn scalars(&self, next_output: u64, output_step: Option<u64>) -> Scalars {
        let mut scalars = restart::scalars(self.comm, &self.solver, next_output, output_step);
        scalars.counts.extend(self.recorder.last_row().map(|step| (restart::ROW_STEP.into(), step)));
        scalars
    }

    /// Collective. Fields of leaves for the file of the tree.
    fn leaf_fields(&mut self) -> Vec<(String, Vec<f64>)> {
        let refinement = self.solver.refinement();
        refinement.map_or_else(Vec::new, |refinement| {
            vec![
                ("refinement_indicator".into(), refinement.urgency),
                ("wanted_level".into(), refinement.wanted),
            ]
        })
    }

    /// Collective. Gives the last checkpoint its name if it is on disk, or waits for that. The rows that it implies are
    /// on disk before.
    fn settle(&mut self, wait: bool) -> Result<(), RunError> {
        if self.outputs.is_pending() && (wait || self.outputs.is_on_disk(self.comm)) {
            let synced = self.comm.agree(self.recorder.sync());
            // The checkpoint counts for more than rows: without them a run can still go on from it.
            self.outputs.settle(self.comm)?;
            synced?;
        }
        Ok(())
    }

    fn checkpoint(&mut self) -> Result<PathBuf, RunError> {
        let start = Instant::now();
        self.settle(true)?;
        let scalars = self.scalars(self.outputs.next(), self.output_step);
        let view = view(self.problem, &self.solver, &self.names, &scalars);
        let path = self.outputs.checkpoint(self.comm, &view, self.problem.checkpoint.keep)?;
        self.schedule.checkpoint_written(self.solver.clock.time);
        self.solver.phases.book(Phase::Output, start.elapsed());
        Ok(path)
    }
}

/// Cores that this process may use; `mpirun` binds it to some of them.
fn available_cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The state of a run as files show it.
fn view<'a, const D: usize>(
    problem: &'a Problem<D>,
    solver: &'a Solver<D>,
    names: &'a Names,
    scalars: &'a Scalars,
) -> View<'a, D> {
    View {
        leaves: solver.forest.leaves(),
        chunks: &solver.chunks,
        leaf_fields: &[],
        origin: problem.origin,
        root_edge: problem.root_edge,
        brick: problem.brick,
        materials: &names.materials,
        bodies: &names.bodies,
        histories: &names.histories,
        job_digest: problem.digest,
        job_text: &problem.text,
        step: solver.clock.step,
        time: solver.clock.time,
        dt: solver.clock.dt,
        scalars,
    }
}
