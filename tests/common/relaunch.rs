//! Runs a test of this binary again under `mpirun`: MPI starts once per process, so each number of ranks is a
//! process group of its own.
use std::process::Command;
use std::sync::Mutex;

use partition::comm::{Comm, World};

/// What a process prints that has found the test it was started for.
const STARTED: &str = "this process runs the test";

/// Runs `body` on one thread if this process is one of those that [`relaunch`] started; says whether it is.
pub fn ran_if_launched(body: impl Fn(&Comm)) -> bool {
    if std::env::var_os("OMPI_COMM_WORLD_SIZE").is_none() {
        return false;
    }
    println!("{STARTED}");
    let world = World::init().expect("MPI starts");
    // One thread that works is enough, as ranks share the cores.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    pool.build_global().expect("threads start once");
    body(world.comm());
    true
}

/// Runs a test of this binary on a number of ranks; it must succeed within `seconds`. Returns what it printed.
pub fn relaunch(test: &str, ranks: usize, seconds: u32) -> String {
    // One launch at a time: more would only compete for the same cores.
    static ONE_LAUNCH: Mutex<()> = Mutex::new(());
    let _guard = ONE_LAUNCH.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let output = Command::new("mpirun")
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("MPIEXEC_TIMEOUT", seconds.to_string())
        .args(["--oversubscribe", "--bind-to", "none", "-n", &ranks.to_string()])
        .arg(std::env::current_exe().expect("own path"))
        .args(["--exact", test, "--include-ignored", "--nocapture", "--test-threads=1"])
        .output()
        .expect("mpirun starts");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{test} on {ranks} ranks:\n{text}");
    assert!(text.contains(STARTED), "no test is called {test}:\n{text}");
    text.into_owned()
}
