//! Restart from a file.
use std::ffi::OsStr;
use std::os::unix::ffi::{OsStrExt as _, OsStringExt as _};
use std::path::{Path, PathBuf};

use partition::Forest;
use partition::comm::Comm;

use super::{From, RunError, measures};
use crate::adaptivity::resample::ids;
use crate::adaptivity::resample::ledger::NEXT_ROOT;
use crate::io::hdf5_file::{FileError, Reader};
use crate::io::log::progress::warn;
use crate::io::snapshot::directory::{self, Candidates};
use crate::io::snapshot::{self, AXISYMMETRIC, Header, Scalars, compare};
use crate::job::problem::Coordinates;
use crate::job::{self, Problem};
use crate::load;
use crate::particle::Chunk;
use crate::saved::Saved;
use crate::setup;
use crate::solver::balance::rebalance::cut_at;
use crate::solver::state::cost::leaf_weight;
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

/// Optional contents of output files.
pub fn options<const D: usize>(problem: &Problem<D>) -> snapshot::Options {
    let output = &problem.output;
    snapshot::Options { fields: output.fields.clone(), single: false, restart: output.restart }
}

/// Collective. Scalars that a restart needs beside those in every header.
pub fn scalars<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    solver: &mut Solver<D>,
    next_output: u64,
    output_step: Option<u64>,
) -> Scalars {
    let mut saved = Saved::to_file(comm);
    save(problem, solver, &mut saved);
    let mut scalars = saved.into_scalars();
    scalars.counts.push((NEXT_OUTPUT.into(), next_output));
    scalars.counts.extend(output_step.map(|step| (OUTPUT_STEP.into(), step)));
    if problem.coordinates == Coordinates::Axisymmetric {
        scalars.counts.push((AXISYMMETRIC.into(), 1));
    }
    let starts = &solver.physics.stage_starts;
    scalars.counts.push((STAGES.into(), starts.len() as u64));
    scalars.reals.push((BOUND.into(), solver.clock.bound));
    scalars.reals.extend((0..).zip(starts).skip(1).map(|(stage, &start)| (stage_start(stage), start)));
    scalars
}

/// Collective to a file. The state and what is measured.
fn save<const D: usize>(problem: &Problem<D>, solver: &mut Solver<D>, saved: &mut Saved<'_>) {
    solver.save(problem.bodies.len(), saved);
    measures::save(problem, solver, saved);
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
    measures::begin(problem, &mut solver);
    // Every rank has read the same header.
    let mut saved = Saved::from_file(&header.scalars, comm.rank() == 0);
    save(problem, &mut solver, &mut saved);
    if let Some(name) = saved.missing() {
        return Err(refused(&format!("the header has no {name}, with which a run of this job goes on")));
    }
    measures::read_maps(problem, &mut solver, path);
    Ok((solver, header.scalars))
}

/// Counters that no run reaches.
const MOST: u64 = 1 << 53;

/// Refuses counts that no run can reach, whatever the checksum of the header says.
fn check_counts<const D: usize>(scalars: &Scalars) -> Result<(), String> {
    for (name, count) in &scalars.counts {
        let most = if name == NEXT_ROOT { ids::roots(D) } else { MOST };
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
        for name in [NEXT_OUTPUT, OUTPUT_STEP, "splits", NEXT_ROOT, "deleted"] {
            assert_eq!(check_counts::<3>(&with(name, 1000)), Ok(()));
            let error = check_counts::<3>(&with(name, u64::MAX)).expect_err(name);
            assert!(error.contains(name), "{error}");
        }
    }
}
