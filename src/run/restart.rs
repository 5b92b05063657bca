//! Restart from a file.
use std::ffi::OsStr;
use std::os::unix::ffi::{OsStrExt as _, OsStringExt as _};
use std::path::{Path, PathBuf};

use partition::Forest;
use partition::comm::Comm;

use super::{From, RunError, measures};
use crate::adaptivity::resample::ids;
use crate::boundary::{Collider, ColliderState};
use crate::exact_sum::ExactSum;
use crate::io::hdf5_file::{FileError, Reader};
use crate::io::log::progress::warn;
use crate::io::snapshot::directory::{self, Candidates};
use crate::io::snapshot::{self, AXISYMMETRIC, Header, Scalars, compare};
use crate::job::problem::Coordinates;
use crate::job::{self, Problem};
use crate::load;
use crate::particle::Chunk;
use crate::setup;
use crate::solver::balance::rebalance::cut_at;
use crate::solver::migration::crossings::Crossings;
use crate::solver::migration::fluxes::Fluxes;
use crate::solver::state::bookings::ExactSums;
use crate::solver::state::cost::leaf_weight;
use crate::solver::state::relaxation::{RelaxPhase, Relaxation};
use crate::solver::{Clock, Solver};
use crate::text::{quantity, written};

/// Name of the counter that holds the number of the next output.
pub const NEXT_OUTPUT: &str = "next_output";
/// Name of the counter that holds the step of the last output.
pub const OUTPUT_STEP: &str = "output_step";
/// Name of the counter that holds the step of the last row of the history.
pub const ROW_STEP: &str = "row_step";
const BOUND: &str = "time_step_bound";
/// Name of the counter that holds the number of stages that have begun, in jobs with stages.
const STAGES: &str = "stages";
/// Names of the counters of particles that crossed faces of the domain.
const CROSSINGS: [&str; 3] = ["put_back", "deleted", "left"];
/// Names of the masses deleted and left.
const CROSSED_MASSES: [&str; 2] = ["deleted_mass", "left_mass"];

/// Name of the counter of the solutions of seepage that did not settle.
const UNSETTLED: &str = "unsettled_heads";

/// Optional contents of output files.
pub fn options<const D: usize>(problem: &Problem<D>) -> snapshot::Options {
    let output = &problem.output;
    snapshot::Options { fields: output.fields.clone(), single: false, restart: output.restart }
}

