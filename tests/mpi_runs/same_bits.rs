//! One job, many ways to run it, the same bits; and what each way has to conserve.
use std::path::Path;

use crate::common::in_turn;
use crate::common::launch::{Outcome, file, job, run, succeed, text};

/// Ranks and threads; the first is the reference, started without `mpirun`.
const WAYS: [(usize, usize); 7] = [(1, 1), (1, 2), (2, 1), (3, 1), (4, 1), (2, 2), (7, 1)];

/// Runs the job each way; returns the reference.
fn same_in_all_ways(name: &str, ways: &[(usize, usize)]) -> Outcome {
    let mut reference: Option<Outcome> = None;
    for &(ranks, threads) in ways {
        let directory = tempfile::tempdir().expect("temporary directory");
        let output = succeed(&mut run(directory.path(), ranks, threads, &job(name), &["--quiet"]));
        assert!(output.stdout.is_empty(), "--quiet: {}", text(&output));
        check_telemetry(directory.path(), name, ranks, threads);
        check_history(directory.path(), name);
        let result = Outcome::read(directory.path(), name);
        assert!(!result.files.iter().any(|file| file.ends_with(".part")), "{:?}", result.files);
        match &reference {
            None => reference = Some(result),
            Some(first) => result.assert_same(first, &format!("{name} on {ranks} ranks x {threads} threads")),
        }
    }
    reference.expect("one way at least")
}

/// The mass on the real nodes is that of the particles; no particle is lost. One that splits becomes eight.
fn check_telemetry(directory: &Path, name: &str, ranks: usize, threads: usize) {
    let lines = std::fs::read_to_string(file(directory, name, ".telemetry.jsonl")).expect("telemetry");
    let records: Vec<serde_json::Value> =
        lines.lines().map(|line| serde_json::from_str(line).expect("a record per line")).collect();
    assert!(records.len() > 2, "{name}: {} records", records.len());
    for record in &records {
        let step = &record["step"];
        let error = record["mass_error"].as_f64().expect("mass error");
        assert!(error.abs() <= 1e-14, "{name} step {step}: mass on nodes is off by {error:e}");
        // Only in space do they split.
        let count = |key: &str| record[key].as_u64().expect("a count");
        let resampled = |what: &str| record["resampled"][what].as_u64().unwrap_or(0);
        let first = count("particles") + resampled("merged_away") - 7 * resampled("splits");
        assert_eq!(records[0]["particles"], first, "{name} step {step}");
        assert_eq!((&record["ranks"], &record["threads"]), (&ranks.into(), &threads.into()));
    }
}

/// The mass of particles never changes, to the last bit, nor does their count but for those that split.
fn check_history(directory: &Path, name: &str) {
    let text = std::fs::read_to_string(file(directory, name, ".history.csv")).expect("history");
    let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().expect("header");
    let column = |name: &str| header.iter().position(|cell| cell.starts_with(name)).expect("column");
    let (mass, particles) = (column("mass"), column("particles"));
    let resampled = ["splits", "merged_away"].map(|name| header.iter().position(|cell| *cell == name));
    let rows: Vec<Vec<&str>> = rows.collect();
    for row in &rows {
        let number = |place: usize| row[place].parse::<f64>().expect("a number");
        let [splits, away] = resampled.map(|place| place.map_or(0.0, number));
        let due = rows[0][particles].parse::<f64>().expect("a number") + 7.0 * splits - away;
        assert_eq!((row[mass], number(particles)), (rows[0][mass], due), "{name} step {}", row[0]);
    }
}

#[test]
fn collapse_in_space_on_three_levels() {
    let _turn = in_turn();
    let result = same_in_all_ways("collapse_3d", &WAYS);
    let history = String::from_utf8(result.history).expect("text");
    let steps: u64 = history.lines().last().and_then(|row| row.split(',').next()?.parse().ok()).expect("row");
    assert!(steps >= 300, "{steps} steps");
}

/// Two leaves: most ranks own nothing.
#[test]
fn more_ranks_than_leaves() {
    let _turn = in_turn();
    same_in_all_ways("few_leaves", &[(1, 1), (2, 1), (4, 2), (7, 1)]);
}

/// Newton's method and multigrid: every rank computes the same corrections.
#[test]
fn load_steps_in_space() {
    let _turn = in_turn();
    same_in_all_ways("load_steps_3d", &[(1, 1), (2, 1), (3, 1), (7, 1)]);
}
