//! A whole run: from a checked job to its last file.
//!
//! | file or folder | content |
//! |---|---|
//! | this | the main loop |
//! | `outcome.rs` | options of a run, its results, and why it cannot go on |
//! | [`claim`] | the directory of a run belongs to one run at a time |
//! | [`cores`] | cores of the machines, and how many threads fit |
//! | [`restart`] | states from files |
//! | `room.rs` | check of the memory of the machines |
//! | [`schedule`], [`stop`] | when files are due; requests to stop |
//! | `files.rs`, `names.rs`, [`scene`] | outputs, checkpoints and pictures; names in them; colliders in pictures |
//! | [`record`], [`history`] | history, telemetry and progress |
//! | `measures/` | files of lines and maps |
//! | [`at_end`] | results at the end of a run |
pub mod at_end;
pub mod claim;
pub mod cores;
mod files;
pub mod history;
mod measures;
mod names;
mod outcome;
pub mod record;
pub mod restart;
mod room;
pub mod scene;
pub mod schedule;
pub mod stop;

use std::time::{Duration, Instant};

use partition::comm::{Comm, Disagreement};

use self::at_end::ending::Ending;
use self::at_end::safety::Safety;
use self::at_end::{ending, report};
use self::claim::Claim;
use self::cores::Cores;
use self::names::Names;
pub use self::outcome::{Effort, From, Options, Outcome, RunError, Summary};
use self::record::Recorder;
use self::room::Room;
use self::scene::{Draw, Pictures};
use self::schedule::Schedule;
use self::stop::StopRequest;
use crate::io::log::history::Kept;
use crate::io::snapshot::{Outputs, directory};
use crate::job::{AnyProblem, Problem};
use crate::setup::{self, stages};
use crate::solver::{Clock, Requests, Solver, StepReport};
use crate::text::{count, quantity};

/// Wall time from which a request to stop ends a run that is still making its first state. Until then it goes
/// on to a first step, whose checkpoint a queue can continue from.
const LONG_START: Duration = Duration::from_secs(5);

/// Collective. Runs a job to its end, or until it is asked to stop. `pictures` draws its last state if the
/// job wants a picture of it. Not generic, so that a program does not compile the solver anew.
///
/// # Errors
/// The same on all ranks.
pub fn run(
    comm: &Comm,
    problem: &AnyProblem,
    options: &Options,
    stop: &StopRequest,
    pictures: Option<Pictures<'_>>,
) -> Result<Outcome, RunError> {
    match problem {
        AnyProblem::Two(problem) => whole(comm, problem, options, stop, pictures.map(|all| all.two)),
        AnyProblem::Three(problem) => whole(comm, problem, options, stop, pictures.map(|all| all.three)),
    }
}

fn whole<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    options: &Options,
    stop: &StopRequest,
    draw: Option<&Draw<D>>,
) -> Result<Outcome, RunError> {
    let mut run = match &options.restart {
        None => Run::start(comm, problem, options, stop)?,
        Some(from) => Run::resume(comm, problem, options, from)?,
    };
    run.draw = draw;
    let outcome = run.advance(stop).map_err(|error| error.after(run.solver.clock));
    // Also after an error: the checkpoint on its way to disk is what the next run can start from.
    let settled = run.settle(true);
    let outcome = outcome.and_then(|outcome| settled.map(|()| outcome));
    run.note_end(&outcome);
    outcome
}

/// A run under way.
struct Run<'a, const D: usize> {
    comm: &'a Comm,
    problem: &'a Problem<D>,
    solver: Solver<D>,
    outputs: Outputs,
    schedule: Schedule,
    recorder: Recorder<'a, D>,
    names: Names,
    draw: Option<&'a Draw<D>>,
    /// Step of the last output.
    output_step: Option<u64>,
    /// Until the last file has its name.
    _claim: Claim,
}

