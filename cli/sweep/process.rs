//! Directory and process of one run of a sweep.
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

use super::one::{Arguments, Run, finished};
use crate::Failure;
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::directory::{AtStake, at_stake, candidates};
use agimp::run::at_end::report;
use agimp::run::stop::{STOPPED, StopRequest};

/// Time between two polls of a run.
const BETWEEN_LOOKS: Duration = Duration::from_millis(20);

/// How a run has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    Finished,
    /// On request.
    Stopped,
    /// Why, in a few words.
    Failed(&'static str),
}

/// Contents of the directory of an unfinished run.
#[derive(Debug, PartialEq, Eq)]
enum Held {
    /// Nothing that could be lost, or files that `agimp run` names.
    Nothing,
    /// A state of this job, from which a run continues.
    State,
    /// A result of another job.
    OtherJob(PathBuf),
}

/// Contents of the directory of a run of the job `name`.
fn held(run: &Run, name: &str) -> Result<Held, FileError> {
    if !run.directory.is_dir() {
        return Ok(Held::Nothing);
    }
    let found = candidates(&run.directory, name, Some(run.digest))?;
    if !found.whole.is_empty() {
        return Ok(Held::State);
    }
    if let Some(path) = found.other {
        return Ok(Held::OtherJob(path));
    }
    Ok(match at_stake(&run.directory, name, run.digest)? {
        Some(AtStake::OtherJob(path)) => Held::OtherJob(path),
        _ => Held::Nothing,
    })
}

/// Refuses a sweep that would replace results of another job.
pub(super) fn spare_results(runs: &[Run], name: &str) -> Result<(), Failure> {
    for run in runs.iter().filter(|run| finished(&report::path(&run.directory, name), run).is_none()) {
        if let Held::OtherJob(path) = held(run, name).map_err(|error| Failure::Run(error.to_string()))? {
            return Err(Failure::Usage(format!(
                "{}: found a result of another job (keys that affect the state differ); choose another directory with --out, or replace \
                 its results with --overwrite",
                path.display()
            )));
        }
    }
    Ok(())
}

/// Runs a run to its end, from its latest state if it was interrupted. A request to stop is passed on to it.
pub(super) fn start(
    arguments: &Arguments,
    run: &Run,
    name: &str,
    stop: &StopRequest,
) -> Result<Ended, Failure> {
    let go = |how: &[&str]| {
        command(arguments, run, how)
            .and_then(|command| wait(command, stop))
            .map_err(|error| Failure::Run(format!("cannot start a run: {error}")))
    };
    let anew: &[&str] = if arguments.overwrite { &["--overwrite"] } else { &[] };
    let code = match held(run, name).map_err(|error| Failure::Run(error.to_string()))? {
        Held::State => match go(&["--restart", "latest"])? {
            // It cannot continue from there, as with an earlier end.
            Some(2) if arguments.overwrite && !stop.is_set() => go(anew)?,
            code => code,
        },
        _ => go(anew)?,
    };
    Ok(match code {
        Some(0) => Ended::Finished,
        _ if stop.is_set() || code == Some(i32::from(STOPPED)) => Ended::Stopped,
        Some(2) => Ended::Failed("it was refused (agimp sweep --overwrite starts it again)"),
        Some(_) => Ended::Failed("see its message"),
        None => Ended::Failed("something has killed it"),
    })
}

/// The command of a run.
fn command(arguments: &Arguments, run: &Run, how: &[&str]) -> Result<Command, std::io::Error> {
    let program = std::env::current_exe()?;
    let mut words = arguments.launch.split_whitespace();
    let mut command = match words.next() {
        Some(first) => {
            let mut command = Command::new(first);
            command.args(words).arg(program);
            // Ctrl-C in a terminal reaches all of its group, and a launcher would kill its ranks at once.
            command.process_group(0);
            command
        }
        None => Command::new(program),
    };
    command.arg("run").arg(&arguments.job).args(how);
    command.args(run.settings.iter().flat_map(|setting| ["--set", setting]));
    command.arg("--out").arg(&run.directory);
    if let Some(threads) = arguments.threads {
        command.args(["--threads", &threads.to_string()]);
    }
    command.arg("--quiet").stdin(Stdio::null());
    Ok(command)
}

/// Waits for a process. A request to stop is passed on to the process, by the one signal that launchers pass
/// on to their ranks. Returns its exit code, if it has one.
fn wait(mut command: Command, stop: &StopRequest) -> std::io::Result<Option<i32>> {
    let mut child = command.spawn()?;
    let mut is_told = false;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status.code());
        }
        if stop.is_set() && !std::mem::replace(&mut is_told, true) {
            // It may have ended just now.
            let _ = kill_process(Pid::from_child(&child), Signal::USR1);
        }
        std::thread::sleep(BETWEEN_LOOKS);
    }
}
