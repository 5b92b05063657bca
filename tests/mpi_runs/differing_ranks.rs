//! Ranks that were started differently, or that see different texts of the job, do not run different jobs.
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::in_turn;
use crate::common::launch::{Outcome, Running, by_rank, job, mpirun, run, succeed, text};

/// Changes of the small collapse that rank 1 alone sees.
const CHANGES: [(&str, &str); 7] = [
    ("friction_angle = 29.5", "friction_angle = 35"),
    ("young = 3e5", "young = 3.1e5"),
    ("every_steps = 3", "every_steps = 4"),
    ("end = 0.05", "end = 0.03"),
    ("every = 0.02", "every = 0.01"),
    ("root_edge = 0.064", "root_edge = 0.032"),
    ("match =", "mach ="),
];

/// The job of rank `n` in a folder of that name: the small collapse, short, with a directory that all share.
fn jobs(home: &Path, (from, to): (&str, &str)) -> [PathBuf; 2] {
    let results = home.join("out/collapse_2d");
    let original = std::fs::read_to_string(job("collapse_2d")).expect("job");
    let original = original.replace("[output]", &format!("[output]\ndirectory = {results:?}"));
    assert!(original.contains(from));
    let changed = original.replace(from, to);
    ["0", "1"].map(|rank| {
        let text = if rank == "0" { &original } else { &changed };
        std::fs::create_dir_all(home.join(rank)).expect("made");
        let path = home.join(rank).join("collapse_2d.toml");
        std::fs::write(&path, text.replace("end = 0.05", "end = 0.02")).expect("written");
        path
    })
}

/// Each rank in its own folder, so that the same words on the command line mean different files.
fn each_in_its_folder(home: &Path, arguments: &str) -> Command {
    let mut command = mpirun(home, 2);
    let script = format!("cd ${{OMPI_COMM_WORLD_RANK:-$PMI_RANK}} && exec \"$0\" {arguments}");
    command.args(["bash", "-c", &script, env!("CARGO_BIN_EXE_agimp")]);
    command
}

/// The file was edited while the ranks were started: all take the text that rank 0 has read.
#[test]
fn all_ranks_run_the_job_of_rank_0() {
    let _turn = in_turn();
    let reference = tempfile::tempdir().expect("temporary directory");
    let [original, _] = jobs(reference.path(), CHANGES[0]);
    succeed(&mut run(reference.path(), 1, 1, &original, &["--quiet"]));
    let expected = Outcome::read(reference.path(), "collapse_2d");
    for change in CHANGES {
        let home = tempfile::tempdir().expect("temporary directory");
        jobs(home.path(), change);
        let mut command = each_in_its_folder(home.path(), "run collapse_2d.toml --threads 1 --quiet");
        let output = Running::start(&mut command).finish_soon();
        assert_eq!(output.status.code(), Some(0), "{change:?}: {}", text(&output));
        Outcome::read(home.path(), "collapse_2d").assert_same(&expected, &format!("{change:?} on rank 1"));
    }
    let home = tempfile::tempdir().expect("temporary directory");
    jobs(home.path(), CHANGES[5]);
    let output = Running::start(&mut each_in_its_folder(home.path(), "check collapse_2d.toml"));
    let output = output.finish_soon();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert_eq!(text(&output).matches("5 x 2 root octants").count(), 1, "{}", text(&output));
}

/// Different words on the command line: one message, nothing written.
#[test]
fn ranks_need_the_same_command() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let [a, b] = jobs(home.path(), CHANGES[0]).map(|path| path.display().to_string());
    let agimp = env!("CARGO_BIN_EXE_agimp");
    let cases = [
        (vec!["run", &a], vec!["run", &b]),
        (vec!["run", &a], vec!["run", &a, "--restart", "latest"]),
        (vec!["run", &a, "--restart", "latest"], vec!["run", &a]),
        (vec!["run", &a, "--set", "time.cfl=0.3"], vec!["run", &a, "--set", "time.cfl=0.2"]),
        (vec!["run", &a], vec!["run", &a, "--set", "time.cfl=0.2"]),
        (vec!["run", &a], vec!["check", &a]),
        (vec!["run", &a], vec!["run", "missing.toml"]),
    ];
    let started = |words: &[&str]| format!("exec {agimp} {}", words.join(" "));
    for (first, second) in cases {
        let mut command = by_rank(home.path(), [&started(&first), &started(&second)]);
        let output = Running::start(&mut command).finish_soon();
        let shown = text(&output);
        assert_eq!(output.status.code(), Some(2), "{shown}");
        let expected = format!(
            "agimp: rank 1 was started with `{}`, rank 0 with `{}`; expected the same on all ranks",
            second.join(" "),
            first.join(" ")
        );
        assert_eq!(shown.matches("agimp: ").count(), 1, "one message: {shown}");
        assert!(shown.contains(&expected), "{expected}\n{shown}");
        assert!(!home.path().join("out").exists());
    }
    // Threads are each rank's own affair.
    let threads = ["1", "2"].map(|threads| started(&["run", &a, "--threads", threads]));
    succeed(&mut by_rank(home.path(), [&threads[0], &threads[1]]));
}
