//! ParaView itself opens what a run has written, by the names alone, with the times of the run and all
//! fields.
//!
//! Needs `pvbatch`; without it the test says so and passes. `AGIMP_PVBATCH` names another one than that of
//! the path.
use std::path::Path;
use std::process::Command;

use agimp::io::snapshot::PointField;
use serde_json::Value;

/// The `pvbatch` of this machine.
fn pvbatch() -> Option<String> {
    let program = std::env::var("AGIMP_PVBATCH").unwrap_or_else(|_| "pvbatch".into());
    Command::new(&program).arg("--version").output().is_ok().then_some(program)
}

/// Fields that a run of the job can show: that of contact needs two bodies.
fn fields(job: &str) -> impl Iterator<Item = PointField> {
    let bodies = text(job).matches("[[bodies]]").count();
    PointField::ALL.into_iter().filter(move |field| bodies > 1 || *field != PointField::ContactPressure)
}

/// A job that comes with the program.
fn text(job: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs").join(job);
    std::fs::read_to_string(path).expect("the job")
}

/// A short run of one of the jobs that come with the program, with every field. Returns the times of its
/// outputs.
fn run(directory: &Path, job: &str) -> Vec<f64> {
    let fields: Vec<PointField> = fields(job).collect();
    let mut job: toml::Table = text(job).parse().expect("TOML");
    job["time"]["end"] = 0.02.into();
    if fields.contains(&PointField::ContactPressure) {
        job.insert("contact".into(), vec![toml::Value::Table(toml::Table::new())].into());
    }
    let fields: Vec<&str> = fields.iter().map(|field| field.name()).collect();
    let output = format!("every = 0.01\nfields = {fields:?}").parse::<toml::Table>().expect("TOML");
    job["output"] = output.into();
    std::fs::write(directory.join("job.toml"), job.to_string()).expect("written");
    let mut program = Command::new(env!("CARGO_BIN_EXE_agimp"));
    let output =
        program.current_dir(directory).args(["run", "--quiet", "job.toml"]).output().expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let index = std::fs::read(directory.join("out/job/job.hdf.series")).expect("the index of the outputs");
    let index: Value = serde_json::from_slice(&index).expect("JSON");
    let times = index["files"].as_array().expect("files").iter();
    times.map(|entry| entry["time"].as_f64().expect("a time")).collect()
}

#[test]
fn paraview_opens_particles_and_tree_with_times_and_all_fields() {
    let Some(pvbatch) = pvbatch() else {
        eprintln!("passed over: there is no pvbatch (Debian: paraview python3-paraview)");
        return;
    };
    for (job, dimension) in [("column_collapse_2d.toml", 2), ("elastic_cubes.toml", 3)] {
        let directory = tempfile::tempdir().expect("temporary directory");
        let times = run(directory.path(), job);
        assert_eq!(times.len(), 3, "{times:?}");
        let files = ["job.hdf.series", "job.tree.hdf.series", "job_000001.hdf", "job_000001.tree.hdf"];
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/paraview_check.py");
        let output = Command::new(&pvbatch)
            .arg(script)
            .args(files)
            .current_dir(directory.path().join("out/job"))
            .output()
            .expect("pvbatch starts");
        let (text, errors) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        let found: Vec<Value> = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        assert_eq!(found.len(), files.len(), "{job}: {text}\n{errors}");
        println!("{job}: ParaView {}", found[0]["version"]);

        for (file, found) in files.into_iter().zip(&found) {
            let expected = if file.ends_with(".series") { &times[..] } else { &times[1..2] };
            let states = found["states"].as_array().expect("states");
            let stated: Vec<f64> = states.iter().filter_map(|state| state["time"].as_f64()).collect();
            assert_eq!(stated, expected, "{job}: {file}: times in the files");
            if file.ends_with(".series") {
                assert_eq!(
                    found["times"],
                    serde_json::json!(times),
                    "{job}: {file}: times that ParaView shows"
                );
            }
            for state in states {
                assert!(state["points"].as_u64() > Some(0), "{job}: {file}: {state}");
                if file.contains("tree") {
                    assert_eq!(state["cell_fields"]["level"], 1, "{job}: {file}: {state}");
                    let corners = 1 << dimension;
                    assert_eq!(
                        state["points"].as_u64(),
                        state["cells"].as_u64().map(|n| n * corners),
                        "{file}"
                    );
                    continue;
                }
                for field in fields(job) {
                    let components = match field {
                        PointField::Velocity | PointField::Displacement => 3,
                        PointField::Stress | PointField::StressCell | PointField::Strain => 6,
                        _ => 1,
                    };
                    assert_eq!(state["point_fields"][field.name()], components, "{job}: {file}: {state}");
                }
            }
        }
    }
}
