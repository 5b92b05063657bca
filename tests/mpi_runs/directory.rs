//! Runs that share a directory: no two at once, and no results destroyed that nobody has given up.
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::in_turn;
use crate::common::launch::{
    Outcome, Running, by_rank, contents, file, job, last_step, reasons, run, signal, succeed, text, variant,
};

const NAME: &str = "collapse_2d";

/// Starts a run that must be refused with exit code 2 and one message with these words, and change nothing.
fn refused(directory: &Path, ranks: usize, job: &Path, arguments: &[&str], words: &[&str]) {
    let before = contents(&directory.join("out").join(NAME));
    let output = Running::start(&mut run(directory, ranks, 1, job, arguments)).finish_soon();
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(2), "{shown}");
    assert_eq!(reasons(&shown).len() + shown.matches("error:").count(), 1, "one message: {shown}");
    for word in words {
        assert!(shown.contains(word), "'{word}' is missing: {shown}");
    }
    assert!(contents(&directory.join("out").join(NAME)) == before, "a refused run changed files: {shown}");
}

/// The job with a checkpoint after each step; stopped on request.
fn stopped(directory: &Path, ranks: usize, steps: u64) -> PathBuf {
    let often = variant(directory, "often", ("every_steps = 20", "every_steps = 1"));
    let mut running = Running::start(&mut run(directory, ranks, 1, &often, &["--quiet"]));
    running.wait_for_step(directory, NAME, steps);
    running.ranks().into_iter().for_each(|rank| signal(rank, "TERM"));
    let output = running.finish();
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    often
}

#[test]
fn one_run_at_a_time() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    let job = job(NAME);
    let mut running = Running::start(&mut run(directory, 1, 1, &job, &["--quiet"]));
    running.wait_for_step(directory, NAME, 3);
    // Held still, so that it does not end meanwhile.
    signal(running.launcher(), "STOP");
    let holder = format!("process {} on host ", running.launcher());
    for arguments in [&["--overwrite"][..], &["--restart", "latest"], &[]] {
        let output = Running::start(&mut run(directory, 2, 1, &job, arguments)).finish_soon();
        let shown = text(&output);
        assert_eq!(output.status.code(), Some(2), "{shown}");
        assert_eq!(shown.matches("agimp:").count(), 1, "one message: {shown}");
        for word in ["out/collapse_2d/collapse_2d.lock: found another run that writes here", &holder] {
            assert!(shown.contains(word), "'{word}' is missing: {shown}");
        }
    }
    signal(running.launcher(), "CONT");
    assert!(running.finish().status.success());
    let whole = Outcome::read(directory, NAME);
    assert!(!whole.files.iter().any(|file| file.ends_with(".lock")), "{:?}", whole.files);

    // A run that was killed leaves the file, which is in nobody's way.
    let killed = tempfile::tempdir().expect("temporary directory");
    let mut running = Running::start(&mut run(killed.path(), 1, 1, &job, &["--quiet"]));
    running.wait_for_step(killed.path(), NAME, 60);
    signal(running.launcher(), "KILL");
    running.finish();
    assert!(file(killed.path(), NAME, ".lock").exists());
    succeed(&mut run(killed.path(), 2, 1, &job, &["--quiet", "--restart", "latest"]));
    Outcome::read(killed.path(), NAME).assert_same(&whole, "killed");
}

/// Programs that no launcher has started share no folder that each of them removes: Open MPI 4 has one for
/// all, where one that ends would take it from another that starts (one start in a hundred failed). Open MPI 5
/// has one for each and leaves those around it.
#[test]
fn runs_alone_share_no_folder() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let temporary = home.path().join("temporary");
    let job = variant(home.path(), "short", ("end = 0.05", "end = 1e-6"));
    succeed(run(home.path(), 1, 1, &job, &["--quiet"]).env("TMPDIR", &temporary));
    let left = std::fs::read_dir(&temporary).map(|mut entries| entries.next().is_some());
    assert!(left.unwrap_or(true), "the folders made in {} are gone", temporary.display());
}

