//! One run of a sweep: what it is started with, and what it has left.
use std::path::{Path, PathBuf};

use agimp::run::at_end::report::{self, Report};

/// Arguments of `agimp sweep`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Job file (TOML).
    pub(super) job: PathBuf,
    /// A key of the job, as for --set, and its values, separated by commas; with several keys, each
    /// combination is run.
    #[arg(long, value_name = "KEY=A,B,C", required = true)]
    pub(super) over: Vec<String>,
    /// A value for all runs, as for `agimp run`; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
    /// Columns of the history to print for each run, by the beginning of their names; all are in sweep.csv.
    #[arg(long, value_name = "COLUMNS", value_delimiter = ',')]
    pub(super) show: Vec<String>,
    /// Directory of the sweep: one directory for each run, and `sweep.csv`; out/NAME.sweep by default.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Words before `agimp run`, such as "mpirun -n 4".
    #[arg(long, value_name = "WORDS", default_value = "")]
    pub(super) launch: String,
    /// Threads of each rank.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) threads: Option<u16>,
    /// Start runs again whose directories hold results that they cannot go on from, such as those of another
    /// job, and replace these.
    #[arg(long)]
    pub(super) overwrite: bool,
}

/// One run of the sweep.
pub(super) struct Run {
    /// Values in the order of the keys.
    pub(super) values: Vec<String>,
    /// Arguments of `--set`.
    pub(super) settings: Vec<String>,
    pub(super) directory: PathBuf,
    /// Expected in its results: digest of the job and end of the run, s.
    pub(super) digest: u64,
    pub(super) end: f64,
}

/// One row of the table.
pub(super) struct Row<'a> {
    pub(super) run: &'a Run,
    pub(super) status: &'static str,
    /// Of a run that has finished.
    pub(super) report: Option<Report>,
}

/// The report of a finished run of this job with these settings; each has the last row of its history.
pub(super) fn finished(path: &Path, run: &Run) -> Option<Report> {
    let report: Report = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
    let is_of_run = report.digest == report::digest(run.digest) && report.end == run.end;
    (is_of_run && !report.history.is_empty()).then_some(report)
}