/// Collective. Scalars that a restart needs beside those in every header.
pub fn scalars<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    solver: &Solver<D>,
    next_output: u64,
    output_step: Option<u64>,
) -> Scalars {
    let mut crossings = solver.measured.crossings.gather(comm);
    let mut counts = vec![(NEXT_OUTPUT.into(), next_output)];
    if problem.coordinates == Coordinates::Axisymmetric {
        counts.push((AXISYMMETRIC.into(), 1));
    }
    let numbers = [crossings.put_back, crossings.deleted, crossings.left];
    counts.extend(CROSSINGS.iter().map(|name| String::from(*name)).zip(numbers));
    counts.extend(output_step.map(|step| (OUTPUT_STEP.into(), step)));
    if solver.physics.seepage.is_some() {
        counts.push((UNSETTLED.into(), solver.sums.unsettled_heads));
    }
    let mut reals = vec![(BOUND.into(), solver.clock.bound)];
    let starts = &solver.physics.stage_starts;
    counts.push((STAGES.into(), starts.len() as u64));
    reals.extend((0..).zip(starts).skip(1).map(|(stage, &start)| (stage_start(stage), start)));
    let mut exact: Vec<(String, Vec<i64>)> = CROSSED_MASSES
        .iter()
        .zip(&mut crossings.masses)
        .map(|(name, sum)| ((*name).into(), sum.words().to_vec()))
        .collect();
    measures::write(comm, problem, solver, &mut reals, &mut counts, &mut exact);
    write_exact_sums("collider", &solver.contacts.sums, comm, &mut reals, &mut exact);
    write_exact_sums("source", &solver.sums.sources, comm, &mut reals, &mut exact);
    write_exact_sums("failed", &solver.sums.failed, comm, &mut reals, &mut exact);
    write_exact_sums("pore_water", &solver.sums.pores, comm, &mut reals, &mut exact);
    write_exact_sums("flow", &solver.sums.flow, comm, &mut reals, &mut exact);
    write_exact_sums("load", &solver.sums.loads, comm, &mut reals, &mut exact);
    write_exact_sums("contact", &solver.sums.bodies, comm, &mut reals, &mut exact);
    write_exact_sums("shift", &solver.sums.shifts, comm, &mut reals, &mut exact);
    write_exact_sums("shock", &solver.sums.shocks, comm, &mut reals, &mut exact);
    write_exact_sums("face", &solver.sums.faces, comm, &mut reals, &mut exact);
    if solver.physics.equilibrium.is_some() {
        let Relaxation { kinetic, speed, acceleration, stops, phase } = solver.equilibrium.relaxation;
        reals.extend(RELAXATION.iter().map(|name| String::from(*name)).zip([kinetic, speed, acceleration]));
        let phase = PHASES.iter().position(|other| *other == phase).unwrap_or_default();
        counts.extend([(STOPS.into(), stops), (PHASE.into(), phase as u64)]);
    }
    if solver.physics.adaptivity.is_none() && !solver.physics.sources.is_empty() {
        counts.push((LEDGER[3].into(), solver.adaptation.ledger.next_root));
    }
    counts.extend(
        (0..).zip(&solver.adaptation.pieces_before).map(|(body, &pieces)| (pieces_name(body), pieces)),
    );
    if solver.physics.adaptivity.is_some() {
        let ([splits, _, merges, removed], mut energies) = solver.adaptation.ledger.gather(comm);
        let numbers = [splits, merges, removed, solver.adaptation.ledger.next_root];
        counts.extend(LEDGER.iter().map(|name| String::from(*name)).zip(numbers));
        exact.extend(
            ENERGIES.iter().zip(&mut energies).map(|(name, sum)| ((*name).into(), sum.words().to_vec())),
        );
    }
    for (index, state) in solver.contacts.states.iter().enumerate() {
        // Prescribed motions follow from the time.
        if solver.physics.colliders[index].free().is_some() {
            let values = solver.physics.colliders[index].numbers(state).into_iter();
            reals.extend(values.enumerate().map(|(i, value)| (state_name(index, i), value)));
        }
    }
    Scalars { reals, counts, exact }
}

/// Name of the time at which a stage began.
fn stage_start(stage: usize) -> String {
    format!("stage_start_{stage}")
}

/// Times at which stages began. `None` if the file lacks one, or no run of the job writes them.
pub(super) fn stage_starts<const D: usize>(problem: &Problem<D>, header: &Header) -> Option<Vec<f64>> {
    let count = usize::try_from(header.scalars.count(STAGES)?).ok()?;
    if !(1..=problem.stages.len()).contains(&count) {
        return None;
    }
    let starts: Option<Vec<f64>> = (0..count)
        .map(|stage| if stage == 0 { Some(0.0) } else { header.scalars.real(&stage_start(stage)) })
        .collect();
    starts.filter(|starts| starts.is_sorted() && starts.last().is_some_and(|&last| last <= header.time))
}

/// Collective. Appends the exact sums of one kind (loads, colliders, …) over all ranks, numbered
/// consecutively.
fn write_exact_sums<const N: usize>(
    kind: &str,
    sums: &ExactSums<N>,
    comm: &Comm,
    reals: &mut Vec<(String, f64)>,
    exact: &mut Vec<(String, Vec<i64>)>,
) {
    if sums.of.is_empty() {
        return;
    }
    reals.push((format!("{kind}_sums_since"), sums.since));
    let mut totals = sums.exact_totals(comm);
    exact.extend(
        totals.iter_mut().enumerate().map(|(i, sum)| (format!("{kind}_sum_{i}"), sum.words().to_vec())),
    );
}

