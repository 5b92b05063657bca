//! The one place where tests start ranks.
#![allow(dead_code, reason = "each test uses its part")]
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Ends a launch that hangs, s.
const TIMEOUT: &str = "MPIEXEC_TIMEOUT";

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
        .env(TIMEOUT, seconds.to_string());
    command
}

/// Whether a command is one of [`command`].
pub(crate) fn is_launch(command: &Command) -> bool {
    command.get_envs().any(|(name, _)| name == TIMEOUT)
}

/// Whether `mpirun` is that of MPICH.
pub(crate) fn is_mpich() -> bool {
    let output = Command::new("mpirun").arg("--version").output().expect("mpirun");
    text(&output).contains("HYDRA")
}

/// The turn of several ranks, of which one set runs at a time in this process: those of two share the cores,
/// and wait for ranks that have none.
pub(crate) fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs a command of [`command`] to its end, in its turn.
pub(crate) fn finish(command: &mut Command) -> Output {
    let _turn = turn();
    command.output().expect("bash starts")
}

/// Both streams of a process, for messages.
pub(crate) fn text(output: &Output) -> String {
    (String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr)).into_owned()
}
