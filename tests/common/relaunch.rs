//! Runs a test of this binary again under `mpirun`: MPI starts once per process, so each number of ranks is a
//! process group of its own.
use super::mpirun;
use partition::comm::{Comm, World, is_launched};

/// Line that a process prints once it has found the test it was started for.
const STARTED: &str = "this process runs the test";

/// Runs `body` on one thread if this process is one of those that [`relaunch`] started; says whether it is.
pub(crate) fn ran_if_launched(body: impl Fn(&Comm)) -> bool {
    if !is_launched() {
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

/// Runs a test of this binary on a number of ranks; it must succeed within `seconds`. Returns what it
/// printed. `module` is the `module_path!()` of the test.
pub(crate) fn relaunch(module: &str, test: &str, ranks: usize, seconds: u32) -> String {
    let test = &full_name(module, test);
    let mut command = mpirun::command(ranks, seconds);
    command.arg(std::env::current_exe().expect("own path")).args([
        "--exact",
        test,
        "--include-ignored",
        "--nocapture",
        "--test-threads=1",
    ]);
    let output = mpirun::finish(&mut command);
    let text = mpirun::text(&output);
    assert!(output.status.success(), "{test} on {ranks} ranks:\n{text}");
    assert!(text.contains(STARTED), "no test is called {test}:\n{text}");
    text
}

/// The name by which `--exact` knows a test of a module: its path without the crate.
pub(crate) fn full_name(module: &str, test: &str) -> String {
    match module.split_once("::") {
        Some((_, inside)) => format!("{inside}::{test}"),
        None => test.to_owned(),
    }
}
