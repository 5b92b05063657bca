//! The history that a run has written. The test has the module `launch`.
use std::collections::HashMap;
use std::path::Path;

use super::launch::{file, run, succeed};

/// Columns of a history by name, without units.
pub(crate) struct History(HashMap<String, Vec<f64>>);

impl History {
    /// Of the run of this name in a directory.
    pub(crate) fn read(directory: &Path, name: &str) -> Self {
        let text = std::fs::read_to_string(file(directory, name, ".history.csv")).expect("history");
        let mut lines = text.lines();
        let names = lines.next().expect("header").split(',');
        let rows: Vec<Vec<f64>> =
            lines.map(|row| row.split(',').map(|cell| cell.parse().expect("number")).collect()).collect();
        let column = |i: usize| rows.iter().map(|row| row[i]).collect();
        let name = |cell: &str| cell.split(' ').next().unwrap_or_default().to_owned();
        Self(names.enumerate().map(|(i, cell)| (name(cell), column(i))).collect())
    }

    /// Of a job of this name and text, run on one rank and thread with these arguments.
    pub(crate) fn of_job(name: &str, text: &str, arguments: &[&str]) -> Self {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join(format!("{name}.toml"));
        std::fs::write(&path, text).expect("job");
        let arguments: Vec<&str> = std::iter::once("--quiet").chain(arguments.iter().copied()).collect();
        succeed(&mut run(directory.path(), 1, 1, &path, &arguments));
        Self::read(directory.path(), name)
    }

    /// Values of a column, row by row.
    pub(crate) fn column(&self, name: &str) -> &[f64] {
        self.0.get(name).unwrap_or_else(|| panic!("no column {name}: {:?}", self.0.keys()))
    }

    /// Value of a column in the last row.
    pub(crate) fn last(&self, name: &str) -> f64 {
        *self.column(name).last().expect("a row")
    }

    /// Integral over time of a column of mean forces since the row before, from the first row at or after
    /// `start`. Forces have acted up to the time of the velocities, half a step before that of the row.
    pub(crate) fn integral(&self, name: &str, start: f64) -> f64 {
        let (time, values) = (self.column("time"), self.column(name));
        let acted = self.times_of_velocities();
        (1..time.len()).filter(|&i| time[i - 1] >= start).map(|i| values[i] * (acted[i] - acted[i - 1])).sum()
    }

    /// Times to which the velocities of each row belong, s: half a step ago.
    pub(crate) fn times_of_velocities(&self) -> Vec<f64> {
        self.column("time").iter().zip(self.column("dt")).map(|(time, dt)| time - 0.5 * dt).collect()
    }

    /// The same of the last row, s.
    pub(crate) fn time_of_velocities(&self) -> f64 {
        self.last("time") - 0.5 * self.last("dt")
    }

    /// Value of a column in the first row at or after `start`, with its time.
    pub(crate) fn at(&self, name: &str, start: f64) -> (f64, f64) {
        let row = self.column("time").iter().position(|&time| time >= start).expect("a row");
        (self.column("time")[row], self.column(name)[row])
    }
}
