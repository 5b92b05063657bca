//! Runs that are stopped and go on elsewhere, and files that no run may go on from.
use std::path::{Path, PathBuf};

use crate::common::in_turn;
use crate::common::launch::{
    Outcome, Running, agimp, contents, file, job, results, run, signal, succeed, text,
};

/// Exit code of a run that stopped on request.
const STOPPED: i32 = 3;

/// Stops a run that has reached `step`, checks how it ends, and returns the checkpoint that it names.
fn stop(mut running: Running, directory: &Path, name: &str, step: u64, stop: impl Fn(&Running)) -> PathBuf {
    running.wait_for_step(directory, name, step);
    stop(&running);
    let output = running.finish();
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(STOPPED), "{shown}");
    let named = shown
        .lines()
        .filter_map(|line| line.strip_prefix("agimp: stopped on request; continue with --restart "));
    let named: Vec<&str> = named.collect();
    assert_eq!(named.len(), 1, "one message: {shown}");
    let checkpoint = directory.join(named[0]);
    assert!(checkpoint.exists(), "{shown}");
    checkpoint
}

/// One rank alone is told SIGTERM, as batch systems do; `mpirun` hands SIGUSR1 on to its ranks.
#[test]
fn stopped_twice_and_finished_on_other_ranks() {
    let _turn = in_turn();
    let name = "collapse_3d";
    let job = job(name);
    let whole = tempfile::tempdir().expect("temporary directory");
    succeed(&mut run(whole.path(), 1, 2, &job, &["--quiet"]));

    let parts = tempfile::tempdir().expect("temporary directory");
    let directory = parts.path();
    let running = Running::start(&mut run(directory, 1, 1, &job, &["--quiet"]));
    let first = stop(running, directory, name, 40, |running| signal(running.launcher(), "TERM"));
    let running = Running::start(&mut run(directory, 4, 1, &job, &["--restart", "latest"]));
    let second = stop(running, directory, name, 150, |running| signal(running.launcher(), "USR1"));
    assert_ne!(first, second);
    succeed(&mut run(directory, 3, 1, &job, &["--restart", "latest"]));

    Outcome::read(directory, name).assert_same(&Outcome::read(whole.path(), name), "stopped twice");
    assert!(!second.exists() || first.exists(), "checkpoints beyond `keep` go, oldest first");
}

/// A run to a later end is the run to the end in one go: all states, tables and pictures, whether an output
/// is due where it ends first or not.
#[test]
fn a_later_end_is_the_same_run() {
    let _turn = in_turn();
    let name = "collapse_2d";
    let original = std::fs::read_to_string(job(name)).expect("job");
    let original = original.replace("every_steps = 3", "every_steps = 7");
    for (first_end, outputs, restart) in [("0.013", "every = 0.01", "true"), ("0.02", "", "false")] {
        let home = tempfile::tempdir().expect("temporary directory");
        let with_end = |end: &str| {
            let outputs = format!("{outputs}\nrestart = {restart}");
            let text =
                original.replace("end = 0.05", &format!("end = {end}")).replace("every = 0.02", &outputs);
            let path = home.path().join(format!("{name}.toml"));
            std::fs::write(&path, text).expect("written");
            path
        };
        let directory = |part: &str| {
            let path = home.path().join(part);
            std::fs::create_dir(&path).expect("made");
            path
        };
        let go = |directory: &Path, ranks, end, arguments: &[&str]| {
            succeed(&mut run(directory, ranks, 1, &with_end(end), &[&["--quiet"], arguments].concat()));
        };
        let whole = directory("whole");
        go(&whole, 1, "0.03", &[]);
        for (ranks_before, ranks_behind) in [(1, 2), (2, 1)] {
            let parts = directory(&format!("parts_{ranks_before}"));
            go(&parts, ranks_before, first_end, &[]);
            // Once more to the same end: nothing is left to do.
            let there = results(&parts, name);
            go(&parts, 1, first_end, &["--restart", "latest"]);
            assert!(results(&parts, name) == there, "the same end again");
            go(&parts, ranks_behind, "0.03", &["--restart", "latest"]);
            // Elsewhere no rows are missing, as the run has none there.
            let from = format!("out/{name}/{name}_000001.hdf");
            if parts.join(&from).exists() && restart == "true" {
                let words = ["--restart", &from, "--out", "elsewhere"];
                let output = run(&parts, 1, 1, &with_end("0.03"), &words).output().expect("starts");
                let shown = text(&output);
                assert!(output.status.success() && !shown.contains("missing"), "{shown}");
                std::fs::remove_dir_all(parts.join("elsewhere")).expect("removed");
            }
            let (found, expected) = (results(&parts, name), results(&whole, name));
            for (file, contents) in &expected {
                assert!(found.get(file) == Some(contents), "{file} of a run that first ended at {first_end}");
            }
            assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        }
    }
}

