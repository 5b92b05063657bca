//! Runs a test of this binary again under `mpirun`: MPI starts once per process, so each number of ranks is a
//! process group of its own.
use std::process::Command;
use std::sync::Mutex;

/// Whether this process is one of those that [`relaunch`] started.
pub fn is_launched() -> bool {
    std::env::var_os("OMPI_COMM_WORLD_SIZE").is_some()
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
        .args(["--exact", test, "--nocapture", "--test-threads=1"])
        .output()
        .expect("mpirun starts");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{test} on {ranks} ranks:\n{text}");
    text.into_owned()
}
