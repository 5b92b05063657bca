//! Runs scenarios on several ranks: a test launches its own binary, where the hidden test `worker` runs the
//! scenario that an environment variable names.
use super::mpirun;
use partition::comm::is_launched;
use partition::{Comm, World};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// Function that each rank runs.
pub(crate) type Scenario = fn(&Comm);

/// Environment variable that names the scenario of a launched process.
const SCENARIO: &str = "AGIMP_TEST_SCENARIO";
/// Begins a line of output that must be the same for any number of ranks.
const RESULT: &str = "result: ";
/// Seconds after which `mpirun` ends a job that hangs.
const LIMIT: u32 = 120;

/// Prints what must not depend on the number of ranks.
pub(crate) fn report(comm: &Comm, text: impl std::fmt::Display) {
    if comm.rank() == 0 {
        println!("\n{RESULT}{text}");
    }
}

/// Entry of the launched processes: runs the scenario that was asked for, of all lists.
pub(crate) fn work(lists: &[&[(&str, Scenario)]]) {
    let Ok(name) = std::env::var(SCENARIO) else { return };
    let (_, scenario) =
        lists.iter().copied().flatten().find(|(n, _)| *n == name).expect("a scenario of this name");
    let world = World::init().expect("MPI starts");
    assert!(World::init().is_err(), "MPI starts once");
    scenario(world.comm());
}

/// Runs the scenario with each number of ranks; it must succeed and report the same.
pub(crate) fn agrees_for(scenario: &str, ranks: &[usize]) {
    if is_launched() {
        return; // somebody has started the tests themselves under mpirun
    }
    let mut first: Option<Vec<String>> = None;
    // Built without MPI there is one rank.
    for &n in ranks.iter().filter(|&&n| n == 1 || cfg!(feature = "mpi")) {
        let results = results(scenario, &launch(scenario, n));
        println!("{n} ranks: {results:#?}");
        let first = first.get_or_insert(results.clone());
        assert_eq!(*first, results, "{scenario}: {n} ranks against {}", ranks[0]);
    }
}

/// Runs the scenario in one process without `mpirun`; it must succeed.
pub(crate) fn alone(scenario: &str) {
    if is_launched() {
        return;
    }
    let this = Command::new(std::env::current_exe().expect("own path"));
    results(scenario, &mpirun::finish(&mut worker(this, scenario)));
}

/// Runs the scenario, which must end soon, with one line of explanation that names a place in `comm.rs`.
pub(crate) fn fails(scenario: &str, ranks: usize, explanation: &str) {
    if is_launched() {
        return;
    }
    let start = Instant::now();
    let output = launch(scenario, ranks);
    let duration = start.elapsed();
    let stderr = String::from_utf8_lossy(&output.stderr);
    // Output of the harness may be on the same line: some launchers make one stream of both.
    let lines: Vec<&str> = stderr.lines().filter_map(|line| Some(&line[line.find("agimp: ")?..])).collect();
    assert!(!output.status.success(), "{scenario} must fail");
    assert_eq!(lines.len(), 1, "one message in:\n{stderr}");
    let expected = format!("agimp: {explanation} (");
    assert!(lines[0].starts_with(&expected) && lines[0].contains("comm.rs:"), "{}", lines[0]);
    assert!(duration < Duration::from_secs(10), "took {duration:?} to start and end");
}

fn results(scenario: &str, output: &Output) -> Vec<String> {
    assert!(output.status.success(), "{scenario} failed\n{}", mpirun::text(output));
    let stdout = String::from_utf8_lossy(&output.stdout);
    stdout.lines().filter_map(|line| line.strip_prefix(RESULT)).map(str::to_owned).collect()
}

fn launch(scenario: &str, ranks: usize) -> Output {
    let this = std::env::current_exe().expect("this binary has a path");
    let mut command = Command::new(&this);
    if cfg!(feature = "mpi") {
        command = mpirun::command(ranks, LIMIT);
        command.arg(this);
    }
    mpirun::finish(&mut worker(command, scenario))
}

/// The worker entry of this binary.
fn worker(mut command: Command, scenario: &str) -> Command {
    command
        .args(["worker", "--exact", "--ignored", "--nocapture", "--test-threads=1"])
        .env(SCENARIO, scenario)
        .env("RAYON_NUM_THREADS", "1");
    command
}
