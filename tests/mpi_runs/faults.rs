//! When one rank fails, all end, soon and with one message; what is on disk stays good.
use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::in_turn;
use crate::launch::{
    Outcome, Running, agimp, file, is_alive, job, last_step, mpirun, run, signal, succeed, text,
};

/// All ranks must have ended this long after one has failed or was killed.
const SOON: Duration = Duration::from_secs(10);

/// Ranks are killed one after another, most of them while a checkpoint is written; each time the run goes on from the
/// latest. Besides, the directory holds the later checkpoints of an earlier run with other sand.
#[test]
fn killed_ranks_leave_no_hang_and_no_damage() {
    let _turn = in_turn();
    let name = "collapse_2d";
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    let text_of_job = std::fs::read_to_string(job(name)).expect("job");
    let variant = |file: &str, from: &str, to: &str| -> PathBuf {
        assert!(text_of_job.contains(from));
        let path = directory.join(file).join(format!("{name}.toml"));
        std::fs::create_dir_all(path.parent().expect("a directory")).expect("made");
        std::fs::write(&path, text_of_job.replace(from, to)).expect("written");
        path
    };
    let other = variant("other", "friction_angle = 29.5", "friction_angle = 35");
    let often = variant("often", "every_steps = 20", "every_steps = 1");
    succeed(&mut run(directory, 1, 2, &other, &["--quiet"]));
    let reference = tempfile::tempdir().expect("temporary directory");
    succeed(&mut run(reference.path(), 1, 1, &job(name), &["--quiet"]));

    // Steps are counted in the history, which must not be that of the other sand.
    std::fs::remove_file(file(directory, name, ".history.csv")).expect("history");
    for (kill, ranks) in [3, 2, 4, 3].into_iter().enumerate() {
        let step = last_step(directory, name) + 20;
        let from: &[&str] = if kill == 0 { &["--quiet"] } else { &["--quiet", "--restart", "latest"] };
        let mut running = Running::start(&mut run(directory, ranks, 1, &often, from));
        running.wait_for_step(directory, name, step);
        std::thread::sleep(Duration::from_millis(7 * kill as u64));
        let processes = running.ranks();
        assert_eq!(processes.len(), ranks);
        signal(processes[kill % ranks], "KILL");
        let output = running.finish_within(SOON);
        assert!(!output.status.success(), "{}", text(&output));
        all_ended(&processes);
    }
    succeed(&mut run(directory, 2, 1, &often, &["--quiet", "--restart", "latest"]));
    Outcome::read(directory, name).assert_same(&Outcome::read(reference.path(), name), "killed four times");
}

/// A particle is lost on one rank.
#[test]
fn an_error_of_one_rank_is_told_once() {
    let _turn = in_turn();
    for ranks in [1, 3] {
        let home = tempfile::tempdir().expect("temporary directory");
        let started = Instant::now();
        let running = Running::start(&mut run(home.path(), ranks, 1, &job("unstable"), &["--quiet"]));
        let output = running.finish_within(SOON);
        let shown = text(&output);
        assert!(started.elapsed() < SOON);
        assert_eq!(output.status.code(), Some(1), "{shown}");
        assert_eq!(shown.matches("agimp:").count(), 1, "one message: {shown}");
        let message = shown.lines().find(|line| line.starts_with("agimp:")).expect("message");
        for part in ["step ", "time ", "rank ", "particle ", "left the domain"] {
            assert!(message.contains(part), "'{part}' is missing: {message}");
        }
    }
}

/// A wrong job is told once, with its place, whatever the number of ranks; no output appears.
#[test]
fn a_bad_job_is_told_once() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    let text_of_job = std::fs::read_to_string(job("few_leaves")).expect("job");
    std::fs::write(directory.join("bad.toml"), text_of_job.replace("root_edge", "rot_edge"))
        .expect("written");
    for ranks in [1, 2] {
        let command = &mut run(directory, ranks, 1, &directory.join("bad.toml"), &[]);
        let output = Running::start(command).finish_within(SOON);
        let shown = text(&output);
        assert_eq!(output.status.code(), Some(2), "{shown}");
        assert_eq!(shown.matches("bad.toml:7:1: ").count(), 1, "one message: {shown}");
        assert!(shown.contains("root_edge"), "{shown}");
        assert!(!directory.join("out").exists());
    }

    // Only the second rank cannot read its job, as if a node lacked the file system.
    let mut command = mpirun(directory, 1);
    command.arg(env!("CARGO_BIN_EXE_agimp")).arg("run").arg(job("few_leaves"));
    command.args([":", "-n", "1", env!("CARGO_BIN_EXE_agimp"), "run", "missing.toml"]);
    let output = Running::start(&mut command).finish_within(SOON);
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(2), "{shown}");
    assert_eq!(shown.matches("missing.toml: cannot be read").count(), 1, "{shown}");
    assert!(!directory.join("out").exists());
}

/// The results cannot be written: only rank 0 notices, all ranks end.
#[test]
fn an_unwritable_directory_ends_all_ranks() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    std::fs::write(home.path().join("out"), "a file in the way").expect("written");
    let output = Running::start(&mut run(home.path(), 3, 1, &job("few_leaves"), &[])).finish_within(SOON);
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(1), "{shown}");
    assert_eq!(shown.matches("agimp:").count(), 1, "one message: {shown}");
    assert!(shown.contains("out/few_leaves: cannot create the directory"), "{shown}");
}

/// A wrong command line is told before MPI starts.
#[test]
fn a_wrong_argument_is_told() {
    let home = tempfile::tempdir().expect("temporary directory");
    let output = agimp(home.path()).args(["run", "a.toml", "--threads", "0"]).output().expect("agimp starts");
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
}

fn all_ended(processes: &[u32]) {
    let started = Instant::now();
    while let Some(process) = processes.iter().find(|process| is_alive(**process)) {
        assert!(started.elapsed() < SOON, "rank with process {process} is still there");
        std::thread::sleep(Duration::from_millis(10));
    }
}