/// Takes over the exact sums of one kind, on rank 0. `None` if the file lacks one.
fn restore_exact_sums<const N: usize>(
    kind: &str,
    sums: &mut ExactSums<N>,
    rank: usize,
    scalars: &Scalars,
) -> Option<()> {
    if sums.of.is_empty() {
        return Some(());
    }
    sums.since = scalars.real(&format!("{kind}_sums_since"))?;
    for (number, sum) in sums.of.iter_mut().flatten().enumerate() {
        let read = ExactSum::from_words(scalars.exact(&format!("{kind}_sum_{number}"))?)?;
        if rank == 0 {
            *sum = read;
        }
    }
    Some(())
}

/// Names of the numbers of the progress towards equilibrium.
const RELAXATION: [&str; 3] = ["relaxation_kinetic_energy", "relaxation_speed", "relaxation_acceleration"];
/// Name of the counter of the times that velocities were set to 0.
const STOPS: &str = "relaxation_stops";
/// Name of the counter that holds the number of the phase in [`PHASES`].
const PHASE: &str = "relaxation_phase";
/// Phases by number.
const PHASES: [RelaxPhase; 3] = [RelaxPhase::Falling, RelaxPhase::Stopped, RelaxPhase::FromRest];

/// Takes over the progress towards equilibrium. `None` if the file lacks a number.
fn restore_relaxation<const D: usize>(solver: &mut Solver<D>, scalars: &Scalars) -> Option<()> {
    if solver.physics.equilibrium.is_none() {
        return Some(());
    }
    let [kinetic, speed, acceleration] = RELAXATION.map(|name| scalars.real(name));
    let phase = *PHASES.get(usize::try_from(scalars.count(PHASE)?).ok()?)?;
    let (kinetic, speed, acceleration, stops) = (kinetic?, speed?, acceleration?, scalars.count(STOPS)?);
    solver.equilibrium.relaxation = Relaxation { kinetic, speed, acceleration, stops, phase };
    Some(())
}

/// Name of the counter that holds in how many pieces a body was before it was stretched.
fn pieces_name(body: usize) -> String {
    format!("pieces_{body}")
}

/// Names of the counters of splits and merges.
const LEDGER: [&str; 4] = ["splits", "merges", "particles_merged_away", "next_root"];
/// Names of the energies that splits and merges have removed.
const ENERGIES: [&str; 2] = ["split_energy", "merge_energy"];

/// Takes over the ledger of splits and merges; the sums are on rank 0. `None` if the file lacks one.
fn restore_ledger<const D: usize>(rank: usize, solver: &mut Solver<D>, scalars: &Scalars) -> Option<()> {
    if solver.physics.adaptivity.is_none() {
        if !solver.physics.sources.is_empty() {
            solver.adaptation.ledger.next_root = scalars.count(LEDGER[3])?;
        }
        return Some(());
    }
    let energy = |name: &str| ExactSum::from_words(scalars.exact(name)?);
    let (split_energy, merge_energy) = (energy(ENERGIES[0])?, energy(ENERGIES[1])?);
    let [splits, merges, removed, next_root] = LEDGER.map(|name| scalars.count(name));
    let ledger = &mut solver.adaptation.ledger;
    ledger.next_root = next_root?;
    if rank == 0 {
        (ledger.splits, ledger.merges, ledger.removed) = (splits?, merges?, removed?);
        (ledger.split_energy, ledger.merge_energy) = (split_energy, merge_energy);
    }
    Some(())
}

/// Takes over the counts and masses of particles that crossed faces, on rank 0. `None` if the file lacks one.
fn restore_crossings<const D: usize>(rank: usize, solver: &mut Solver<D>, scalars: &Scalars) -> Option<()> {
    let [put_back, deleted, left] = CROSSINGS.map(|name| scalars.count(name));
    let [of_deleted, of_left] = CROSSED_MASSES.map(|name| scalars.exact(name).and_then(ExactSum::from_words));
    let masses = [of_deleted?, of_left?];
    let fluxes = Fluxes::default();
    let crossings = Crossings { put_back: put_back?, deleted: deleted?, left: left?, masses, fluxes };
    if rank == 0 {
        solver.measured.crossings = crossings;
    }
    Some(())
}

