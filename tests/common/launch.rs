//! Starts scenarios under `mpirun`: a test launches its own binary, where the hidden test `worker` runs the
//! scenario that an environment variable names.
use partition::{Comm, World};
use std::process::{Command, Output};
use std::sync::Mutex;

/// What each rank runs.
pub type Scenario = fn(&Comm);

/// Environment variable that names the scenario of a launched process.
const SCENARIO: &str = "AGIMP_TEST_SCENARIO";
/// Begins a line of output that must be the same for any number of ranks.
const RESULT: &str = "result: ";
/// Seconds after which `mpirun` ends a job that hangs.
const LIMIT: &str = "120";

/// One launch at a time: more would only compete for the same cores.
static ONE_LAUNCH: Mutex<()> = Mutex::new(());

/// Prints what must not depend on the number of ranks.
pub fn report(comm: &Comm, text: impl std::fmt::Display) {
    if comm.rank() == 0 {
        println!("\n{RESULT}{text}");
    }
}

/// Entry of the launched processes.
pub fn work(scenarios: &[(&str, Scenario)]) {
    let Ok(name) = std::env::var(SCENARIO) else { return };
    let (_, scenario) = scenarios.iter().find(|(n, _)| *n == name).expect("a scenario of this name");
    let world = World::init().expect("MPI starts");
    scenario(world.comm());
}

/// Runs the scenario with each number of ranks; it must succeed and report the same.
pub fn agrees_for(scenario: &str, ranks: &[usize]) {
    if std::env::var_os("OMPI_COMM_WORLD_SIZE").is_some() {
        return; // somebody has started the tests themselves under mpirun
    }
    let mut first: Option<Vec<String>> = None;
    for &n in ranks {
        let results = results(scenario, &launch(scenario, n));
        println!("{n} ranks: {results:#?}");
        let first = first.get_or_insert(results.clone());
        assert_eq!(*first, results, "{scenario}: {n} ranks against {}", ranks[0]);
    }
}

fn results(scenario: &str, output: &Output) -> Vec<String> {
    let stdout = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{scenario} failed\n{stdout}\n{stderr}");
    stdout.lines().filter_map(|line| line.strip_prefix(RESULT)).map(str::to_owned).collect()
}

fn launch(scenario: &str, ranks: usize) -> Output {
    let _guard = ONE_LAUNCH.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let this = std::env::current_exe().expect("this binary has a path");
    Command::new("mpirun")
        .args(["-n", &ranks.to_string(), "--oversubscribe", "--bind-to", "none"])
        .arg(this)
        .args(["worker", "--exact", "--ignored", "--nocapture", "--test-threads=1"])
        .env(SCENARIO, scenario)
        .env("MPIEXEC_TIMEOUT", LIMIT)
        .env("RAYON_NUM_THREADS", "1")
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OMPI_MCA_io", "^ompio")
        .output()
        .expect("mpirun is installed")
}
