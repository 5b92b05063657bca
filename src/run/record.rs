//! History, telemetry and progress of a run.
use std::path::Path;
use std::time::Instant;

use partition::comm::{Comm, Traffic};

use super::at_end::report::{self, Report};
use super::at_end::safety::Safety;
use super::measures::lines;
use super::{Effort, Options, RunError, Summary, history};
use crate::io::hdf5_file::FileError;
use crate::io::log::history::{Column, Gap, History, Kept};
use crate::io::log::progress::Progress;
use crate::io::log::telemetry::{Contribution, Record, Resampled, Telemetry};
use crate::job::Problem;
use crate::probe::line::Sample;
use crate::solver::diagnostics::thrust::Thrust;
use crate::solver::diagnostics::totals::{self, GridTotals, ParticleTotals};
use crate::solver::state::bookings::{FACE_SUMS, FAILED_SUMS};
use crate::solver::state::phases::Phase;
use crate::solver::{Clock, Solver};
use crate::text::{count, quantity};

/// Writes history, telemetry and messages of a run. Rank 0 holds the files, all ranks make the same calls.
pub struct Recorder<'a, const D: usize> {
    problem: &'a Problem<D>,
    history: Option<History>,
    telemetry: Option<Telemetry>,
    /// The files of lines, on rank 0.
    lines: Vec<History>,
    /// Surfaces on which the water presses, on rank 0.
    thrust: Option<Thrust<D>>,
    progress: Progress,
    /// Step of the last row of the history; the same on all ranks.
    last_row: Option<u64>,
    /// Values of the row of the present step, on rank 0, as far as they are known.
    last_values: Vec<f64>,
    /// Report of the run, as far as it is known.
    report: Report,
    began: Instant,
    since: Instant,
    since_step: u64,
    since_traffic: Traffic,
}

/// Collective. The step that rank 0 knows.
fn on_all_ranks(comm: &Comm, known: Option<u64>) -> Option<u64> {
    let mut known = [known.map_or(0, |step| step + 1)];
    comm.max_u64(&mut known);
    known[0].checked_sub(1)
}

impl<'a, const D: usize> Recorder<'a, D> {
    /// Collective. Opens new files, or goes on with those that an earlier part of the run has left, with the
    /// rows of the history that are `kept`.
    pub fn open(
        comm: &Comm,
        problem: &'a Problem<D>,
        options: &Options,
        solver: &mut Solver<D>,
        kept: Option<Kept>,
    ) -> Result<Self, RunError> {
        let Clock { step, time, .. } = solver.clock;
        let path = |suffix: &str| problem.output.directory.join(format!("{}.{suffix}", problem.name));
        let (rows, lines) = (path("history.csv"), path("telemetry.jsonl"));
        let named = history::columns(problem);
        let columns: Vec<Column<'_>> = named.iter().map(|(name, unit)| Column { name, unit }).collect();
        let files = match (comm.rank(), kept) {
            (0, None) => History::create(&rows, &columns)
                .and_then(|history| Ok(Some(((history, Vec::new()), Telemetry::create(&lines)?)))),
            (0, Some(kept)) => History::resume(&rows, &columns, 1, kept)
                .and_then(|history| Ok(Some((history, Telemetry::resume(&lines, step)?)))),
            _ => Ok(None),
        };
        let (history, telemetry) = comm.agree(files)?.unzip();
        let lines = if comm.rank() == 0 { lines::open(problem, kept) } else { Ok(Vec::new()) };
        let (lines, gaps_of_lines) = comm.agree(lines)?.into_iter().unzip();
        let (history, gaps): (Option<History>, _) = history.unzip();
        let last = history.as_ref().and_then(History::last).map(|(step, _)| step);
        let of_state = history.as_ref().and_then(History::last).filter(|(last, _)| *last == step);
        let last_values = of_state.map_or_else(Vec::new, |(_, values)| values.to_vec());
        let last_row = match kept {
            // Even if it is missing: files must not depend on damage to the history.
            Some(Kept { to, expected }) if expected == Some(to) => expected,
            _ => on_all_ranks(comm, last),
        };
        let mut recorder = Self {
            problem,
            history,
            telemetry,
            lines,
            thrust: (comm.rank() == 0 && history::has_thrust(problem)).then(|| {
                Thrust::new(&problem.colliders, problem.size(), problem.root_edge, problem.coordinates)
            }),
            progress: Progress::new(options.speaks, time, problem.time.end, options.warnings.len()),
            last_row,
            last_values,
            report: Report {
                ranks: comm.size(),
                threads: options.threads,
                warnings: options.warnings.clone(),
                ..Report::default()
            },
            began: Instant::now(),
            since: Instant::now(),
            since_step: step,
            since_traffic: solver.traffic(),
        };
        recorder.tell_gaps(&rows, gaps.unwrap_or_default(), time);
        for (line, gaps) in problem.lines.iter().zip::<Vec<Vec<Gap>>>(gaps_of_lines) {
            recorder.tell_gaps(&lines::path(problem, line), gaps, time);
        }
        recorder.prepare(solver);
        Ok(recorder)
    }

