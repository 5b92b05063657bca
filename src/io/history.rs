//! `history.csv`: one row of scalars per reported step.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::hdf5_file::FileError;

/// A column of the history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column<'a> {
    /// Name, for example `kinetic_energy`.
    pub name: &'a str,
    /// SI unit, for example `J`; empty for a pure number.
    pub unit: &'a str,
}

/// The open history file. Belongs to rank 0.
///
/// The first column is the step. Numbers are written with the digits that bring back the same bits.
#[derive(Debug)]
pub struct History {
    file: File,
    path: PathBuf,
    columns: usize,
    last: Option<u64>,
}

impl History {
    /// Not collective. Starts a new file, replacing an old one.
    pub fn create(path: &Path, columns: &[Column<'_>]) -> Result<Self, FileError> {
        let file = File::create(path).map_err(|source| system(path, "create", source))?;
        let mut history = Self { file, path: path.into(), columns: columns.len(), last: None };
        history.line(header(columns))?;
        Ok(history)
    }

    /// Not collective. Opens the file of an earlier run that is restarted from `step`: rows of later
    /// steps and a torn last line are cut off, so that the finished file equals that of an
    /// uninterrupted run. Starts a new file if there is none.
    pub fn resume(path: &Path, columns: &[Column<'_>], step: u64) -> Result<Self, FileError> {
        if !path.exists() {
            return Self::create(path, columns);
        }
        let failed = |source| system(path, "resume", source);
        let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(failed)?;
        let mut lines = BufReader::new(&file);
        let (mut line, mut kept, mut last) = (String::new(), 0, None);
        loop {
            line.clear();
            let bytes = lines.read_line(&mut line).map_err(failed)?;
            let whole = line.ends_with('\n');
            if kept == 0 && (!whole || line != header(columns)) {
                let reason = "the columns are not those of this run; move the file away or restart elsewhere";
                return Err(FileError::Refused { path: path.into(), reason: reason.into() });
            }
            let row = line.split(',').next().and_then(|cell| cell.parse::<u64>().ok());
            let earlier = kept == 0 || row.is_some_and(|row| row <= step);
            if !whole || !earlier {
                break;
            }
            last = row;
            kept += bytes as u64;
        }
        file.set_len(kept).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        Ok(Self { file, path: path.into(), columns: columns.len(), last })
    }

    /// Step of the last row.
    pub fn last_step(&self) -> Option<u64> {
        self.last
    }

    /// Not collective. Appends the row of a step and hands it to the operating system.
    ///
    /// # Panics
    /// If the number of values is not the number of columns.
    pub fn row(&mut self, step: u64, values: &[f64]) -> Result<(), FileError> {
        assert_eq!(values.len(), self.columns, "one value per column");
        let mut row = step.to_string();
        for value in values {
            row.push_str(&format!(",{value:?}"));
        }
        row.push('\n');
        self.last = Some(step);
        self.line(row)
    }

    fn line(&mut self, line: String) -> Result<(), FileError> {
        self.file.write_all(line.as_bytes()).map_err(|source| system(&self.path, "write", source))
    }
}

fn header(columns: &[Column<'_>]) -> String {
    let mut header = String::from("step");
    for Column { name, unit } in columns {
        header.push_str(&if unit.is_empty() { format!(",{name}") } else { format!(",{name} [{unit}]") });
    }
    header + "\n"
}

fn system(path: &Path, action: &'static str, source: std::io::Error) -> FileError {
    FileError::System { path: path.into(), action, source }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: [Column; 2] = [Column { name: "time", unit: "s" }, Column { name: "particles", unit: "" }];

    fn write(history: &mut History, steps: std::ops::Range<u64>) {
        for step in steps {
            history.row(step, &[step as f64 * 0.1, 1e30]).unwrap();
        }
    }

    #[test]
    fn resumed_file_equals_an_uninterrupted_one() {
        let dir = tempfile::tempdir().unwrap();
        let (whole, torn) = (dir.path().join("whole.csv"), dir.path().join("torn.csv"));
        write(&mut History::create(&whole, &COLUMNS).unwrap(), 0..20);
        write(&mut History::create(&torn, &COLUMNS).unwrap(), 0..15);
        OpenOptions::new().append(true).open(&torn).unwrap().write_all(b"15,0.3").unwrap();
        write(&mut History::resume(&torn, &COLUMNS, 9).unwrap(), 10..20);
        let text = std::fs::read_to_string(&whole).unwrap();
        assert_eq!(text, std::fs::read_to_string(&torn).unwrap());
        assert!(text.starts_with("step,time [s],particles\n0,0.0,1e30\n"), "{text}");
        let third = text.lines().nth(4).unwrap().split(',').nth(1).unwrap();
        assert_eq!(third.parse::<f64>().unwrap(), 3.0 * 0.1);
    }

    #[test]
    fn torn_row_with_a_number_that_looks_whole_is_cut() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("h.csv");
        write(&mut History::create(&path, &COLUMNS).unwrap(), 0..3);
        OpenOptions::new().append(true).open(&path).unwrap().write_all(b"3,0.3").unwrap();
        drop(History::resume(&path, &COLUMNS, 100).unwrap());
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 4);
    }

    #[test]
    fn other_columns_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("h.csv");
        drop(History::create(&path, &COLUMNS).unwrap());
        let error = History::resume(&path, &COLUMNS[..1], 0).unwrap_err().to_string();
        assert!(error.contains("columns"), "{error}");
    }
}