#[test]
fn a_forgotten_restart_destroys_nothing() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    let often = stopped(directory, 1, 30);
    let last = last_step(directory, NAME);
    let words = ["collapse_2d.checkpoint_0000000", "--restart latest", "--overwrite"];
    refused(directory, 1, &often, &[], &words);
    refused(directory, 2, &job(NAME), &[], &words);
    let other = variant(directory, "other", ("friction_angle = 29.5", "friction_angle = 35"));
    refused(directory, 2, &other, &["--quiet"], &words);
    refused(directory, 1, &often, &["--restart", "latest", "--overwrite"], &["cannot be used with"]);

    // Even then the checkpoints of the other sand stay, but for those whose names the run needs (here after
    // 20 steps).
    let of_the_first = |name: &String| name.contains("checkpoint_") && !name.contains("_000000020.");
    let before = contents(&directory.join("out").join(NAME));
    assert!(before.keys().filter(|name| of_the_first(name)).count() >= 2);
    let mut running = Running::start(&mut run(directory, 2, 1, &other, &["--quiet", "--overwrite"]));
    running.wait_for_step(directory, NAME, last.max(45) + 15);
    running.ranks().into_iter().for_each(|rank| signal(rank, "KILL"));
    running.finish();
    let behind = contents(&directory.join("out").join(NAME));
    for (name, bytes) in before.iter().filter(|(name, _)| of_the_first(name)) {
        assert!(behind.get(name) == Some(bytes), "{name} of another job is gone");
    }
    // Each job goes on from its own.
    succeed(&mut run(directory, 1, 1, &other, &["--quiet", "--restart", "latest"]));
}

#[test]
fn results_of_another_job_are_not_replaced_unasked() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    let write = |folder: &str, change: (&str, &str)| {
        let path = variant(directory, folder, ("every_steps = 20\nkeep = 2", "every_time = 1"));
        let text = std::fs::read_to_string(&path).expect("job").replace("end = 0.05", "end = 0.01");
        std::fs::write(&path, text.replace(change.0, change.1)).expect("written");
        path
    };
    let first = write("first", ("", ""));
    let other = write("other", ("young = 3e5", "young = 4e5"));
    succeed(&mut run(directory, 1, 1, &first, &["--quiet"]));
    // The same job may be run again: its results are the same.
    succeed(&mut run(directory, 1, 1, &first, &["--quiet"]));
    let words = ["another job", "output.directory", "--overwrite"];
    let which = ["another job: `materials[0].young` is 300000.0 there and 400000.0 here; choose another"];
    refused(directory, 2, &other, &[], &which);
    refused(directory, 2, &other, &[], &words);
    succeed(&mut run(directory, 2, 1, &other, &["--quiet", "--overwrite"]));
    refused(directory, 1, &first, &[], &words);
}

/// A host on which another file system has the place of the results is named. Left out where the system
/// grants no mounts.
#[test]
fn a_host_without_the_directory_is_named() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    std::fs::create_dir(home.path().join("out")).expect("made");
    let elsewhere = |command: &str| {
        format!("unshare -m -u sh -c 'hostname elsewhere && mount -t tmpfs none out && {command}'")
    };
    let allowed = Command::new("sh").args(["-c", &elsewhere("true")]).current_dir(home.path()).output();
    if !allowed.is_ok_and(|output| output.status.success()) {
        eprintln!("passed over: no mounts here");
        return;
    }
    let start = format!("{} run {} --quiet --threads 1", env!("CARGO_BIN_EXE_agimp"), job(NAME).display());
    for restart in [false, true] {
        if restart {
            succeed(&mut run(home.path(), 1, 1, &job(NAME), &["--quiet", "--end", "0.005"]));
        }
        let start = if restart { format!("{start} --restart latest") } else { start.clone() };
        let mut command = by_rank(home.path(), [&start, &elsewhere(&start)]);
        let output = Running::start(&mut command).finish_soon();
        let shown = text(&output);
        assert_eq!(output.status.code(), Some(2), "{shown}");
        let words = "out/collapse_2d: host elsewhere does not see this directory as rank 0 does";
        assert_eq!(shown.matches(words).count(), 1, "{shown}");
    }
}