impl<'a, const D: usize> Run<'a, D> {
    /// Collective. A new run: directory, first output and first row of the history.
    fn start(
        comm: &'a Comm,
        problem: &'a Problem<D>,
        options: &Options,
        stop: &StopRequest,
    ) -> Result<Self, RunError> {
        let mut claim = Claim::default();
        claim.take(comm, problem)?;
        if !options.overwrite {
            claim::spare_results(comm, problem)?;
        }
        let room = Room::of_machines(comm, options.speaks);
        room.check(comm, problem)?;
        let began = Instant::now();
        let gives_up = || stop.is_set() && began.elapsed() > LONG_START;
        let solver = setup::solver_within(comm, problem, |size| match comm.any(gives_up()) {
            true => Err(RunError::Stopped),
            false => room.fits(problem, size).map_err(RunError::Refused),
        });
        let mut solver = solver.map_err(RunError::Seed)??;
        measures::begin(problem, &mut solver);
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
        // In another directory there is no row of this run yet.
        let expected = scalars.count(restart::ROW_STEP).filter(|_| from.is_in(&problem.output.directory));
        // If the run ends with this state, the row of its end stays.
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
        if comm.rank() == 0 {
            // A report of an earlier end would be taken for one of this end.
            let _ = std::fs::remove_file(report::path(&problem.output.directory, &problem.name));
            let _ = std::fs::remove_file(ending::path(&problem.output.directory, &problem.name));
            directory::remove_unfinished(&problem.output.directory, &problem.name);
        }
        let cores = Cores::survey(comm);
        recorder.message(&format!(
            "{}: {} ranks x {} threads on {cores}, {} leaves",
            problem.name,
            comm.size(),
            options.threads,
            solver.forest.global_len()
        ));
        if let Some(warning) = cores.shared(comm, options.threads) {
            recorder.message(&format!("warning: {warning}"));
        }
        Ok(Self {
            comm,
            problem,
            schedule: Schedule::new(problem, solver.clock.time),
            names: Names::of(problem, &solver),
            solver,
            outputs,
            recorder,
            draw: None,
            output_step,
            _claim: claim,
        })
    }

    /// Collective. Steps until the end time is reached, or until it is asked to stop. No step is shortened to
    /// hit the end, so that a run to a later end takes the same steps.
    fn advance(&mut self, stop: &StopRequest) -> Result<Outcome, RunError> {
        while !self.is_over() {
            if self.stage_is_over() {
                self.next_stage()?;
            }
            let requests = Requests { stop: stop.is_set(), checkpoint: self.schedule.wall_due() };
            let before = self.solver.clock.step;
            let granted = self.step(requests)?.granted;
            if self.solver.clock.step == before {
                // The last step of a search for the factor of safety leaves the state as it is.
                continue;
            }
            self.solver.regrid().map_err(|source| self.step_error(source))?;
            self.write_due(granted.checkpoint)?;
            if granted.stop {
                let checkpoint = self.checkpoint()?;
                return Ok(Outcome::Stopped { checkpoint });
            }
            if !self.is_over() && !self.stage_is_over() {
                self.solver.balance_if_due();
            }
        }
        Ok(Outcome::Finished(Box::new(self.finish()?)))
    }

    /// Not collective. Whether the equilibrium is reached that the job asks for.
    fn is_settled(&self) -> bool {
        let solver = &self.solver;
        solver.physics.equilibrium.is_some_and(|asked| solver.equilibrium.relaxation.is_settled(&asked))
    }

    /// Not collective. Whether the stage under way has reached its end; the same on all ranks.
    fn stage_is_over(&self) -> bool {
        let physics = &self.solver.physics;
        let begun = physics.stage_starts.last().copied().unwrap_or(0.0);
        let duration = self.problem.stages[physics.stage()].duration;
        self.is_settled() || self.solver.clock.time - begun >= duration
    }

