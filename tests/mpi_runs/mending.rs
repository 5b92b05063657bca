//! Remains of a crash of the machine: tables without their last rows, with garbage or empty, and damaged
//! states. A run continues from the files that are whole, and names those that it has passed over.
use std::path::Path;

use agimp::text::quantity;

use crate::common::in_turn;
use crate::common::launch::{Outcome, Running, agimp, file, job, run, signal, succeed, text};

const NAME: &str = "collapse_2d";

/// A run that was stopped on request after about that many steps.
fn stopped(directory: &Path, step: u64) {
    let mut running = Running::start(&mut run(directory, 1, 1, &job(NAME), &["--quiet"]));
    running.wait_for_step(directory, NAME, step);
    signal(running.launcher(), "TERM");
    let output = running.finish();
    assert_eq!(output.status.code(), Some(3), "{}", text(&output));
}

fn copy(from: &Path, to: &Path) {
    let results = to.join("out").join(NAME);
    std::fs::create_dir_all(&results).expect("made");
    for entry in std::fs::read_dir(from.join("out").join(NAME)).expect("directory").flatten() {
        std::fs::copy(entry.path(), results.join(entry.file_name())).expect("copied");
    }
}

/// Lines of a history.
fn rows(history: &[u8]) -> Vec<String> {
    String::from_utf8_lossy(history).lines().map(str::to_owned).collect()
}

/// Rest of the history, the number of its whole lines (header and rows), and the warning.
type Case<'a> = (&'a str, Option<&'a [u8]>, usize, Option<String>);

#[test]
fn tables_are_mended_and_gaps_told() {
    let _turn = in_turn();
    let whole = tempfile::tempdir().expect("temporary directory");
    succeed(&mut run(whole.path(), 1, 2, &job(NAME), &["--quiet"]));
    let whole = Outcome::read(whole.path(), NAME);
    let expected = rows(&whole.history);
    let home = tempfile::tempdir().expect("temporary directory");
    stopped(home.path(), 45);
    let written = std::fs::read(file(home.path(), NAME, ".history.csv")).expect("history");
    let there = rows(&written).len();
    assert!((10..expected.len()).contains(&there), "{there} rows");
    let start_of = |line: usize| rows(&written)[..line].iter().map(|line| line.len() + 1).sum::<usize>();
    let time_of = |line: usize| {
        let cell = expected[line].split(',').nth(1).and_then(|cell| cell.parse().ok());
        format!("t = {}", quantity(cell.expect("time"), "s"))
    };
    let restart = "the start".to_owned();
    let garbage = [&written[..start_of(8)], b"24,0.0\xff\xfe\0\0\0\0"].concat();
    let cases: [Case; 6] = [
        ("gone", None, 1, Some(restart.clone())),
        ("empty", Some(b""), 1, Some(restart)),
        ("cut after rows", Some(&written[..start_of(6)]), 6, Some(time_of(5))),
        ("cut in a row", Some(&written[..start_of(8) + 9]), 8, Some(time_of(7))),
        ("garbage behind", Some(&garbage), 8, Some(time_of(7))),
        ("whole, and more", Some(&[&written[..], b"999,1.0"].concat()), there, None),
    ];
    for (what, left, lines, told) in cases {
        let parts = tempfile::tempdir().expect("temporary directory");
        copy(home.path(), parts.path());
        let history = file(parts.path(), NAME, ".history.csv");
        match left {
            Some(bytes) => std::fs::write(&history, bytes).expect("written"),
            None => std::fs::remove_file(&history).expect("removed"),
        }
        let telemetry = file(parts.path(), NAME, ".telemetry.jsonl");
        let records = std::fs::read(&telemetry).expect("telemetry");
        std::fs::write(&telemetry, [&records[..], b"{\"step\":20,\"ti\0\0\0\xff\n\xff\xfe"].concat())
            .expect("written");

        let output = succeed(&mut run(parts.path(), 2, 1, &job(NAME), &["--quiet", "--restart", "latest"]));
        let shown = text(&output);
        match &told {
            Some(from) => {
                assert_eq!(shown.matches("agimp: warning: ").count(), 1, "{what}: {shown}");
                let message = format!("collapse_2d.history.csv: rows are missing from {from} to t = ");
                assert!(shown.contains(&message), "{what}: '{message}' is missing: {shown}");
            }
            None => assert!(!shown.contains("warning"), "{what}: {shown}"),
        }
        let mended = Outcome::read(parts.path(), NAME);
        let kept = [&expected[..lines], &expected[there..]].concat();
        assert_eq!(rows(&mended.history), kept, "{what}");
        assert_eq!(mended.digest, whole.digest, "{what}");
        let records = std::fs::read_to_string(&telemetry).expect("text");
        for line in records.lines() {
            let record: Result<serde_json::Value, _> = serde_json::from_str(line);
            assert!(record.is_ok(), "{what}: {line}");
        }
    }
}