/// Name of a number of the state of a free collider (see [`crate::boundary::Collider::numbers`]).
fn state_name(collider: usize, number: usize) -> String {
    format!("collider_{collider}_state_{number}")
}

/// The state of a free collider in a file. `None` if it is not free, or the file lacks a number.
pub(super) fn collider_state<const D: usize>(
    index: usize,
    collider: &Collider<D>,
    scalars: &Scalars,
) -> Option<ColliderState<D>> {
    collider.free()?;
    collider.from_numbers(|i| scalars.real(&state_name(index, i)))
}

/// Puts the free colliders back where the file has them. `None` if the file lacks a number.
fn restore_colliders<const D: usize>(solver: &mut Solver<D>, scalars: &Scalars) -> Option<()> {
    let colliders = solver.physics.colliders.iter();
    for (index, collider) in colliders.enumerate().filter(|(_, collider)| collider.free().is_some()) {
        solver.contacts.states[index] = collider_state(index, collider, scalars)?;
    }
    Some(())
}

/// Collective. Reads the state and spreads it over the ranks. Of the files that `--restart latest` may mean,
/// the latest is taken that is whole; a warning names the others.
///
/// # Errors
/// There is no file, or none that can be trusted, or the run ends before it; the same on all ranks.
pub fn solver<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    from: &From,
) -> Result<(Solver<D>, Scalars), RunError> {
    let paths = match from {
        From::File(path) => vec![path.clone()],
        From::Latest => latest(comm, problem)?,
    };
    let mut refusal = format!(
        "found no restart file of `{}` in {}; start without --restart or name a file",
        problem.name,
        problem.output.directory.display()
    );
    let mut is_first = true;
    for path in paths {
        if !is_first && comm.rank() == 0 {
            warn(&format!("skipped: {refusal}"));
        }
        is_first = false;
        match restored(comm, problem, &path) {
            Ok((solver, scalars)) => {
                check_end(problem, &path, solver.clock)?;
                let beside = compare::verify_beside_state(comm, &path);
                if let (Err(damage), 0) = (beside, comm.rank()) {
                    warn(&format!(
                        "{}; the state is complete, and the run continues from it",
                        damage.message
                    ));
                }
                return Ok((solver, scalars));
            }
            Err(reason) => refusal = reason,
        }
    }
    Err(RunError::Refused(refusal))
}

/// A run to the end time of the job must pass through this state, or end with it.
fn check_end<const D: usize>(problem: &Problem<D>, path: &Path, clock: Clock) -> Result<(), RunError> {
    let Clock { step, time, dt, .. } = clock;
    let end = problem.time.end;
    // A run ends with the first step that reaches its end.
    if step == 0 || time - dt < end {
        return Ok(());
    }
    Err(RunError::Refused(format!(
        "{}: the file is of t = {} (step {step}), after the end of the run; found time.end = {}; expected a later end, or an earlier file",
        path.display(),
        quantity(time, "s"),
        written(end)
    )))
}

