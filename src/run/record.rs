//! History, telemetry and progress of a run.
use std::time::Instant;

use partition::comm::{Comm, Traffic};

use super::{Options, RunError, history};
use crate::io::hdf5_file::FileError;
use crate::io::history::{Column, Gap, History, Kept};
use crate::io::progress::Progress;
use crate::io::telemetry::{Contribution, Record, Resampled, Telemetry};
use crate::job::Problem;
use crate::solver::diagnostics::totals::{self, GridTotals, ParticleTotals};
use crate::solver::state::phases::Phase;
use crate::solver::{Clock, Solver};
use crate::text::quantity;

/// Writes history, telemetry and messages of a run. Rank 0 holds the files, all ranks make the same calls.
pub struct Recorder {
    history: Option<History>,
    telemetry: Option<Telemetry>,
    progress: Progress,
    /// Lower corner of the domain, m.
    origin: Vec<f64>,
    /// Whether the history has columns of the way to equilibrium, and of the stage.
    has: [bool; 2],
    history_every: u64,
    telemetry_every: u64,
    /// Step of the last row of the history; the same on all ranks.
    last_row: Option<u64>,
    since: Instant,
    since_step: u64,
    since_traffic: Traffic,
}

/// Collective. What rank 0 knows.
fn on_all_ranks(comm: &Comm, known: Option<u64>) -> Option<u64> {
    let mut known = [known.map_or(0, |step| step + 1)];
    comm.max_u64(&mut known);
    known[0].checked_sub(1)
}

impl Recorder {
    /// Collective. Opens new files, or goes on with those that an earlier part of the run has left, with the rows of the
    /// history that are `kept`.
    pub fn open<const D: usize>(
        comm: &Comm,
        problem: &Problem<D>,
        options: &Options,
        solver: &mut Solver<D>,
        kept: Option<Kept>,
    ) -> Result<Self, RunError> {
        let Clock { step, time, .. } = solver.clock;
        let path = |suffix: &str| problem.output.directory.join(format!("{}.{suffix}", problem.name));
        let (rows, lines) = (path("history.csv"), path("telemetry.jsonl"));
        let has = [problem.has_equilibrium(), problem.stages.len() > 1];
        let named = history::columns(
            &solver.physics.loads,
            &solver.physics.colliders,
            solver.physics.adaptivity.is_some(),
            has,
        );
        let columns: Vec<Column<'_>> = named.iter().map(|(name, unit)| Column { name, unit }).collect();
        let files = match (comm.rank(), kept) {
            (0, None) => History::create(&rows, &columns)
                .and_then(|history| Ok(Some(((history, Vec::new()), Telemetry::create(&lines)?)))),
            (0, Some(kept)) => History::resume(&rows, &columns, kept)
                .and_then(|history| Ok(Some((history, Telemetry::resume(&lines, step)?)))),
            _ => Ok(None),
        };
        let (history, telemetry) = comm.agree(files)?.unzip();
        let (history, gaps): (Option<History>, _) = history.unzip();
        let last = history.as_ref().and_then(History::last_step);
        let last_row = match kept {
            // Even if it is missing: files must not depend on damage to the history.
            Some(Kept { to, expected }) if expected == Some(to) => expected,
            _ => on_all_ranks(comm, last),
        };
        let mut recorder = Self {
            history,
            telemetry,
            progress: Progress::new(options.speaks, time, problem.time.end),
            origin: problem.origin.to_vec(),
            has,
            history_every: problem.history_every,
            telemetry_every: problem.telemetry_every,
            last_row,
            since: Instant::now(),
            since_step: step,
            since_traffic: solver.traffic(),
        };
        for Gap { after, before } in gaps.into_iter().flatten() {
            let from =
                after.map_or_else(|| "the start".into(), |time| format!("t = {}", quantity(time, "s")));
            let to = quantity(before.unwrap_or(time), "s");
            recorder.warning(&format!(
                "{}: rows are missing from {from} to t = {to}; the file was damaged, cut or moved",
                rows.display()
            ));
        }
        recorder.prepare(solver);
        Ok(recorder)
    }