    /// Not collective. When the stage or the run ends or an output is due, s, after the present time: the
    /// only bound on steps without material.
    fn next_event(&self) -> f64 {
        let (time, physics) = (self.solver.clock.time, &self.solver.physics);
        let begun = physics.stage_starts.last().copied().unwrap_or(0.0);
        let stage = begun + self.problem.stages[physics.stage()].duration;
        let next = stage.min(self.problem.time.end).min(self.schedule.next_output(time));
        // The sum may be rounded down.
        next.max(time.next_up())
    }

    /// Not collective. Whether the run has reached its end; the same on all ranks.
    fn is_over(&self) -> bool {
        let is_last = self.solver.physics.stage() + 1 == self.problem.stages.len();
        let is_found = self.solver.factor_without_equilibrium().is_some();
        self.solver.clock.time >= self.problem.time.end || is_found || is_last && self.stage_is_over()
    }

    /// Collective. Ends the stage under way with an output and a row of the history, and begins the next one.
    fn next_stage(&mut self) -> Result<(), RunError> {
        self.tell_equilibrium();
        let step = self.solver.clock.step;
        if self.output_step != Some(step) {
            self.write_output(true)?;
        }
        if self.recorder.last_row() != Some(step) {
            self.recorder.write(self.comm, &mut self.solver, true, false)?;
        }
        let [come, met] =
            stages::enter_next(self.comm, self.problem, &mut self.solver).map_err(RunError::Seed)?;
        let (physics, time) = (&self.solver.physics, quantity(self.solver.clock.time, "s"));
        let (number, all) = (physics.stage() + 1, self.problem.stages.len());
        let name = &self.problem.stages[physics.stage()].name;
        self.recorder
            .message(&format!("stage {number} of {all}, {name}, starts at t = {time} (step {step})"));
        if met > 0 {
            self.recorder.warning(&format!(
                "stage {name}: {met} of {come} particles come to places that other material takes, and are pushed apart; let it move away first, or remove it"
            ));
        }
        Ok(())
    }

    /// Not collective. Tells the user whether equilibrium was reached.
    fn tell_equilibrium(&mut self) {
        let Some(asked) = self.solver.physics.equilibrium else { return };
        let (Clock { step, time, .. }, way) = (self.solver.clock, self.solver.equilibrium.relaxation);
        let time = quantity(time, "s");
        if self.is_settled() {
            self.recorder.message(&format!("equilibrium at t = {time} (step {step}): {way}"));
        } else {
            let what = if self.problem.stages.len() > 1 { "of the stage" } else { "of the run" };
            let [speed, acceleration] = [(asked.speed, "m/s"), (asked.acceleration, "m/s²")]
                .map(|(bound, unit)| quantity(bound, unit));
            self.recorder.warning(&format!(
                "no equilibrium by the end {what}, t = {time}: {way}; expected at most {speed} and {acceleration}. Where stops go on and these do not \
                 fall, particles that cross cells keep them up: expect no less, or use finer cells; what has still to fall is stopped with the rest"
            ));
        }
    }

    /// Not collective. Tells the user the factor of safety, in a stage that looks for it.
    fn tell_safety(&mut self) {
        let Some(safety) = Safety::of(&self.solver) else { return };
        self.recorder.message(&safety.to_string());
    }

    /// Collective. Warns of sources whose material came where other material lay.
    fn tell_blocked_sources(&mut self) {
        for (source, [fed, met]) in self.problem.sources.iter().zip(self.solver.fed_totals()) {
            if met > 0 {
                self.recorder.warning(&format!(
                    "source {}: {} of {} particles came to places that other material took, and were pushed apart; expected that what it feeds moves away: a longer way ahead of it, a lower rate, or an earlier end",
                    source.name,
                    count(met),
                    count(fed)
                ));
            }
        }
    }

