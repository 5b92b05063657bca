//! Runs of the program and what they tell about themselves.
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use agimp::io::log::telemetry::Record;

use crate::checked;

/// Clock ticks per second in `/proc`; the same on all Linux systems.
const TICKS: f64 = 100.0;

/// A run that has ended.
pub(crate) struct Run {
    /// Its records, in order.
    pub records: Vec<Record>,
    /// Wall time, s.
    pub wall: f64,
    /// Processor time of all threads, s.
    pub processor: f64,
    /// Name of the columns and the last row of the history.
    pub history: Vec<(String, f64)>,
    /// The last output file.
    pub last_output: PathBuf,
}

impl Run {
    /// Particles at the start, at most, and at the end.
    pub(crate) fn particles(&self) -> [u64; 3] {
        let counts = || self.records.iter().map(|record| record.particles);
        [counts().next(), counts().max(), counts().next_back()].map(Option::unwrap_or_default)
    }

    /// Steps.
    pub(crate) fn steps(&self) -> u64 {
        self.records.last().map_or(0, |record| record.step)
    }

    /// Sum of the particles over all steps.
    pub(crate) fn particle_steps(&self) -> f64 {
        self.records.iter().map(|record| record.steps as f64 * record.particles as f64).sum()
    }

    /// Greatest resident memory in a record, bytes.
    pub(crate) fn memory(&self) -> f64 {
        self.records.iter().map(|record| record.memory.max).fold(0.0, f64::max)
    }

    /// Wall time of the named phase, s.
    pub(crate) fn phase(&self, name: &str) -> f64 {
        let phases = self.records.iter().flat_map(|record| &record.phases);
        phases.filter(|phase| phase.phase == name).map(|phase| phase.seconds.max).sum()
    }

    /// Wall time that the records account for, s.
    pub(crate) fn recorded(&self) -> f64 {
        self.records.iter().map(|record| record.wall_seconds).sum()
    }
}

/// Runs a job with all cores of the machine.
pub(crate) fn run(job: &toml::Table, name: &str, folder: &Path) -> Run {
    let file = folder.join(name).with_extension("toml");
    let results = folder.join(name);
    let mut job = job.clone();
    if let Some(output) = job.get_mut("output").and_then(toml::Value::as_table_mut) {
        output.insert("directory".into(), results.display().to_string().into());
    }
    checked(std::fs::write(&file, job.to_string()), file.display());
    // Files of an earlier comparison would be taken for this one's.
    if results.exists() {
        checked(std::fs::remove_dir_all(&results), results.display());
    }
    let (start, ticks) = (Instant::now(), ticks_of_children());
    let status = Command::new("target/release/agimp").args(["run", "--quiet"]).arg(&file).status();
    let status = checked(status, "target/release/agimp");
    if !status.success() {
        checked(Err::<(), _>(status), file.display());
    }
    let (wall, processor) = (start.elapsed().as_secs_f64(), (ticks_of_children() - ticks) / TICKS);
    let telemetry = results.join(format!("{name}.telemetry.jsonl"));
    let lines = checked(std::fs::read_to_string(&telemetry), telemetry.display());
    let records =
        lines.lines().map(|line| checked(serde_json::from_str(line), telemetry.display())).collect();
    let history = last_row(&results.join(format!("{name}.history.csv")));
    let last_output = results.join(format!("{name}_000001.hdf"));
    Run { records, wall, processor, history, last_output }
}

/// Processor time of the children that have ended, in ticks.
fn ticks_of_children() -> f64 {
    let path = "/proc/self/stat";
    let text = checked(std::fs::read_to_string(path), path);
    // The name of the program, in brackets, may contain spaces. User and system time are fields 16 and 17 of the file.
    let fields = text.rsplit(')').next().unwrap_or_default().split_whitespace().skip(13).take(2);
    fields.filter_map(|field| field.parse::<f64>().ok()).sum()
}

/// The last row of a history with the names of its columns, without units.
fn last_row(path: &Path) -> Vec<(String, f64)> {
    let text = checked(std::fs::read_to_string(path), path.display());
    let heads = text.lines().next().unwrap_or_default().split(',');
    let names = heads.map(|head| head.split(" [").next().unwrap_or_default().to_owned());
    let values = text.lines().last().unwrap_or_default().split(',');
    names.zip(values.map(|value| value.parse().unwrap_or(f64::NAN))).collect()
}

/// Resident memory of a job with next to no particles, bytes.
pub(crate) fn memory_of_an_empty_job(folder: &Path) -> f64 {
    let text = r#"
        version = 1
        title = "Next to nothing"
        dimension = 2
        domain = { size = [1, 1], root_edge = 1 }
        time = { end = 1e-3 }
        materials = [{ name = "a", density = 1000, model = "hencky", young = 1e5, poisson = 0.3 }]
        bodies = [{ name = "b", material = "a", shape = { kind = "box", min = [0, 0], max = [0.5, 0.5] } }]
        output = { picture = false }
    "#;
    let job = checked(toml::from_str(text), "the smallest job");
    run(&job, "nothing", folder).memory()
}