    /// Not collective. Has the next step note what its record needs.
    fn prepare<const D: usize>(&self, solver: &mut Solver<D>) {
        if (solver.clock.step + 1).is_multiple_of(self.telemetry_every) {
            solver.weigh_next_step();
        }
    }

    /// Collective. After a step: what is due by step number.
    pub fn after_step<const D: usize>(
        &mut self,
        comm: &Comm,
        solver: &mut Solver<D>,
    ) -> Result<(), RunError> {
        let step = solver.clock.step;
        let (row, record) =
            (step.is_multiple_of(self.history_every), step.is_multiple_of(self.telemetry_every));
        if row || record {
            self.write(comm, solver, row, record)?;
        }
        self.prepare(solver);
        self.progress.step(step, solver.clock.time, solver.clock.dt);
        Ok(())
    }

    /// Collective. A row of the history and a record of telemetry.
    pub fn write<const D: usize>(
        &mut self,
        comm: &Comm,
        solver: &mut Solver<D>,
        row: bool,
        record: bool,
    ) -> Result<(), RunError> {
        // What this takes counts as output, not as steps.
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

    /// Not collective. Brings what is written to disk: a state that gets its name now says which row was the last.
    pub fn sync(&self) -> Result<(), FileError> {
        self.history.as_ref().map_or(Ok(()), History::sync)?;
        self.telemetry.as_ref().map_or(Ok(()), Telemetry::sync)
    }

    /// Collective. Sums over nodes and particles of the current state.
    fn totals<const D: usize>(
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

    /// Collective. Writes a row of the history.
    fn row<const D: usize>(
        &mut self,
        comm: &Comm,
        solver: &mut Solver<D>,
        particles: &ParticleTotals,
        grid: &GridTotals,
    ) -> Result<(), FileError> {
        let clock = solver.clock;
        let reactions = solver.reactions();
        let loads = solver.load_totals();
        let crossings = solver.crossings.gather(comm);
        let ledger = solver.physics.adaptivity.as_ref().map(|_| solver.ledger.total(comm));
        let mut written = Ok(());
        if let Some(history) = &mut self.history {
            let mut values = history::row(clock.time, clock.dt, particles, grid, &crossings);
            if let Some(ledger) = &ledger {
                values.extend(history::ledger_values(ledger));
            }
            if self.has[0] {
                values.extend(history::relaxation_values(&solver.relaxation));
            }
            if self.has[1] {
                values.push((solver.physics.stage() + 1) as f64);
            }
            loads.iter().for_each(|load| values.extend(history::load_values::<D>(load)));
            let all = solver.physics.colliders.iter().zip(&solver.contacts.states).zip(&reactions);
            for ((collider, state), reaction) in all {
                values.extend(history::collider_values(collider, state, reaction, &self.origin));
            }
            written = history.row(clock.step, &values);
        }
        // Where the row of this step has been written already, there is nothing to forget.
        solver.forget_reactions();
        solver.load_sums.forget(3, clock.time);
        written
    }

    /// Collective. Speed, traffic and memory since the last record.
    fn record<const D: usize>(&mut self, comm: &Comm, solver: &mut Solver<D>, mass_error: f64) -> Record {
        let ledger = solver.physics.adaptivity.as_ref().map(|_| solver.ledger.total(comm));
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
                partitions: solver.partitions,
                mass_error,
                resampled: ledger.map(|ledger| Resampled {
                    regrids: solver.regrids,
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
            self.progress.warning(text);
        }
    }

    /// Not collective. Shows a line to the user.
    pub fn message(&mut self, text: &str) {
        self.progress.message(text);
    }

    /// Collective. The run is over.
    pub fn finish<const D: usize>(&mut self, comm: &Comm, solver: &Solver<D>) {
        self.progress.finish(solver.clock.step, solver.clock.time, solver.clock.dt);
        let crossings = solver.crossings.gather(comm).to_string();
        if !crossings.is_empty() {
            self.message(&crossings);
        }
    }
}