/// A file that cannot be trusted, or is not of this job, is refused with the reason; nothing is touched.
#[test]
fn refused_with_the_reason() {
    let _turn = in_turn();
    let name = "collapse_2d";
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    let output = succeed(&mut run(directory, 2, 1, &job(name), &[]));
    says_where_results_are(&String::from_utf8_lossy(&output.stdout));

    let good = file(directory, name, "_000002.hdf");
    let whole = std::fs::read(&good).expect("output");
    let bad = directory.join("bad.hdf");
    let before = contents(&directory.join("out").join(name));
    let refused = |ranks: usize, name: &str, from: &Path, reason: &str| {
        let from = from.to_str().expect("path");
        let job = if name.ends_with(".toml") { directory.join(name) } else { job(name) };
        let output = Running::start(&mut run(directory, ranks, 1, &job, &["--restart", from])).finish();
        let shown = text(&output);
        assert_eq!(output.status.code(), Some(2), "{shown}");
        assert_eq!(shown.matches("agimp:").count(), 1, "one message: {shown}");
        assert!(shown.contains(reason) && shown.contains(from), "expected '{reason}': {shown}");
    };

    std::fs::write(&bad, &whole[..whole.len() * 2 / 3]).expect("written");
    refused(2, name, &bad, "cut short");
    std::fs::write(&bad, flipped_in_the_state(directory, &whole)).expect("written");
    refused(3, name, &bad, "wrong checksum");
    std::fs::write(&bad, "a text that is not a file of states").expect("written");
    refused(1, name, &bad, "not an HDF5 file");
    refused(1, name, &file(directory, name, "_000002.tree.hdf"), "holds no restart state");
    refused(2, "few_leaves", &good, "belongs to another job");
    refused(1, name, &directory.join("missing.hdf"), "No such file");
    // Another job says which keys differ; what may differ is not among them.
    let text_of_job = std::fs::read_to_string(job(name)).expect("job");
    let changed = |changes: &[(&str, &str)]| {
        let text = changes.iter().fold(text_of_job.clone(), |text, (from, to)| {
            assert!(text.contains(from));
            text.replace(from, to)
        });
        std::fs::write(directory.join("collapse_2d.toml"), text).expect("written");
    };
    changed(&[
        ("friction_angle = 29.5", "friction_angle = 35"),
        ("young = 3e5", "young = 4e5"),
        ("every = 0.02", "every = 0.01"),
    ]);
    let keys = "another job: `materials[0].friction_angle` is 29.5 there and 35.0 here; \
                `materials[0].young` is 300000.0 there and 400000.0 here (title, output";
    refused(2, "collapse_2d.toml", &good, keys);
    // Of many the first three.
    changed(&[
        ("friction_angle = 29.5", "friction_angle = 35"),
        ("young = 3e5", "young = 4e5"),
        ("density = 1600", "density = 1700"),
        ("poisson = 0.2", "poisson = 0.25"),
    ]);
    let keys = "another job: `materials[0].density` is 1600.0 there and 1700.0 here; \
                `materials[0].friction_angle` is 29.5 there and 35.0 here; \
                `materials[0].poisson` is 0.2 there and 0.25 here; and 1 more (title, output";
    refused(2, "collapse_2d.toml", &good, keys);
    changed(&[("end = 0.05", "end = 0.03")]);
    refused(2, "collapse_2d.toml", &good, "after the end of the run; found time.end = 0.03");
    std::fs::remove_file(directory.join("collapse_2d.toml")).expect("removed");

    let output =
        Running::start(&mut run(directory, 2, 1, &job("few_leaves"), &["--restart", "latest"])).finish();
    let shown = text(&output);
    assert_eq!((output.status.code(), shown.matches("agimp:").count()), (Some(2), 1), "{shown}");
    assert!(shown.contains("no restart file of `few_leaves` in out/few_leaves"), "{shown}");

    assert!(contents(&directory.join("out").join(name)) == before, "a refused restart changed the results");
    assert!(!directory.join("out/few_leaves").exists());
}

/// The file with one bit changed where the digest notices it.
fn flipped_in_the_state(directory: &Path, whole: &[u8]) -> Vec<u8> {
    let probe = directory.join("probe.hdf");
    for part in 1..32 {
        let mut bytes = whole.to_vec();
        bytes[whole.len() * part / 32] ^= 0x10;
        std::fs::write(&probe, &bytes).expect("written");
        let output = agimp(directory).args(["digest", "probe.hdf"]).output().expect("agimp starts");
        if text(&output).contains("wrong checksum of state/particles") {
            return bytes;
        }
    }
    panic!("no changed bit was noticed")
}

/// The last lines of a run: where its results are, and the evaluation that the job asks for.
fn says_where_results_are(shown: &str) {
    let expected = [
        "outputs  out/collapse_2d/collapse_2d.hdf.series",
        "picture  out/collapse_2d/collapse_2d.png",
        "history  out/collapse_2d/collapse_2d.history.csv",
        "took     ",
        "turn     agimp view out/collapse_2d/collapse_2d.hdf.series",
        "draw     agimp plot out/collapse_2d/collapse_2d_",
        "play     agimp movie out/collapse_2d/collapse_2d.hdf.series",
        "read     agimp report out/collapse_2d",
    ];
    let lines: Vec<&str> = shown.lines().collect();
    assert_eq!(lines.len(), expected.len(), "{shown}");
    for (line, expected) in lines.iter().zip(expected) {
        assert!(line.starts_with(expected), "{shown}");
    }
}
