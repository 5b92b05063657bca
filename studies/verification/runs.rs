//! Runs of the binary on job files, and what they leave.
use std::path::{Path, PathBuf};
use std::process::Command;

use agimp::adaptivity::resample::ids::generation;
use agimp::io::hdf5_file::Reader;

use crate::checked;

/// How jobs are run.
pub(crate) struct Runs {
    /// The program.
    pub agimp: PathBuf,
    /// Top of the repository.
    pub top: PathBuf,
    /// Where the results go.
    pub folder: PathBuf,
    /// Ranks.
    pub ranks: usize,
    /// Which sizes are run.
    pub effort: Effort,
    /// Settings that all runs get beside their own.
    pub set: Vec<String>,
}

/// Which sizes are run.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
pub(crate) enum Effort {
    /// What takes seconds.
    Quick,
    /// All.
    Full,
}

/// What a run has left.
pub(crate) struct Results {
    folder: PathBuf,
    name: String,
    /// Processor time of the run, s.
    pub processor: f64,
}

impl Runs {
    /// Whether all sizes are run.
    pub(crate) fn is_full(&self) -> bool {
        self.effort == Effort::Full
    }

    /// The program on so many ranks.
    pub(crate) fn command(&self, ranks: usize) -> Command {
        if ranks == 1 {
            return Command::new(&self.agimp);
        }
        let mut mpirun = Command::new("mpirun");
        mpirun.args(["-n", &ranks.to_string()]).arg(&self.agimp);
        mpirun
    }

    /// Runs a job of `jobs/` with settings `KEY=VALUE`; the results have a name of their own.
    pub(crate) fn run(&self, job: &str, name: &str, settings: &[String]) -> Results {
        let path = self.top.join("jobs").join(job).with_extension("toml");
        let folder = self.folder.join(name);
        let mut command = self.command(self.ranks);
        command.arg("run").arg(&path).args(["--overwrite", "--threads", "1", "--out"]).arg(&folder);
        settings.iter().chain(&self.set).for_each(|setting| _ = command.args(["--set", setting]));
        let before = ticks_of_children();
        let output = checked(command.output());
        let processor = (ticks_of_children() - before) / TICKS;
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command:?}\n{text}");
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Results { folder, name: stem, processor }
    }

    /// A column of words of a reference.
    pub(crate) fn texts(&self, file: &str, name: &str) -> Vec<String> {
        let path = self.top.join("studies/verification/references").join(file);
        let mut reader = checked(csv::Reader::from_path(path));
        let place = checked(reader.headers()).iter().position(|head| head == name).unwrap_or(0);
        reader.records().map(|row| checked(row).get(place).unwrap_or_default().to_owned()).collect()
    }

    /// A table of a reference: the columns of these names.
    pub(crate) fn reference<const N: usize>(&self, file: &str, names: [&str; N]) -> Vec<[f64; N]> {
        table(&self.top.join("studies/verification/references").join(file), names)
    }
}

impl Results {
    /// Columns of the history whose names begin so.
    pub(crate) fn history<const N: usize>(&self, names: [&str; N]) -> Vec<[f64; N]> {
        table(&self.folder.join(format!("{}.history.csv", self.name)), names)
    }

    /// Numbers of the outputs.
    pub(crate) fn outputs(&self) -> usize {
        (0..).take_while(|number| self.output(*number).exists()).count()
    }

    fn output(&self, number: usize) -> PathBuf {
        self.folder.join(format!("{}_{number:06}.hdf", self.name))
    }

    fn ids(&self, number: usize) -> Vec<u64> {
        let file = checked(Reader::open_alone(&self.output(number)));
        let rows = checked(file.stored("state/particles/id")).rows;
        checked(file.read_slab("state/particles/id", 0, rows))
    }

    /// Whether each particle of an output has not split, in the order of their identifiers.
    pub(crate) fn are_whole(&self, number: usize) -> Vec<bool> {
        let mut ids = self.ids(number);
        ids.sort_unstable();
        ids.into_iter().map(|id| generation(id) == 0).collect()
    }

    /// A data set of an output, row by row, the particles in the order of their identifiers.
    pub(crate) fn particles(&self, number: usize, field: &str, width: usize) -> Vec<Vec<f64>> {
        let file = checked(Reader::open_alone(&self.output(number)));
        let ids = self.ids(number);
        let dataset = format!("state/particles/{field}");
        let values = checked(file.read_slab::<f64>(&dataset, 0, checked(file.stored(&dataset)).rows));
        let mut order: Vec<usize> = (0..ids.len()).collect();
        order.sort_by_key(|&row| ids[row]);
        order.into_iter().map(|row| values[row * width..][..width].to_vec()).collect()
    }

    /// Time of an output, s.
    pub(crate) fn time(&self, number: usize) -> f64 {
        let file = checked(Reader::open_alone(&self.output(number)));
        checked(file.read_slab::<f64>("VTKHDF/FieldData/TimeValue", 0, 1))[0]
    }
}

/// Clock ticks per second in `/proc`; the same on all Linux systems.
const TICKS: f64 = 100.0;

/// Processor time of the children that have ended, in ticks; 0 where there is no `/proc`.
fn ticks_of_children() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the program, in brackets, may contain spaces. User and system time of children are fields 16 and 17 of the file.
    let fields = text.rsplit(')').next().unwrap_or_default().split_whitespace().skip(13).take(2);
    fields.filter_map(|field| field.parse::<f64>().ok()).sum()
}

/// Columns of a table whose names begin so.
fn table<const N: usize>(path: &Path, names: [&str; N]) -> Vec<[f64; N]> {
    let mut reader = checked(csv::Reader::from_path(path));
    let heads = checked(reader.headers()).clone();
    let places = names.map(|name| {
        let exact = heads.iter().position(|head| head == name);
        let place = exact.or_else(|| heads.iter().position(|head| head.starts_with(name)));
        place.unwrap_or_else(|| panic!("{}: no column {name}", path.display()))
    });
    let rows = reader.records().map(|row| {
        let row = checked(row);
        places.map(|place| row.get(place).and_then(|cell| cell.parse().ok()).unwrap_or(f64::NAN))
    });
    rows.collect()
}

/// The value of a table of two columns between its rows.
pub(crate) fn between(table: &[[f64; 2]], x: f64) -> f64 {
    let after = table.iter().position(|row| row[0] > x).unwrap_or(table.len());
    let (low, high) = (table[after.saturating_sub(1)], table[after.min(table.len() - 1)]);
    if high[0] > low[0] { low[1] + (high[1] - low[1]) * (x - low[0]) / (high[0] - low[0]) } else { low[1] }
}