    /// Not collective. Warns of rows that a damaged file has lost. `time` is that of the state, s.
    fn tell_gaps(&mut self, rows: &Path, gaps: Vec<Gap>, time: f64) {
        for Gap { after, before } in gaps {
            let from =
                after.map_or_else(|| "the start".into(), |time| format!("t = {}", quantity(time, "s")));
            let to = quantity(before.unwrap_or(time), "s");
            self.warning(&format!(
                "{}: rows are missing from {from} to t = {to}; the file was damaged, truncated or moved",
                rows.display()
            ));
        }
    }

    /// Not collective. Has the next step measure the mass error, if its record needs it.
    fn prepare(&self, solver: &mut Solver<D>) {
        if (solver.clock.step + 1).is_multiple_of(self.problem.telemetry_every) {
            solver.weigh_next_step();
        }
    }

    /// Collective. After a step: the row and the record that are due by step number.
    pub fn after_step(&mut self, comm: &Comm, solver: &mut Solver<D>) -> Result<(), RunError> {
        let step = solver.clock.step;
        let (row, record) = (
            step.is_multiple_of(self.problem.history_every),
            step.is_multiple_of(self.problem.telemetry_every),
        );
        if row || record {
            self.write(comm, solver, row, record)?;
        }
        self.prepare(solver);
        if self.problem.quasi_static.is_some() {
            let effort = solver.equilibrium.effort;
            self.progress.effort(effort.newton, effort.linear, effort.residual);
        }
        self.progress.step(step, solver.clock.time, solver.clock.dt);
        Ok(())
    }

    /// Collective. A row of the history and a record of telemetry.
    pub fn write(
        &mut self,
        comm: &Comm,
        solver: &mut Solver<D>,
        row: bool,
        record: bool,
    ) -> Result<(), RunError> {
        // Wall time of this call counts as output, not as steps.
        let start = Instant::now();
        let mut mass_error = solver.weighed_mass_error();
        let mut written = Ok(());
        if row || mass_error.is_none() {
            let phases = solver.phases;
            let totals = self.totals(comm, solver);
            solver.phases = phases;
            let (grid, particles) = totals?;
            mass_error.get_or_insert(totals::mass_error(grid.mass, particles.mass));
            if row {
                written = self.row(comm, solver, &particles, &grid);
            }
        }
        solver.phases.book(Phase::Output, start.elapsed());
        if record {
            let record = self.record(comm, solver, mass_error.unwrap_or_default());
            self.progress.record(&record);
            if let Some(telemetry) = &mut self.telemetry {
                written = written.and_then(|()| telemetry.write(&record));
            }
        }
        comm.agree(written)?;
        if row {
            self.last_row = Some(solver.clock.step);
        }
        Ok(())
    }

    /// Not collective. Flushes all tables to disk: a state that gets its name now refers to their last rows.
    pub fn sync(&self) -> Result<(), FileError> {
        self.history.iter().chain(&self.lines).try_for_each(History::sync)?;
        self.telemetry.as_ref().map_or(Ok(()), Telemetry::sync)
    }

    /// Collective. Sums over nodes and particles of the current state.
    fn totals(
        &mut self,
        comm: &Comm,
        solver: &mut Solver<D>,
    ) -> Result<(GridTotals, ParticleTotals), RunError> {
        let before = solver.traffic();
        let grid = solver.grid_totals();
        let after = solver.traffic();
        self.since_traffic.messages += after.messages - before.messages;
        self.since_traffic.bytes += after.bytes - before.bytes;
        let grid = comm.agree(grid)?;
        Ok((grid, solver.particle_totals()))
    }

