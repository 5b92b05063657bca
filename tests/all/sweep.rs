//! `agimp sweep`: each combination is run once, also when the sweep is killed and started again, and one table has all results.
use std::collections::BTreeMap;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant, SystemTime};

const JOB: &str = "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [2, 2]\nroot_edge = 1\n\
    [boundaries]\ny_min = { kind = 'sticky' }\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_max.kind = 'separating'\n\
    [[materials]]\nname = 'sand'\ndensity = 1600\nmodel = 'mohr_coulomb'\nyoung = 1e6\npoisson = 0.2\nfriction_angle = 30\n\
    [[bodies]]\nname = 'column'\nmaterial = 'sand'\nshape = { kind = 'box', min = [0, 0], max = [0.5, 1] }\n\
    [[probes]]\nname = 'sand'\nquantities = ['extent']\n\
    [checkpoint]\nevery_steps = 50\n[time]\nend = 0.6\n[output]\npicture = false\n";

fn sweep(directory: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_agimp"));
    command.args(["sweep", "column.toml", "--threads", "1"]).args(arguments).current_dir(directory);
    command
}

fn words(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

/// When each report was written.
fn reports(directory: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let Ok(entries) = std::fs::read_dir(directory) else { return BTreeMap::new() };
    entries
        .filter_map(|entry| {
            let path = entry.expect("an entry").path().join("column.report.json");
            Some((path.clone(), path.metadata().ok()?.modified().expect("a time")))
        })
        .collect()
}

/// Six friction angles, the sweep and its run killed (SIGKILL) after the second has finished: the next start does the rest.
#[test]
fn a_killed_sweep_goes_on_and_does_no_run_twice() {
    let directory = tempfile::tempdir().expect("temporary directory");
    std::fs::write(directory.path().join("column.toml"), JOB).expect("job");
    let over = ["--over", "materials.sand.friction_angle=20,24,28,32,36,40"];
    let runs = directory.path().join("out/column.sweep");
    let mut first = sweep(directory.path(), &over).process_group(0).spawn().expect("starts");
    let start = Instant::now();
    while reports(&runs).len() < 2 {
        assert!(start.elapsed() < Duration::from_secs(300), "no two runs in 300 s");
        std::thread::sleep(Duration::from_millis(20));
    }
    let group = format!("-{}", first.id());
    Command::new("kill").args(["-KILL", "--", &group]).status().expect("kill");
    first.wait().expect("ended");
    let before = reports(&runs);
    assert!(before.len() < 6, "killed too late");

    let output = sweep(directory.path(), &over).output().expect("starts");
    assert!(output.status.success(), "{}", words(&output));
    let after = reports(&runs);
    assert_eq!(after.len(), 6);
    before
        .iter()
        .for_each(|(path, time)| assert_eq!(after[path], *time, "{} was written again", path.display()));
    let table = std::fs::read_to_string(runs.join("sweep.csv")).expect("table");
    let rows: Vec<Vec<&str>> = table.lines().map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len(), 7, "{table}");
    assert_eq!(rows[0][..3], ["materials.sand.friction_angle", "directory", "status"]);
    let front =
        rows[0].iter().position(|name| *name == "greatest_sand_x [m]").expect("a column of the probe");
    let fronts: Vec<f64> = rows[1..].iter().map(|row| row[front].parse().expect("a number")).collect();
    println!("run-out by friction angle: {fronts:?}");
    assert!(rows[1..].iter().all(|row| row[2] == "finished"), "{table}");
    assert!(fronts[5] < fronts[0], "more friction stops the column earlier: {fronts:?}");
    // Once more: nothing is left to do.
    let output = sweep(directory.path(), &over).output().expect("starts");
    assert!(
        output.status.success() && words(&output).matches("finished already").count() == 6,
        "{}",
        words(&output)
    );
}

/// A value that is no value of the job is found before anything runs.
#[test]
fn a_wrong_combination_is_refused_and_nothing_is_written() {
    let directory = tempfile::tempdir().expect("temporary directory");
    std::fs::write(directory.path().join("column.toml"), JOB).expect("job");
    for (over, part) in [
        ("materials.sand.friction_angle=20,95", "found 95"),
        ("materials.sand.friction_angel=20", "unknown key"),
        ("materials.sand.friction_angle", "expected KEY=A,B,C"),
    ] {
        let output = sweep(directory.path(), &["--over", over]).output().expect("starts");
        assert_eq!(output.status.code(), Some(2), "{over}: {}", words(&output));
        assert!(words(&output).contains(part), "{over}: {}", words(&output));
        assert!(!directory.path().join("out").exists(), "{over}");
    }
}

/// Two keys make a table of all their combinations.
#[test]
fn combinations_of_two_keys_are_all_run() {
    let directory = tempfile::tempdir().expect("temporary directory");
    std::fs::write(directory.path().join("column.toml"), JOB).expect("job");
    let arguments = [
        "--set",
        "time.end=0.01",
        "--over",
        "time.cfl=0.3,0.5",
        "--over",
        "bodies.0.velocity=[0, 0],[1, 0]",
        "--out",
        "cases",
    ];
    let output = sweep(directory.path(), &arguments).output().expect("starts");
    assert!(output.status.success(), "{}", words(&output));
    let table = std::fs::read_to_string(directory.path().join("cases/sweep.csv")).expect("table");
    let starts: Vec<&str> =
        table.lines().skip(1).map(|row| row.split(",0").next().unwrap_or_default()).collect();
    assert_eq!(starts.len(), 4, "{table}");
    assert!(table.contains("0.3,\"[0, 0]\",0001_cfl=0.3_velocity=_0__0_,finished,"), "{table}");
    assert!(table.contains("0.5,\"[1, 0]\",0004_cfl=0.5_velocity=_1__0_,finished,"), "{table}");
}