/// Collective. The state in one file, or why there is none that can be trusted.
fn restored<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    path: &Path,
) -> Result<(Solver<D>, Scalars), String> {
    let words = |error: FileError| match error {
        // The number of the rank does not matter here.
        FileError::Agreed(disagreement) => disagreement.message,
        other => other.to_string(),
    };
    let refused = |reason: &str| format!("{}: {reason}", path.display());
    check_job(comm, problem, path)?;
    let limits = snapshot::Limits { materials: problem.materials.len(), bodies: problem.bodies.len() };
    let restored = snapshot::read::<D>(comm, path, Some(problem.digest), limits).map_err(words)?;
    let carried = restored.chunks.iter().map(Chunk::carried_columns).max().unwrap_or(0);
    let expected = setup::physics(problem).carried_columns();
    let follows = expected > load::columns(&problem.loads);
    if comm.any(carried != 0 && carried != expected) {
        let reason = "particles carry loads that differ from those of the job, or displacements or strains that output.fields does not request";
        return Err(refused(reason));
    }
    if follows && restored.header.step > 0 && !comm.any(carried != 0) {
        let reason = "particles do not carry the displacements or strains that output.fields, a load or adaptivity.split_gap requests; a run follows them from its start only";
        return Err(refused(reason));
    }
    let forest = comm.agree(Forest::from_leaves(comm, problem.brick, restored.leaves));
    let mut forest = forest.map_err(|disagreement| refused(&disagreement.message))?;
    let weights: Vec<u64> = restored.chunks.iter().map(leaf_weight).collect();
    let shipment = forest.partition(comm, &weights, cut_at(problem.adaptivity.as_ref()));
    let chunks = shipment.move_items(comm, restored.chunks, Chunk::append_to, Chunk::from_bytes);
    let header = restored.header;
    check_counts::<D>(&header.scalars).map_err(|reason| refused(&reason))?;
    let clock = Clock {
        step: header.step,
        time: header.time,
        dt: header.dt,
        bound: header.scalars.real(BOUND).unwrap_or(0.0),
    };
    let starts =
        stage_starts(problem, &header).ok_or_else(|| refused("the stages of the run are missing"))?;
    let physics = setup::stages::physics(problem, &starts);
    let mut solver = Solver::new(comm, physics, forest, chunks, clock);
    // Every rank has read the same header.
    let (rank, scalars) = (comm.rank(), &header.scalars);
    restore_colliders(&mut solver, scalars)
        .and_then(|()| restore_exact_sums("collider", &mut solver.contacts.sums, rank, scalars))
        .ok_or_else(|| refused("the state of a collider is missing"))?;
    restore_exact_sums("source", &mut solver.sums.sources, rank, scalars)
        .ok_or_else(|| refused("the sums of a source are missing"))?;
    restore_exact_sums("failed", &mut solver.sums.failed, rank, scalars)
        .ok_or_else(|| refused("the sums of particles that have failed are missing"))?;
    restore_exact_sums("pore_water", &mut solver.sums.pores, rank, scalars)
        .and_then(|()| restore_exact_sums("flow", &mut solver.sums.flow, rank, scalars))
        .ok_or_else(|| refused("the sums of the water in the pores are missing"))?;
    restore_exact_sums("load", &mut solver.sums.loads, rank, scalars)
        .ok_or_else(|| refused("the sums of a load are missing"))?;
    restore_exact_sums("contact", &mut solver.sums.bodies, rank, scalars)
        .ok_or_else(|| refused("the sums of a contact between bodies are missing"))?;
    restore_exact_sums("shift", &mut solver.sums.shifts, rank, scalars)
        .ok_or_else(|| refused("the work of the shift of fluids is missing"))?;
    // A run without them may have written the file: then they begin here.
    let _ = restore_exact_sums("shock", &mut solver.sums.shocks, rank, scalars);
    let _ = restore_exact_sums("face", &mut solver.sums.faces, rank, scalars);
    restore_relaxation(&mut solver, scalars)
        .ok_or_else(|| refused("the state of the relaxation to equilibrium is missing"))?;
    restore_ledger(comm.rank(), &mut solver, &header.scalars)
        .ok_or_else(|| refused("the ledger of splits and merges is missing"))?;
    solver.sums.unsettled_heads = header.scalars.count(UNSETTLED).unwrap_or(0);
    let pieces = |body| header.scalars.count(&pieces_name(body));
    solver.adaptation.pieces_before = (0..problem.bodies.len()).map_while(pieces).collect();
    restore_crossings(comm.rank(), &mut solver, &header.scalars)
        .ok_or_else(|| refused("the counts of particles that left the domain are missing"))?;
    measures::restore(comm.rank(), problem, &mut solver, &header.scalars, path);
    Ok((solver, header.scalars))
}

/// Counters that no run reaches.
const MOST: u64 = 1 << 53;

/// Refuses counts that no run can reach, whatever the checksum of the header says.
fn check_counts<const D: usize>(scalars: &Scalars) -> Result<(), String> {
    for (name, count) in &scalars.counts {
        let most = if name == LEDGER[3] { ids::roots(D) } else { MOST };
        if *count > most {
            return Err(format!("the header has {name} = {count}; expected at most {most}"));
        }
    }
    Ok(())
}