    /// Collective. Makes the values of the last row known for the report, also where an earlier part of the
    /// run has written it. If its file has lost it, they are measured anew, and means over the time since an
    /// earlier row are 0.
    pub fn recall_row(&mut self, comm: &Comm, solver: &mut Solver<D>) -> Result<(), RunError> {
        if comm.any(self.history.is_some() && self.last_values.is_empty()) {
            let (grid, particles) = self.totals(comm, solver)?;
            self.last_values = self.measure(comm, solver, &particles, &grid).0;
        }
        Ok(())
    }

    /// Collective. Writes a row of the history.
    fn row(
        &mut self,
        comm: &Comm,
        solver: &mut Solver<D>,
        particles: &ParticleTotals,
        grid: &GridTotals,
    ) -> Result<(), FileError> {
        let clock = solver.clock;
        let (values, samples) = self.measure(comm, solver, particles, grid);
        let mut written = Ok(());
        if let Some(history) = &mut self.history {
            written = history
                .row(clock.step, &values)
                .and_then(|()| lines::write(&mut self.lines, self.problem, clock, &samples));
        }
        self.last_values = values;
        // The sums restart; if the row of this step was written before, they are zero already.
        let time = solver.time_of_velocities();
        solver.forget_reactions();
        solver.sums.loads.forget(3, time);
        solver.sums.bodies.forget(3, time);
        solver.sums.faces.forget(FACE_SUMS, time);
        written
    }

    /// Collective. The values of a row of the history, on rank 0, and the samples at the points of lines.
    fn measure(
        &self,
        comm: &Comm,
        solver: &mut Solver<D>,
        particles: &ParticleTotals,
        grid: &GridTotals,
    ) -> (Vec<f64>, Vec<Vec<Sample<D>>>) {
        let problem = self.problem;
        let probes = solver.read_probes(&problem.probes);
        let tracks = solver.read_tracks(&problem.tracks);
        let passed = solver.measured.crossings.fluxes.passed(comm, &solver.chunks);
        let samples = solver.read_lines(&problem.lines);
        solver.note_maps(&problem.maps);
        let (solver, thrust) = (&*solver, self.thrust.as_ref());
        let totals = history::Totals {
            solver,
            particles: *particles,
            grid: *grid,
            crossings: solver.measured.crossings.gather(comm),
            ledger: solver.physics.adaptivity.as_ref().map(|_| solver.adaptation.ledger.total(comm)),
            shift_work: solver.shift_work(),
            shock_work: solver.shock_work(),
            sources: solver.sums.sources.totals(comm),
            failed: solver.failed_totals(),
            pores: solver.sums.pores.totals(comm),
            flows: solver.sums.flow.totals(comm),
            loads: solver.load_totals(),
            bodies: solver.body_totals(),
            probes,
            tracks,
            passed,
            faces: solver.face_forces(),
            thrust_on_faces: thrust
                .filter(|_| problem.face_forces)
                .map_or_else(Vec::new, |thrust| thrust.on_faces(solver)),
            reactions: solver.reactions(),
            thrust_on_colliders: thrust.map_or_else(Vec::new, |thrust| thrust.on_colliders(solver)),
        };
        let values = if self.history.is_some() { history::values(problem, &totals) } else { Vec::new() };
        (values, samples)
    }

