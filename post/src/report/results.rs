//! The files of a run.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use agimp::io::hdf5_file::Reader;
use agimp::io::series::Series;
use agimp::io::snapshot::Header;
use agimp::io::snapshot::directory::{self, series_path};
use agimp::run::at_end::ending::Ending;
use agimp::run::at_end::report::{self, Report};
use agimp::run::claim;

/// The results of a run in a directory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Results {
    /// Directory of all its files.
    pub directory: PathBuf,
    /// Name of the job.
    pub name: String,
}

/// Why a directory does not determine a run.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unclear {
    /// No run has written there.
    #[error("{}: found no history of a run (NAME.history.csv); expected the directory of the results of a run", .0.display())]
    Nothing(PathBuf),
    /// Several runs have.
    #[error("{}: found the results of {}; choose one with --name", .0.display(), .1.join(", "))]
    Several(PathBuf, Vec<String>),
}

/// State of a run.
#[derive(Debug, PartialEq)]
pub(super) enum State {
    /// It has written its report.
    Finished,
    /// It holds its lock; the process.
    Running(String),
    /// It has recorded why it has ended.
    Told(Ending),
    /// None of these: it was killed.
    Ended,
}

/// Ending of the file that each run begins with.
const HISTORY: &str = ".history.csv";

impl Results {
    /// The results in a directory, of the job of this name if one is given.
    ///
    /// # Errors
    /// There are none, or those of several jobs.
    pub fn in_directory(directory: &Path, name: Option<&str>) -> Result<Self, Unclear> {
        let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
        let mut names: Vec<String> = entries
            .filter_map(|entry| Some(entry.file_name().to_str()?.strip_suffix(HISTORY)?.to_owned()))
            .filter(|found| name.is_none_or(|name| name == found))
            .collect();
        names.sort_unstable();
        match names.len() {
            0 => Err(Unclear::Nothing(directory.into())),
            1 => Ok(Self { directory: directory.into(), name: names.remove(0) }),
            _ => Err(Unclear::Several(directory.into(), names)),
        }
    }

    /// The file with this ending.
    pub fn path(&self, ending: &str) -> PathBuf {
        self.directory.join(format!("{}.{ending}", self.name))
    }

    /// Outputs in order of time.
    pub(super) fn outputs(&self) -> Vec<PathBuf> {
        let entries = Series::listed(&series_path(&self.directory, &self.name)).unwrap_or_default();
        entries
            .into_iter()
            .map(|entry| self.directory.join(entry.name))
            .filter(|path| path.is_file())
            .collect()
    }

    /// Name and path of the table of each line of points.
    pub(super) fn lines(&self) -> Vec<(String, PathBuf)> {
        let start = format!("{}.line_", self.name);
        let entries = std::fs::read_dir(&self.directory).into_iter().flatten().flatten();
        let line = |entry: std::fs::DirEntry| {
            let name = entry.file_name().to_str()?.strip_prefix(&start)?.strip_suffix(".csv")?.to_owned();
            Some((name, entry.path()))
        };
        let mut lines: Vec<_> = entries.filter_map(line).collect();
        lines.sort();
        lines
    }

    /// The latest state from which a run can continue, by its header: file, step, time (s).
    pub(super) fn last_state(&self) -> Option<(PathBuf, u64, f64)> {
        let candidates = directory::candidates(&self.directory, &self.name, None).ok()?;
        let (path, step) = candidates.whole.into_iter().next()?;
        let time = header(&path)?.time;
        Some((path, step, time))
    }

    /// Report of the run (`JOB.report.json`), if it has finished.
    pub(super) fn report(&self) -> Option<Report> {
        serde_json::from_slice(&std::fs::read(report::path(&self.directory, &self.name)).ok()?).ok()
    }

    /// State of the run; `is_finished` if it has its report.
    pub(super) fn state(&self, is_finished: bool) -> State {
        match claim::holder(&self.path("lock")) {
            _ if is_finished => State::Finished,
            Some(holder) => State::Running(holder),
            None => Ending::read(&self.directory, &self.name).map_or(State::Ended, State::Told),
        }
    }

    /// Files of the run by kind: name or pattern, number, bytes.
    pub(super) fn files(&self) -> Vec<(String, u64, u64)> {
        let mut kinds: BTreeMap<String, (u64, u64)> = BTreeMap::new();
        for entry in std::fs::read_dir(&self.directory).into_iter().flatten().flatten() {
            let (name, size) = (entry.file_name(), entry.metadata().map_or(0, |data| data.len()));
            let Some(name) = name.to_str() else { continue };
            let rest = name.strip_prefix(&*self.name).filter(|rest| rest.starts_with(['.', '_']));
            let Some(rest) = rest.filter(|rest| !rest.ends_with(".part")) else { continue };
            // A number of a series, which an ending follows, becomes a star.
            let digits = |part: &str| part.len() >= 6 && part.bytes().all(|byte| byte.is_ascii_digit());
            let parts: Vec<&str> = rest.split_inclusive(['.', '_']).collect();
            let pattern: String = parts
                .iter()
                .map(|part| match part.strip_suffix('.') {
                    Some(number) if digits(number) => "*.",
                    _ => part,
                })
                .collect();
            let kind = kinds.entry(format!("{}{pattern}", self.name)).or_default();
            *kind = (kind.0 + 1, kind.1 + size);
        }
        kinds.into_iter().map(|(name, (number, size))| (name, number, size)).collect()
    }
}

/// Header of an output, if it can be read.
pub(super) fn header(output: &Path) -> Option<Header> {
    Header::read(&Reader::open_alone(output).ok()?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_says_whose_results_it_holds() {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        assert!(matches!(Results::in_directory(here, None), Err(Unclear::Nothing(_))));
        std::fs::write(here.join("a.history.csv"), "").unwrap();
        assert_eq!(Results::in_directory(here, None).unwrap().name, "a");
        std::fs::write(here.join("b.c.history.csv"), "").unwrap();
        let names = vec!["a".to_owned(), "b.c".to_owned()];
        assert_eq!(Results::in_directory(here, None), Err(Unclear::Several(here.into(), names)));
        assert_eq!(Results::in_directory(here, Some("b.c")).unwrap().name, "b.c");
        assert_eq!(Results::in_directory(here, Some("a")).unwrap().state(false), State::Ended);
    }

    #[test]
    fn files_of_a_series_are_one_kind() {
        let directory = tempfile::tempdir().unwrap();
        for name in
            ["a_000000.hdf", "a_000001.hdf", "a_000000.tree.hdf", "a.history.csv", "ab.png", "a_1.txt.part"]
        {
            std::fs::write(directory.path().join(name), "12").unwrap();
        }
        let files = Results { directory: directory.path().into(), name: "a".into() }.files();
        let expected = [("a.history.csv", 1, 2), ("a_*.hdf", 2, 4), ("a_*.tree.hdf", 1, 2)];
        assert_eq!(files, expected.map(|(name, number, size)| (name.to_owned(), number, size)));
    }
}
