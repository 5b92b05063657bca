//! `agimp sweep`: each combination is run once, also when the sweep is killed, stopped and started again; one
//! table has all results, and results of another job are replaced only where the user asks for it.
use std::collections::BTreeMap;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant, SystemTime};

use crate::common::launch::signal;

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

/// Six friction angles, the sweep and its run killed (SIGKILL) after the second has finished: the next start
/// does the rest.
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
    signal(format!("-{}", first.id()), "KILL");
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

/// Values found in between join those that are there, as in the search for a factor of safety: no run is done
/// twice, none leaves the table, and rows are sorted.
#[test]
fn values_of_a_second_sweep_join_those_of_the_first() {
    let directory = tempfile::tempdir().expect("temporary directory");
    std::fs::write(directory.path().join("column.toml"), JOB.replace("end = 0.6", "end = 0.01"))
        .expect("job");
    let over = |values: &str| {
        let over = format!("materials.sand.young={values}");
        let arguments = ["--over", &over, "--show", "kinetic_energy,mass"];
        let output = sweep(directory.path(), &arguments).output().expect("starts");
        assert!(output.status.success(), "{}", words(&output));
        (words(&output), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let path = directory.path().join("out/column.sweep/sweep.csv");
    let table = || std::fs::read_to_string(&path).expect("table");
    over("1e6,4e6");
    let before: Vec<String> = table().lines().map(str::to_owned).collect();
    let (told, printed) = over("2e6,4e6");
    assert!(told.contains("young=4e6: finished already"), "{told}");
    let after: Vec<String> = table().lines().map(str::to_owned).collect();
    assert_eq!([&after[1], &after[3]], [&before[1], &before[2]], "{after:?}");
    assert!(after[2].starts_with("2e6,young=2e6,finished,"), "{after:?}");
    let starts: Vec<&str> = printed.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(starts[..4], ["young", "1e6", "2e6", "4e6"], "{printed}");
    assert!(printed.contains("kinetic_energy"), "{printed}");
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
    assert!(table.contains("0.3,\"[0, 0]\",cfl=0.3_velocity=_0__0_-"), "{table}");
    assert!(table.contains("0.5,\"[1, 0]\",cfl=0.5_velocity=_1__0_-"), "{table}");
}

/// A job with so many thousand steps, roughly.
fn long_job(thousands: u32) -> String {
    JOB.replace("end = 0.6", &format!("end = {thousands}")) + "[tree]\nbase_level = 1\n"
}

/// Starts a sweep over two densities, which its run has begun.
fn begun(directory: &Path) -> std::process::Child {
    let over = ["--over", "materials.sand.density=1600,1700"];
    let child = sweep(directory, &over).stderr(std::process::Stdio::piped()).spawn().expect("starts");
    let start = Instant::now();
    let history = directory.join("out/column.sweep/density=1600/column.history.csv");
    while std::fs::read_to_string(&history).map_or(0, |rows| rows.lines().count()) < 4 {
        assert!(start.elapsed() < Duration::from_secs(100), "no row of the history in 100 s");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

/// TERM and USR1 of a batch system, Ctrl-C: the run of the sweep stops with a checkpoint, the sweep ends with
/// the exit code 3, and the same command gives what an uninterrupted sweep gives.
#[test]
fn a_stopped_sweep_stops_its_run_and_the_same_command_continues() {
    let over = ["--over", "materials.sand.density=1600,1700"];
    let values = |directory: &Path| -> Vec<String> {
        let table = std::fs::read_to_string(directory.join("out/column.sweep/sweep.csv")).expect("table");
        // All but the wall time.
        let row = |row: &str| -> Vec<String> {
            row.split(',').enumerate().filter(|(i, _)| *i != 4).map(|(_, cell)| cell.to_owned()).collect()
        };
        table.lines().flat_map(row).collect()
    };
    let whole = tempfile::tempdir().expect("temporary directory");
    std::fs::write(whole.path().join("column.toml"), long_job(6)).expect("job");
    assert!(sweep(whole.path(), &over).output().expect("starts").status.success());
    for name in ["TERM", "USR1", "INT"] {
        let directory = tempfile::tempdir().expect("temporary directory");
        std::fs::write(directory.path().join("column.toml"), long_job(6)).expect("job");
        let child = begun(directory.path());
        signal(child.id(), name);
        let output = child.wait_with_output().expect("ended");
        assert_eq!(output.status.code(), Some(3), "{name}: {}", words(&output));
        assert!(words(&output).contains("the same command continues"), "{name}: {}", words(&output));
        let run = directory.path().join("out/column.sweep/density=1600");
        let left: Vec<String> = std::fs::read_dir(run)
            .expect("directory")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        assert!(left.iter().any(|name| name.contains("checkpoint")), "{name}: {left:?}");
        assert!(
            !left.iter().any(|name| name.ends_with(".part") || name.ends_with(".lock")),
            "{name}: {left:?}"
        );
        let output = sweep(directory.path(), &over).output().expect("starts");
        assert!(output.status.success(), "{name}: {}", words(&output));
        assert_eq!(values(directory.path()), values(whole.path()), "{name}");
    }
}

/// Two sweeps in a directory would take each other's runs.
#[test]
fn a_second_sweep_in_the_directory_is_refused() {
    let directory = tempfile::tempdir().expect("temporary directory");
    std::fs::write(directory.path().join("column.toml"), long_job(99)).expect("job");
    let first = begun(directory.path());
    let second =
        sweep(directory.path(), &["--over", "materials.sand.density=1600,1700"]).output().expect("starts");
    signal(first.id(), "TERM");
    let first = first.wait_with_output().expect("ended");
    assert_eq!(second.status.code(), Some(2), "{}", words(&second));
    assert!(words(&second).contains("found another sweep that writes here"), "{}", words(&second));
    assert_eq!(first.status.code(), Some(3), "{}", words(&first));
}

/// A change of the job leads to other results, and the old ones are lost only where the user says so.
#[test]
fn results_of_another_job_are_replaced_only_where_asked() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let job = directory.path().join("column.toml");
    let short = JOB.replace("end = 0.6", "end = 0.01");
    let over = ["--over", "materials.sand.young=1e6,2e6"];
    let results = || -> Vec<Vec<u8>> {
        ["young=1e6", "young=2e6"]
            .iter()
            .map(|run| directory.path().join("out/column.sweep").join(run).join("column.history.csv"))
            .map(|path| std::fs::read(path).expect("history"))
            .collect()
    };
    std::fs::write(&job, &short).expect("job");
    assert!(sweep(directory.path(), &over).output().expect("starts").status.success());
    let before = results();
    std::fs::write(&job, short.replace("density = 1600", "density = 1700")).expect("job");
    let output = sweep(directory.path(), &over).output().expect("starts");
    assert_eq!(output.status.code(), Some(2), "{}", words(&output));
    assert!(words(&output).contains("found a result of another job"), "{}", words(&output));
    assert!(words(&output).contains("--overwrite"), "{}", words(&output));
    assert!(results() == before, "results are as they were");
    let output = sweep(directory.path(), &over).arg("--overwrite").output().expect("starts");
    assert!(output.status.success(), "{}", words(&output));
    assert!(results().iter().zip(&before).all(|(new, old)| new != old));
    // An end before the states that are there: nothing can go on from them.
    std::fs::write(
        &job,
        short.replace("density = 1600", "density = 1700").replace("end = 0.01", "end = 0.004"),
    )
    .expect("job");
    let output = sweep(directory.path(), &over).output().expect("starts");
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    assert!(words(&output).contains("agimp sweep --overwrite starts it again"), "{}", words(&output));
    let output = sweep(directory.path(), &over).arg("--overwrite").output().expect("starts");
    assert!(output.status.success(), "{}", words(&output));
}

/// A run that was killed between its last output and its report has its whole row after the next start.
#[test]
fn a_run_that_has_lost_its_report_gets_its_row_again() {
    let directory = tempfile::tempdir().expect("temporary directory");
    std::fs::write(directory.path().join("column.toml"), JOB.replace("end = 0.6", "end = 0.01"))
        .expect("job");
    let over = ["--over", "materials.sand.young=1e6,2e6"];
    let table = || {
        let table =
            std::fs::read_to_string(directory.path().join("out/column.sweep/sweep.csv")).expect("table");
        let first: Vec<String> = table.lines().nth(1).expect("a row").split(',').map(str::to_owned).collect();
        // All but the wall time.
        [&first[..4], &first[5..]].concat()
    };
    assert!(sweep(directory.path(), &over).output().expect("starts").status.success());
    let before = table();
    let report = directory.path().join("out/column.sweep/young=1e6/column.report.json");
    for is_lost in [true, false] {
        if is_lost {
            std::fs::remove_file(&report).expect("removed");
        } else {
            // As earlier versions left it.
            let text = std::fs::read_to_string(&report).expect("report");
            let mut value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
            value["history"] = serde_json::json!({});
            std::fs::write(&report, value.to_string()).expect("written");
        }
        let output = sweep(directory.path(), &over).output().expect("starts");
        assert!(output.status.success(), "{}", words(&output));
        assert_eq!(table(), before);
        assert!(before.iter().all(|cell| !cell.is_empty()), "{before:?}");
    }
}