    /// Collective. Speed, traffic and memory since the last record.
    fn record(&mut self, comm: &Comm, solver: &mut Solver<D>, mass_error: f64) -> Record {
        let ledger = solver.physics.adaptivity.as_ref().map(|_| solver.adaptation.ledger.total(comm));
        let phases: Vec<(&'static str, f64)> =
            Phase::ALL.iter().map(|phase| phase.name()).zip(solver.phases.seconds()).collect();
        let traffic = solver.traffic();
        let record = Record::gather(
            comm,
            &Contribution {
                step: solver.clock.step,
                time: solver.clock.time,
                dt: solver.clock.dt,
                steps: solver.clock.step - self.since_step,
                wall_seconds: self.since.elapsed().as_secs_f64(),
                phases: &phases,
                traffic: Traffic {
                    messages: traffic.messages - self.since_traffic.messages,
                    bytes: traffic.bytes - self.since_traffic.bytes,
                },
                leaves: solver.forest.leaves(),
                chunks: &solver.chunks,
                statistics: solver.statistics(),
                imbalance: solver.imbalance().0,
                possible_imbalance: solver.possible_imbalance().0,
                partitions: solver.balance.partitions,
                mass_error,
                resampled: ledger.map(|ledger| Resampled {
                    regrids: solver.adaptation.regrids,
                    splits: ledger.splits,
                    refused: ledger.refused,
                    merges: ledger.merges,
                    merged_away: ledger.removed,
                    split_energy: ledger.split_energy,
                    merge_energy: ledger.merge_energy,
                }),
            },
        );
        solver.phases.clear();
        (self.since, self.since_step, self.since_traffic) = (Instant::now(), solver.clock.step, traffic);
        record
    }

    /// Not collective. Step of the last row of the history.
    pub fn last_row(&self) -> Option<u64> {
        self.last_row
    }

    /// Not collective. Warns the user, on rank 0 alone.
    pub fn warning(&mut self, text: &str) {
        if self.history.is_some() {
            self.report.warnings.push(text.to_owned());
            self.progress.warning(text);
        }
    }

    /// Not collective. Shows a line to the user.
    pub fn message(&mut self, text: &str) {
        self.report.messages.push(text.to_owned());
        self.progress.message(text);
    }

    /// Not collective. Steps, wall time (s) and warnings of this part of the run.
    pub fn effort(&self, solver: &Solver<D>) -> Effort {
        Effort {
            steps: solver.clock.step,
            time: solver.clock.time,
            wall_seconds: self.began.elapsed().as_secs_f64(),
            particles: self.particles(),
            warnings: self.report.warnings.len(),
        }
    }

    /// Particles in the last row; known on rank 0.
    fn particles(&self) -> u64 {
        let columns = history::columns(self.problem);
        let count = columns.iter().zip(&self.last_values).find(|((name, _), _)| name == "particles");
        count.map_or(0, |(_, count)| *count as u64)
    }

    /// Not collective. Writes the report of the run, on rank 0. All results are on disk by now, so a failure
    /// is only a warning.
    pub fn report(&mut self, solver: &Solver<D>, summary: &Summary) {
        if self.history.is_none() {
            return;
        }
        let (problem, starts) = (self.problem, &solver.physics.stage_starts);
        let stages = problem.stages.iter().filter(|_| problem.stages.len() > 1).zip(starts);
        let columns = history::columns(problem).into_iter().zip(&self.last_values);
        let entry = |((name, unit), value): ((String, &str), &f64)| {
            (name, (Some(*value).filter(|value| value.is_finite()), unit.to_owned()))
        };
        let report = Report {
            program: format!("agimp {}", env!("CARGO_PKG_VERSION")),
            job: problem.name.clone(),
            digest: report::digest(problem.digest),
            end: problem.time.end,
            title: problem.title.clone(),
            steps: solver.clock.step,
            time: solver.clock.time,
            wall_seconds: self.began.elapsed().as_secs_f64(),
            particles: self.particles(),
            history: columns.map(entry).collect(),
            stages: stages.map(|(stage, start)| (stage.name.clone(), *start)).collect(),
            factor_of_safety: Safety::of(solver),
            outputs: summary.series.clone(),
            picture: summary.picture.clone().ok().flatten(),
            ..std::mem::take(&mut self.report)
        };
        if let Err(error) = report.write(&report::path(&problem.output.directory, &problem.name)) {
            self.warning(&format!("no report: {error}"));
        }
    }

    /// Collective. The run is over.
    pub fn finish(&mut self, comm: &Comm, solver: &Solver<D>) {
        self.progress.finish(solver.clock.step, solver.clock.time, solver.clock.dt);
        let crossings = solver.measured.crossings.gather(comm).to_string();
        if !crossings.is_empty() {
            self.message(&crossings);
        }
        if let Some(failed) = solver.failed_totals().as_ref().and_then(failed_line) {
            self.message(&failed);
        }
    }
}

/// One line for the end of a run about particles that have failed; `None` if none has.
fn failed_line(&[deleted, changed, mass, ..]: &[f64; FAILED_SUMS]) -> Option<String> {
    let deletion = format!("were deleted ({})", quantity(mass, "kg"));
    let parts = [(deleted, deletion), (changed, "became another material".to_owned())];
    let told = parts.iter().filter(|(number, _)| *number > 0.0);
    let told: Vec<String> = told.map(|(number, what)| format!("{} {what}", count(*number as u64))).collect();
    (!told.is_empty()).then(|| format!("particles that have failed: {}", told.join(", ")))
}
