//! The one place where tests start ranks.
#![allow(dead_code, reason = "each test uses its part")]
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;

/// `jobs/environment`, which has the settings of `mpirun`.
pub(crate) fn environment() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let of_the_workspace = |folder: &Path| Some(folder.join("jobs/environment")).filter(|path| path.exists());
    of_the_workspace(package)
        .or_else(|| of_the_workspace(package.parent()?))
        .expect("the tests run in the workspace")
}

/// `mpirun` for that many ranks, which may share cores; what follows is the program with its arguments. The
/// process becomes `mpirun`, so that its identifier and signals are those of the launcher. Ended after
/// `seconds`.
pub(crate) fn command(ranks: usize, seconds: u32) -> Command {
    let mut command = Command::new("bash");
    command
        .args(["-c", r#"source "$0" && exec mpirun --bind-to none "$@""#])
        .arg(environment())
        .args(["-n", &ranks.to_string()])
        .env("MPIEXEC_TIMEOUT", seconds.to_string());
    command
}

/// Whether `mpirun` is that of MPICH.
pub(crate) fn is_mpich() -> bool {
    let output = Command::new("mpirun").arg("--version").output().expect("mpirun");
    text(&output).contains("HYDRA")
}

/// Runs a command of [`command`] to its end. One at a time in this process: more would only compete for the
/// same cores.
pub(crate) fn finish(command: &mut Command) -> Output {
    static ONE_LAUNCH: Mutex<()> = Mutex::new(());
    let _guard = ONE_LAUNCH.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    command.output().expect("bash starts")
}

/// Both streams of a process, for messages.
pub(crate) fn text(output: &Output) -> String {
    (String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr)).into_owned()
}
