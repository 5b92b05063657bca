//! One job with a changing tree or cells of several sizes, many ways to run it, the same bits.
use std::path::Path;

use crate::common::in_turn;
use crate::common::launch::{Outcome, Running, file, job, run, signal, succeed, text};

/// Ranks and threads; the first is the reference, started without `mpirun`.
const WAYS: [(usize, usize); 6] = [(1, 1), (1, 2), (2, 1), (3, 1), (4, 1), (2, 2)];

/// Runs the job each way, then in three parts on other numbers of ranks. It has at least so many changes of
/// the tree, splits and merges.
fn same_in_all_ways(name: &str, stops: [u64; 2], least: [u64; 3]) {
    let mut reference: Option<Outcome> = None;
    for (ranks, threads) in WAYS {
        let directory = tempfile::tempdir().expect("temporary directory");
        succeed(&mut run(directory.path(), ranks, threads, &job(name), &["--quiet"]));
        if reference.is_none() {
            splits_and_merges(directory.path(), name, least);
        }
        let result = Outcome::read(directory.path(), name);
        let what = format!("{name} on {ranks} ranks x {threads} threads");
        reference.get_or_insert_with(|| result.clone()).assert_same(&result, &what);
    }

    let directory = tempfile::tempdir().expect("temporary directory");
    for (part, (ranks, stop)) in [(3, Some(stops[0])), (1, Some(stops[1])), (2, None)].into_iter().enumerate()
    {
        let from: &[&str] = if part == 0 { &["--quiet"] } else { &["--quiet", "--restart", "latest"] };
        let mut command = run(directory.path(), ranks, 1, &job(name), from);
        let Some(step) = stop else {
            succeed(&mut command);
            continue;
        };
        let mut running = Running::start(&mut command);
        running.wait_for_step(directory.path(), name, step);
        signal(running.launcher(), if ranks == 1 { "TERM" } else { "USR1" });
        let output = running.finish();
        assert_eq!(output.status.code(), Some(3), "{}", text(&output));
    }
    let result = Outcome::read(directory.path(), name);
    result.assert_same(&reference.expect("a reference"), &format!("{name} in three parts"));
}

/// The job is one in which everything happens that might differ.
fn splits_and_merges(directory: &Path, name: &str, least: [u64; 3]) {
    let lines = std::fs::read_to_string(file(directory, name, ".telemetry.jsonl")).expect("telemetry");
    let last: serde_json::Value = serde_json::from_str(lines.lines().last().expect("a line")).expect("JSON");
    for (what, least) in ["regrids", "splits", "merges"].into_iter().zip(least) {
        let count = last["resampled"][what].as_u64().expect("a count");
        assert!(count >= least, "{name}: {count} {what}");
    }
    let levels = last["levels"].as_array().expect("levels");
    let filled = levels.iter().filter(|level| level["particles"].as_u64() > Some(0)).count();
    assert!(filled >= 2, "{name}: particles on {filled} levels");
}

#[test]
fn plane_column() {
    let _turn = in_turn();
    same_in_all_ways("adaptive_2d", [60, 300], [10, 500, 200]);
}

#[test]
fn column_in_space() {
    let _turn = in_turn();
    same_in_all_ways("adaptive_3d", [40, 150], [10, 500, 200]);
}

#[test]
fn cells_of_three_sizes() {
    let _turn = in_turn();
    same_in_all_ways("static_2d", [200, 600], [0, 200, 50]);
}