/// One bit of the newest state is wrong, or it is cut short: the run goes on from the one before, and says
/// so.
#[test]
fn a_damaged_state_is_passed_over() {
    let _turn = in_turn();
    let whole = tempfile::tempdir().expect("temporary directory");
    succeed(&mut run(whole.path(), 1, 2, &job(NAME), &["--quiet"]));
    let whole = Outcome::read(whole.path(), NAME);
    let home = tempfile::tempdir().expect("temporary directory");
    stopped(home.path(), 45);
    let newest = newest_checkpoint(home.path());
    let bytes = std::fs::read(home.path().join(&newest)).expect("checkpoint");
    let beside = flipped(home.path(), &bytes, "VTKHDF");
    let mut other_text = bytes.clone();
    let title = b"Small column collapse";
    let text_at = bytes.windows(title.len()).position(|part| part == title).expect("text of the job");
    other_text[text_at] ^= 0x01;
    let flipped = flipped(home.path(), &bytes, "state/particles");
    let cut = bytes[..bytes.len() / 2].to_vec();
    for (ranks, damaged, reason) in [
        (1, &flipped, "wrong checksum of state/"),
        (2, &flipped, "wrong checksum of state/"),
        (2, &cut, "cut short"),
        (1, &beside, "the state is complete, and the run continues from it"),
        (3, &beside, "wrong checksum of VTKHDF/"),
        (2, &other_text, "wrong checksum of state/job"),
    ] {
        let parts = tempfile::tempdir().expect("temporary directory");
        copy(home.path(), parts.path());
        std::fs::write(parts.path().join(&newest), damaged).expect("written");
        let restarted = &mut run(parts.path(), ranks, 1, &job(NAME), &["--quiet", "--restart", "latest"]);
        let shown = text(&succeed(restarted));
        assert_eq!(shown.matches("agimp: warning: ").count(), 1, "{shown}");
        let line = shown.lines().find(|line| line.contains("warning")).expect("warning");
        assert!(line.contains(&newest) && line.contains(reason), "{line}");
        Outcome::read(parts.path(), NAME).assert_same(&whole, reason);
    }
    // Nothing is whole: the reasons are given, and nothing is changed.
    let parts = tempfile::tempdir().expect("temporary directory");
    copy(home.path(), parts.path());
    for entry in std::fs::read_dir(parts.path().join("out").join(NAME)).expect("directory").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.ends_with(".hdf") && !name.contains("tree") {
            std::fs::write(entry.path(), &cut).expect("written");
        }
    }
    let output = Running::start(&mut run(parts.path(), 2, 1, &job(NAME), &["--restart", "latest"])).finish();
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(2), "{shown}");
    assert!(shown.matches("cut short").count() >= 3, "{shown}");
}

/// The checkpoint of the latest step, relative to the directory.
fn newest_checkpoint(directory: &Path) -> String {
    let results = Path::new("out").join(NAME);
    let entries = std::fs::read_dir(directory.join(&results)).expect("directory").flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let newest = names.filter(|name| name.contains(".checkpoint_")).max().expect("checkpoint");
    results.join(newest).to_string_lossy().into_owned()
}

/// The file with one bit changed in a data set of a group.
fn flipped(directory: &Path, whole: &[u8], group: &str) -> Vec<u8> {
    let probe = directory.join("probe.hdf");
    for part in 1..32 {
        let mut bytes = whole.to_vec();
        bytes[whole.len() * part / 32] ^= 0x10;
        std::fs::write(&probe, &bytes).expect("written");
        let output = agimp(directory).args(["info", "--verify", "probe.hdf"]).output().expect("agimp starts");
        if text(&output).contains(&format!("wrong checksum of {group}/")) {
            return bytes;
        }
    }
    panic!("no changed bit was noticed")
}

/// A killed run may leave its very end undone. `--restart latest` gives the report of an uninterrupted run,
/// no file that was half written stays, and a good report stays good. Where the history is lost as well, the
/// report has the state.
#[test]
fn a_run_that_is_over_has_its_report_again() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let again = |ranks: usize| {
        let arguments = ["--quiet", "--restart", "latest", "--end", "0.02"];
        succeed(&mut run(home.path(), ranks, 1, &job(NAME), &arguments));
    };
    succeed(&mut run(home.path(), 1, 1, &job(NAME), &["--quiet", "--end", "0.02"]));
    let report = file(home.path(), NAME, ".report.json");
    let read = || -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(&report).expect("report")).expect("JSON")
    };
    let before = read();
    let steady = ["history", "particles", "steps", "time", "digest", "outputs", "picture"];
    assert!(
        before["particles"].as_u64() > Some(0)
            && before["history"].as_object().is_some_and(|h| h.len() >= 20)
    );
    for (ranks, is_lost) in [(1, false), (1, true), (2, true)] {
        if is_lost {
            std::fs::remove_file(&report).expect("removed");
        }
        for ending in
            [".png.part", ".report.json.part", ".checkpoint_000000007.hdf.part", "_000001.tree.hdf.part"]
        {
            std::fs::write(file(home.path(), NAME, ending), "half").expect("written");
        }
        again(ranks);
        let after = read();
        steady.iter().for_each(|key| assert_eq!(after[key], before[key], "{key} on {ranks} ranks"));
        let left = std::fs::read_dir(report.parent().expect("directory")).expect("listed").flatten();
        let unfinished: Vec<_> = left
            .map(|entry| entry.file_name())
            .filter(|name| name.to_string_lossy().ends_with(".part"))
            .collect();
        assert_eq!(unfinished, Vec::<std::ffi::OsString>::new());
    }
    std::fs::remove_file(file(home.path(), NAME, ".history.csv")).expect("removed");
    again(1);
    let after = read();
    assert_eq!(after["particles"], before["particles"]);
    for column in ["time", "kinetic_energy", "elastic_energy", "momentum_y", "mass"] {
        assert_eq!(after["history"][column], before["history"][column], "{column}");
    }
}
