//! Starts scenarios under `mpirun`.

use std::process::{Command, Output};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use partition::Comm;

/// Environment variable that names the scenario a launched process runs.
pub const SCENARIO: &str = "PARTITION_TEST_SCENARIO";
/// Begins a line of output that must be the same for any number of ranks.
const RESULT: &str = "result: ";
/// Seconds after which `mpirun` ends a job that hangs.
const LIMIT: &str = "100";

/// One launch at a time: more would only compete for the same cores.
static ONE_LAUNCH: Mutex<()> = Mutex::new(());

/// Prints what must not depend on the number of ranks.
pub fn report(comm: &Comm, text: impl std::fmt::Display) {
    if comm.rank() == 0 {
        println!("\n{RESULT}{text}");
    }
}

/// Runs the scenario with each number of ranks; it must succeed and report the same.
pub fn agrees_for(scenario: &str, ranks: &[usize]) {
    if already_distributed() {
        return;
    }
    let mut first: Option<Vec<String>> = None;
    for &n in ranks {
        let results = results(scenario, &launch(scenario, n).0);
        assert_eq!(
            *first.get_or_insert(results.clone()),
            results,
            "{scenario}: {n} ranks against {}",
            ranks[0]
        );
    }
}

/// Runs the scenario in one process without `mpirun`; it must succeed.
pub fn alone(scenario: &str) {
    if already_distributed() {
        return;
    }
    let output = command(&[]).env(SCENARIO, scenario).output().expect("this binary runs");
    results(scenario, &output);
}

/// Runs the scenario, which must end soon, with one line of explanation.
pub fn fails(scenario: &str, ranks: usize, explanation: &str) {
    if already_distributed() {
        return;
    }
    let (output, duration) = launch(scenario, ranks);
    let stderr = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<&str> = stderr.lines().filter(|line| line.starts_with("agimp: ")).collect();
    assert!(!output.status.success(), "{scenario} must fail");
    assert_eq!(lines.len(), 1, "one message in:\n{stderr}");
    let expected = format!("agimp: {explanation} (");
    assert!(lines[0].starts_with(&expected) && lines[0].contains("comm.rs:"), "{}", lines[0]);
    assert!(duration < Duration::from_secs(10), "took {duration:?} to start and end");
}

fn results(scenario: &str, output: &Output) -> Vec<String> {
    let stdout = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{scenario} failed\n{stdout}\n{stderr}");
    stdout.lines().filter_map(|line| line.strip_prefix(RESULT)).map(str::to_owned).collect()
}

fn launch(scenario: &str, ranks: usize) -> (Output, Duration) {
    let _guard = ONE_LAUNCH.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let start = Instant::now();
    let output = command(&["mpirun", "-n", &ranks.to_string(), "--oversubscribe", "--bind-to", "none"])
        .env(SCENARIO, scenario)
        .env("MPIEXEC_TIMEOUT", LIMIT)
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OMPI_MCA_io", "^ompio")
        .output()
        .expect("mpirun is installed");
    (output, start.elapsed())
}

/// The worker entry of this binary, started by `launcher` if there is one.
fn command(launcher: &[&str]) -> Command {
    let this = std::env::current_exe().expect("this binary has a path");
    let mut command = match launcher {
        [] => Command::new(this),
        [program, arguments @ ..] => {
            let mut command = Command::new(program);
            command.args(arguments).arg(this);
            command
        }
    };
    command.args(["worker", "--exact", "--ignored", "--nocapture", "--test-threads=1"]);
    command
}

/// Whether somebody has started the tests themselves under `mpirun`.
fn already_distributed() -> bool {
    std::env::var_os("OMPI_COMM_WORLD_SIZE").is_some()
}