/// Collective. Refuses a file of another job, and says which keys differ. What else may be wrong with the
/// file is found when it is read.
fn check_job<const D: usize>(comm: &Comm, problem: &Problem<D>, path: &Path) -> Result<(), String> {
    let found = if comm.rank() == 0 { differing_job(problem, path) } else { None };
    comm.agree(found.map_or(Ok(()), Err)).map_err(|disagreement| disagreement.message)
}

fn differing_job<const D: usize>(problem: &Problem<D>, path: &Path) -> Option<String> {
    let header = Header::read(&Reader::open_alone(path).ok()?).ok()?;
    if !header.restart || !snapshot::compatible(&header.program) || header.job_digest == problem.digest {
        return None;
    }
    Some(format!(
        "{}: the file belongs to another job: {} (title, output, checkpoint, history, telemetry, report and time.end \
         may differ, but nothing else)",
        path.display(),
        differing_keys(problem, path)?
    ))
}

/// The first keys that decide the state and differ between the job of a file and this one, in words. `None`
/// if the file does not hold its job in a form that can be read.
pub(super) fn differing_keys<const D: usize>(problem: &Problem<D>, path: &Path) -> Option<String> {
    let found = job::differences([&snapshot::job_text(path)?, &problem.text])?;
    let mut reasons: Vec<String> = found.iter().take(MOST_KEYS).map(ToString::to_string).collect();
    match found.len() {
        0 => reasons
            .push("the texts agree, so files that the job names or defaults of the program differ".into()),
        all if all > MOST_KEYS => reasons.push(format!("and {} more", all - MOST_KEYS)),
        _ => {}
    }
    Some(reasons.join("; "))
}

/// Keys that a message names.
const MOST_KEYS: usize = 3;

/// Collective. The files of the run that hold a state, the latest first. Rank 0 looks for them and sends the
/// list to the others. If there is none, a file of another job takes their place: the error says why it
/// cannot be used.
fn latest<const D: usize>(comm: &Comm, problem: &Problem<D>) -> Result<Vec<PathBuf>, RunError> {
    let directory = &problem.output.directory;
    let found = match comm.rank() {
        0 if directory.is_dir() => directory::candidates(directory, &problem.name, Some(problem.digest)),
        _ => Ok(Candidates::default()),
    };
    let Candidates { whole, mut damaged, other } = comm.agree(found)?;
    let mut paths: Vec<PathBuf> = whole.into_iter().map(|(path, _)| path).collect();
    if paths.is_empty() {
        paths.extend(other.filter(|_| damaged.is_empty()));
    }
    // If there is one file alone, the reason against it becomes the error.
    let only = if paths.is_empty() { damaged.pop() } else { None };
    damaged.iter().for_each(|error| warn(&format!("skipped: {error}")));
    comm.agree(only.map_or(Ok(()), Err)).map_err(|disagreement| RunError::Refused(disagreement.message))?;
    let mut bytes =
        paths.iter().map(|path| path.as_os_str()).collect::<Vec<_>>().join(OsStr::new("\0")).into_vec();
    comm.broadcast_bytes(0, &mut bytes);
    let names = bytes.split(|&byte| byte == 0).filter(|name| !name.is_empty());
    Ok(names.map(|name| PathBuf::from(OsStr::from_bytes(name))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that would overflow as soon as the run counts on.
    #[test]
    fn counters_made_with_intent_are_refused() {
        let with = |name: &str, count| Scalars { counts: vec![(name.into(), count)], ..Scalars::default() };
        for name in [NEXT_OUTPUT, OUTPUT_STEP, "splits", "next_root"].into_iter().chain(CROSSINGS) {
            assert_eq!(check_counts::<3>(&with(name, 1000)), Ok(()));
            let error = check_counts::<3>(&with(name, u64::MAX)).expect_err(name);
            assert!(error.contains(name), "{error}");
        }
    }
}
