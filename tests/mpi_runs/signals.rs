//! Signals of batch systems and terminals, and what nobody listens to.
use std::fs::File;
use std::os::unix::ffi::OsStrExt as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::common::in_turn;
use crate::common::launch::{Running, agimp, job, run, signal, succeed, text};
use crate::common::mpirun::{environment, is_mpich};

const NAME: &str = "collapse_2d";

fn stops_with_a_checkpoint(running: Running, directory: &Path, what: &str) {
    let output = running.finish_soon();
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(3), "{what}: {shown}");
    let words = "agimp: stopped on request; continue with --restart ";
    let checkpoint = shown.lines().find_map(|line| line.strip_prefix(words)).expect("message");
    assert!(directory.join(checkpoint).exists(), "{what}: {shown}");
}

/// Whether this process ignores SIGHUP, as under `nohup`; what it starts does so too.
fn hangups_are_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 1 == 1)
}

/// A lost terminal (HUP), queues (TERM, USR1, USR2), the limit on processor time (XCPU), Ctrl-C (INT).
#[test]
fn each_signal_stops_a_run_with_a_checkpoint() {
    let _turn = in_turn();
    for name in ["TERM", "USR1", "USR2", "XCPU", "HUP", "INT"] {
        if name == "HUP" && hangups_are_ignored() {
            println!("these tests were started with hangups ignored, which runs respect");
            continue;
        }
        let home = tempfile::tempdir().expect("temporary directory");
        let mut running = Running::start(&mut run(home.path(), 1, 1, &job(NAME), &["--quiet"]));
        running.wait_for_step(home.path(), NAME, 9);
        signal(running.launcher(), name);
        stops_with_a_checkpoint(running, home.path(), name);
    }
    // `mpirun` of Open MPI hands on both; that of MPICH dies of the second.
    let handed_on: &[&str] = if is_mpich() { &["USR1"] } else { &["USR1", "USR2"] };
    for name in handed_on {
        let home = tempfile::tempdir().expect("temporary directory");
        let mut running = Running::start(&mut run(home.path(), 2, 1, &job(NAME), &["--quiet"]));
        running.wait_for_step(home.path(), NAME, 9);
        signal(running.launcher(), name);
        stops_with_a_checkpoint(running, home.path(), name);
    }
}

/// A signal that comes before MPI has started: the run begins, takes a step and stops.
#[test]
fn a_signal_at_the_very_start_is_not_lost() {
    let _turn = in_turn();
    for name in ["USR1", "TERM"] {
        let home = tempfile::tempdir().expect("temporary directory");
        let running = Running::start(&mut run(home.path(), 1, 1, &job(NAME), &["--quiet"]));
        // Until then it is the loader of the operating system that runs.
        while !catches(running.launcher(), 10) {
            std::thread::sleep(Duration::from_micros(200));
        }
        signal(running.launcher(), name);
        stops_with_a_checkpoint(running, home.path(), name);
    }
}

/// A run that refines its first tree for a long time ends soon, too: between two levels, without a file, or with
/// the checkpoint of its first step.
#[test]
fn a_signal_while_the_first_tree_is_refined_is_heard() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let path = home.path().join("fine.toml");
    let job = "version = 1\ndimension = 2\n[domain]\nsize = [1.6, 0.8]\nroot_edge = 0.4\n[boundaries]\ny_min.kind = 'slip'\n\
                [[adaptivity.criteria]]\nkind = 'free_surface'\nlevel = 13\n\
                [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.3\n\
                [[bodies]]\nname = 'b'\nmaterial = 'm'\nshape = { kind = 'box', min = [0.2, 0.1], max = [0.5, 0.3] }\n\
                [time]\nend = 1e-6\n[output]\npicture = false\n";
    std::fs::write(&path, job).expect("job");
    let running = Running::start(&mut run(home.path(), 2, 1, &path, &["--quiet"]));
    // Until then there is nobody whom `mpirun` could hand it to.
    while running.ranks().len() < 2 || !running.ranks().iter().all(|&rank| catches(rank, 10)) {
        std::thread::sleep(Duration::from_millis(5));
    }
    signal(running.launcher(), "USR1");
    let output = running.finish_soon();
    let shown = text(&output);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{shown}");
    let is_early = shown.contains("stopped on request before the first step, and nothing is written");
    let files = std::fs::read_dir(home.path().join("out/fine")).into_iter().flatten().flatten();
    let outputs = files.filter(|file| file.path().extension().is_some_and(|ending| ending == "hdf")).count();
    assert!(is_early == (outputs == 0), "{outputs} outputs: {shown}");
}

/// Whether the process has a handler for the signal of this number.
fn catches(process: u32, number: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("process");
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).expect("mask");
    u64::from_str_radix(mask.trim(), 16).expect("digits") >> (number - 1) & 1 == 1
}

/// `nohup` has the process ignore the hangup, and so it goes on.
#[test]
fn nohup_is_respected() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let mut command = Command::new("bash");
    let script = "source \"$2\"; trap '' HUP; exec \"$0\" run \"$1\" --quiet --threads 1";
    command.current_dir(home.path()).args(["-c", script, env!("CARGO_BIN_EXE_agimp")]);
    command.arg(job(NAME)).arg(environment());
    let mut running = Running::start(&mut command);
    running.wait_for_step(home.path(), NAME, 9);
    signal(running.launcher(), "HUP");
    let output = running.finish();
    assert!(output.status.success(), "{}", text(&output));
}

/// Whether anybody takes the last words of a complete run does not matter.
#[test]
fn nobody_needs_to_listen() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let full = File::options().write(true).open("/dev/full").expect("/dev/full");
    let mut command = run(home.path(), 1, 1, &job("few_leaves"), &[]);
    let status = command.stdout(full).stderr(Stdio::null()).status().expect("started");
    assert_eq!(status.code(), Some(0), "no space for the last words");

    let home = tempfile::tempdir().expect("temporary directory");
    let mut command = run(home.path(), 1, 1, &job("few_leaves"), &[]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    drop((child.stdout.take(), child.stderr.take()));
    assert_eq!(child.wait().expect("child").code(), Some(0), "closed pipes");
}

/// Names that are no UTF-8: results cannot be named after such a job, but states may have any name.
#[test]
fn names_that_are_not_utf_8() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let named = |bytes: &[u8]| home.path().join(std::ffi::OsStr::from_bytes(bytes));
    let bad = named(b"caf\xe9.toml");
    std::fs::copy(job("few_leaves"), &bad).expect("copied");
    let output = Running::start(&mut run(home.path(), 2, 1, &bad, &[])).finish_soon();
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(2), "{shown}");
    assert_eq!(shown.matches("found a file name that is not UTF-8").count(), 1, "{shown}");
    assert!(!home.path().join("out").exists());

    succeed(&mut run(home.path(), 1, 1, &job("few_leaves"), &["--quiet"]));
    let state = named(b"\xe9tat.hdf");
    std::fs::copy(home.path().join("out/few_leaves/few_leaves_000001.hdf"), &state).expect("copied");
    succeed(agimp(home.path()).arg("info").arg(&state));
    let mut command = run(home.path(), 2, 1, &job("few_leaves"), &["--quiet", "--restart"]);
    succeed(command.arg(&state));
}