    /// Not collective. Warns of heads of seepage that were not found.
    fn tell_unsettled_heads(&mut self) {
        let times = self.solver.sums.unsettled_heads;
        if times > 0 {
            self.recorder.warning(&format!(
                "water.seepage: {} of its solutions did not settle: the free surface still moved, or the heads had not converged; expected ground that is connected to a head, permeabilities that differ less, or finer cells",
                count(times)
            ));
        }
    }

    /// Not collective. Warns of stages that the run has not reached.
    fn tell_missed_stages(&mut self) {
        let missed: Vec<&str> = self
            .problem
            .stages
            .iter()
            .skip(self.solver.physics.stage() + 1)
            .map(|stage| &*stage.name)
            .collect();
        if !missed.is_empty() {
            self.recorder
                .warning(&format!("the run ended at time.end before these stages: {}", missed.join(", ")));
        }
    }

    /// Collective. Says which bodies have been stretched so far that particles were halved, and which of them
    /// have torn.
    fn tell_torn(&mut self) {
        if !self.solver.physics.has_halves {
            return;
        }
        let mut halved = [self.solver.adaptation.ledger.halved];
        self.comm.sum_u64(&mut halved);
        if halved[0] > 0 {
            self.recorder.message(&format!(
                "{} particles of elastic bodies were stretched so far that they became two",
                halved[0]
            ));
        }
        let pieces = self.solver.pieces().unwrap_or_default();
        let bodies = self.problem.bodies.iter().zip(&self.solver.adaptation.pieces_before).zip(&pieces);
        for ((body, before), now) in bodies.filter(|((_, before), now)| now > before) {
            self.recorder.warning(&format!(
                "body \"{}\" is in {now} pieces, {before} before it was stretched: boxes of its particles no longer \
                 touch. That is numerical, unless its law softens (hencky, beyond a stretch of 2.7): more \
                 particles_per_cell or finer cells carry it further",
                body.name
            ));
        }
    }

    /// Not collective. Records why a run ends ahead of its time, on rank 0. The user is told in any case, so
    /// a failure to write the record is ignored.
    fn note_end(&self, outcome: &Result<Outcome, RunError>) {
        let Clock { step, time, .. } = self.solver.clock;
        let ending = match outcome {
            Ok(Outcome::Finished(_)) => return,
            Ok(Outcome::Stopped { .. }) => Ending::stopped(step, time),
            Err(error) => Ending::failed(error, step, time),
        };
        if self.comm.rank() == 0 {
            let _ = ending.write(&ending::path(&self.problem.output.directory, &self.problem.name));
        }
    }

    fn step(&mut self, requests: Requests) -> Result<StepReport, RunError> {
        let clock = self.solver.clock;
        // Load steps end where something is due, so that it shows the loads of its time.
        let is_free = clock.bound.is_finite() && self.solver.physics.quasi_static.is_none();
        let end = if is_free { f64::INFINITY } else { self.next_event() };
        let report = self.solver.step(end, requests);
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
        if self.schedule.output_due(clock.time) {
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
        // The state comes before the row: a run with a later end has no row at this step, and can continue
        // from here.
        if self.output_step != Some(step) {
            self.write_output(false)?;
        }
        if !self.problem.output.restart {
            // The end state, to compare it or to go on from with a later end time.
            self.checkpoint()?;
        }
        let row = self.recorder.last_row() != Some(step);
        self.recorder.write(self.comm, &mut self.solver, row, true)?;
        self.recorder.recall_row(self.comm, &mut self.solver)?;
        self.recorder.finish(self.comm, &self.solver);
        self.tell_equilibrium();
        self.tell_safety();
        self.tell_missed_stages();
        self.tell_blocked_sources();
        self.tell_unsettled_heads();
        self.tell_torn();
        let picture = self.picture();
        let summary = Summary {
            effort: self.recorder.effort(&self.solver),
            last_output: self.outputs.last(),
            series: self.outputs.series().to_owned(),
            picture,
            is_still: self.problem.quasi_static.is_some(),
        };
        self.recorder.report(&self.solver, &summary);
        Ok(summary)
    }
}
