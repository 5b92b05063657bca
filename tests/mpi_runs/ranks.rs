//! Sizes and traffic of single ranks when there are many, and the evenness of their work.
use std::path::Path;

use serde_json::Value;

use crate::common::in_turn;
use crate::common::launch::{agimp, file, job, run, succeed, text};

/// The records of a run.
fn telemetry(directory: &Path, name: &str) -> Vec<Value> {
    let lines = std::fs::read_to_string(file(directory, name, ".telemetry.jsonl")).expect("telemetry");
    lines.lines().map(|line| serde_json::from_str(line).expect("a record per line")).collect()
}

/// Least, mean and greatest value of a rank.
fn spread(record: &Value, name: &str) -> [f64; 3] {
    ["min", "mean", "max"].map(|key| record["per_rank"][name][key].as_f64().expect(name))
}

/// Runs the job on `ranks` ranks and checks the counts of its last record.
fn check_counts(ranks: usize) {
    let name = "many_leaves";
    let home = tempfile::tempdir().expect("temporary directory");
    succeed(&mut run(home.path(), ranks, 1, &job(name), &["--quiet"]));
    let records = telemetry(home.path(), name);
    // The last that follows on steps; the end of a run writes one more.
    let record = records.iter().rfind(|record| record["steps"] != 0).expect("a record");
    let of = |name: &str| spread(record, name);
    let levels = record["levels"].as_array().expect("levels");
    let total: f64 = levels.iter().map(|level| level["leaves"].as_f64().expect("leaves")).sum();
    let (leaves, ghosts, neighbours) = (of("leaves"), of("ghost_leaves"), of("neighbours"));
    let (messages, arenas, surface) = (of("messages_per_step"), of("arena_bytes"), of("surface_bytes"));
    println!(
        "{ranks} ranks, {total} leaves: own {leaves:?}, ghosts {ghosts:?}, neighbours {neighbours:?}, \
         messages per step {messages:?}, bytes of arenas {arenas:?}, of the surface {surface:?}"
    );

    assert!((leaves[1] * ranks as f64 - total).abs() < 1e-3 * total, "every leaf has one owner");
    // Own leaves and a layer around them, at most four leaves thick.
    let layer = (leaves[2].cbrt() + 8.0).powi(3) - leaves[2];
    assert!(ghosts[2] <= layer, "{} ghosts around {} leaves", ghosts[2], leaves[2]);
    let collective = (ranks as f64).log2();
    for (messages, neighbours) in messages.into_iter().zip(neighbours) {
        assert!(
            messages <= EXCHANGES * neighbours + collective,
            "{messages} messages, {neighbours} neighbours"
        );
    }
    if ranks > 1 {
        let ratio = arenas[1] / surface[1];
        assert!((1.0..=MOST_BYTES).contains(&ratio), "{ratio} times the bytes of the surface");
    }
}

/// `agimp check` estimates the memory of a run.
#[test]
fn memory_is_foretold() {
    let _turn = in_turn();
    let (name, home) = ("many_leaves", tempfile::tempdir().expect("temporary directory"));
    let shown = text(&succeed(agimp(home.path()).arg("check").arg(job(name))));
    let line = shown.lines().find_map(|line| line.strip_prefix("memory")).expect("memory");
    let foretold: f64 = line
        .split_whitespace()
        .find_map(|word| word.parse().ok())
        .unwrap_or_else(|| panic!("a number of megabytes: {line}"));
    assert!(line.contains(" MB "), "{line}");
    succeed(&mut run(home.path(), 1, 1, &job(name), &["--quiet"]));
    let memory = telemetry(home.path(), name).last().and_then(|record| record["memory"]["max"].as_f64());
    let ratio = 1e6 * foretold / memory.expect("memory");
    println!("{foretold} MB foretold, {ratio:.2} of what it took");
    assert!((0.7..1.4).contains(&ratio), "{foretold} MB, {ratio} of what it took");
}

/// A rank exchanges sums with its neighbours once for each linear iteration of a load step; beside these, for each
/// Newton iteration and each time that nodes leave a wall, and for the particles.
#[test]
fn a_linear_iteration_has_one_exchange() {
    let _turn = in_turn();
    let (name, home) = ("load_steps_3d", tempfile::tempdir().expect("temporary directory"));
    succeed(&mut run(home.path(), 3, 1, &job(name), &["--quiet"]));
    let history = std::fs::read_to_string(file(home.path(), name, ".history.csv")).expect("history");
    let rows: Vec<Vec<&str>> = history.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|cell| cell.starts_with(name)).expect("column");
    let [newton, linear] = ["newton_iterations", "linear_iterations"].map(column);
    let records = telemetry(home.path(), name);
    let steps = records.iter().filter(|record| record["steps"] == 1);
    for (row, record) in rows[2..].iter().zip(steps) {
        let [newton, linear] = [newton, linear].map(|at| row[at].parse::<f64>().expect("a number"));
        let [_, mean, most] = spread(record, "messages_per_step");
        let neighbours = spread(record, "neighbours")[1];
        let exchanges = mean / neighbours;
        println!("{newton} Newton and {linear} linear iterations, {exchanges} exchanges, {most} messages");
        assert!(exchanges <= linear + 4.0 * newton + 10.0, "{exchanges} exchanges");
    }
}

/// Exchanges with neighbours in a step of an elastic body: sums at nodes, the well filled cells of ties, and
/// particles. Near walls that it meets over a gap, sums of the surface are another; the job has mirrors.
const EXCHANGES: f64 = 3.0;

/// Bytes sent over the bytes that the surface between ranks needs, at most.
const MOST_BYTES: f64 = 1.5;

#[test]
fn counts_on_16_ranks() {
    let _turn = in_turn();
    check_counts(1);
    check_counts(16);
}

#[test]
#[ignore = "64 ranks on few cores take long; 16 run always"]
fn counts_on_1_to_64_ranks() {
    let _turn = in_turn();
    [1, 2, 4, 8, 16, 32, 64].into_iter().for_each(check_counts);
}

/// Sand falls out of the ranks that had it; cuts follow. About 100 leaves with sand per rank.
#[test]
fn work_stays_even_on_4_ranks() {
    let _turn = in_turn();
    let name = "many_leaves_2d";
    let home = tempfile::tempdir().expect("temporary directory");
    succeed(&mut run(home.path(), 4, 1, &job(name), &["--quiet"]));
    let records = telemetry(home.path(), name);
    let imbalance = |record: &Value| record["imbalance"].as_f64().expect("imbalance");
    let all: Vec<f64> = records.iter().map(imbalance).collect();
    println!("imbalance from record to record: {all:.3?}");
    // From the first step on; that partition is by particles alone, without any measurement.
    assert!(all.iter().all(|&imbalance| imbalance <= 1.05), "{all:.3?}");
    let partitions = records.last().and_then(|record| record["partitions"].as_u64()).expect("partitions");
    assert!((1..=records.len() as u64 * 5).contains(&partitions), "{partitions} new partitions");
}
