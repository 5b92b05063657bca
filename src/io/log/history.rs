//! `history.csv`: one row of scalars per reported step.

use std::path::Path;

use super::lines::{Lines, Verdict};
use crate::io::hdf5_file::FileError;

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
/// The first column is the step, the second the time. Numbers are written with enough digits to restore their
/// bits.
#[derive(Debug)]
pub struct History {
    lines: Lines,
    columns: usize,
    /// Step and values of the last row.
    last: Option<(u64, Vec<f64>)>,
}

/// Rows of the file of a run that continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Rows up to this step stay.
    pub to: u64,
    /// Step of the last row that has to be there, where that is known.
    pub expected: Option<u64>,
}

/// Rows that a damaged file has lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Time of the row before them, s; `None` if they were the first.
    pub after: Option<f64>,
    /// Time of the row behind them, s; `None` if they were the last.
    pub before: Option<f64>,
}

impl History {
    /// Not collective. Starts a new file, replacing an old one.
    pub fn create(path: &Path, columns: &[Column<'_>]) -> Result<Self, FileError> {
        let mut lines = Lines::create(path)?;
        lines.append(&header(columns))?;
        Ok(Self { lines, columns: columns.len(), last: None })
    }

    /// Not collective. Opens the file of a run that continues. Rows that are not `kept` are cut off, so that
    /// the finished file equals that of an uninterrupted run. Damaged lines are cut out, and a warning names
    /// the rows that are missing for that reason. Starts a new file if there is none, or none of it is whole.
    /// Each step has so many `rows`.
    ///
    /// # Errors
    /// The file cannot be opened, or has other columns.
    pub fn resume(
        path: &Path,
        columns: &[Column<'_>],
        rows: usize,
        kept: Kept,
    ) -> Result<(Self, Vec<Gap>), FileError> {
        let expected = header(columns);
        let mut seen = Seen { rows, ..Seen::default() };
        let lines = match path.symlink_metadata() {
            Ok(_) => Some(Lines::resume(path, |line| seen.judge(line, &expected, columns.len(), kept.to))?),
            Err(_) => None,
        };
        if seen.has_other_columns {
            let reason = "found columns that differ from those of this run; move the file or use another output.directory";
            return Err(FileError::Refused { path: path.into(), reason: reason.into() });
        }
        let history = match lines {
            Some(lines) if seen.has_header => {
                let last = seen.row.map(|(step, _)| (step, std::mem::take(&mut seen.values)));
                Self { lines, columns: columns.len(), last }
            }
            _ => {
                seen = Seen { rows, ..Seen::default() };
                Self::create(path, columns)?
            }
        };
        if kept.expected.is_some_and(|expected| seen.row.is_none_or(|(step, _)| step < expected)) {
            seen.gaps.push(Gap { after: seen.row.map(|(_, time)| time), before: None });
        }
        Ok((history, seen.gaps))
    }

    /// Step and values of the last row.
    pub fn last(&self) -> Option<(u64, &[f64])> {
        self.last.as_ref().map(|(step, values)| (*step, values.as_slice()))
    }

    /// Not collective. Appends the row of a step and passes it to the operating system.
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
        self.last = Some((step, values.to_vec()));
        self.lines.append(&row)
    }

    /// Not collective. Waits until all rows are on disk.
    pub fn sync(&self) -> Result<(), FileError> {
        self.lines.sync()
    }
}

/// Findings in the file of a run that continues.
#[derive(Default)]
struct Seen {
    has_header: bool,
    has_other_columns: bool,
    /// Whether there are damaged lines behind the last good one.
    is_damaged: bool,
    /// Rows that each step has.
    rows: usize,
    /// Step and time of the last good row.
    row: Option<(u64, f64)>,
    /// Its values.
    values: Vec<f64>,
    /// Good rows of that step.
    of_step: usize,
    gaps: Vec<Gap>,
}

impl Seen {
    fn judge(&mut self, line: &[u8], header: &str, columns: usize, to: u64) -> Verdict {
        if self.has_other_columns {
            return Verdict::Keep;
        }
        if !self.has_header {
            self.has_header = line == header.trim_end().as_bytes();
            // A whole line of text is no damage. Such a file is not changed.
            self.has_other_columns =
                !self.has_header && line.starts_with(b"step,") && std::str::from_utf8(line).is_ok();
            return if self.has_header || self.has_other_columns { Verdict::Keep } else { Verdict::Stop };
        }
        let (of_step, rows) = (self.of_step, self.rows);
        let is_next =
            |step: u64| self.row.is_none_or(|(before, _)| step > before || step == before && of_step < rows);
        match row(line, columns) {
            Some((step, _)) if step > to => Verdict::Stop,
            Some((step, values)) if is_next(step) => {
                let time = values[0];
                let is_same = self.row.is_some_and(|(before, _)| before == step);
                let is_short = !is_same && self.row.is_some() && of_step < rows;
                self.of_step = if is_same { of_step + 1 } else { 1 };
                if std::mem::take(&mut self.is_damaged) | is_short {
                    self.gaps.push(Gap { after: self.row.map(|(_, time)| time), before: Some(time) });
                }
                (self.row, self.values) = (Some((step, time)), values);
                Verdict::Keep
            }
            _ => {
                self.is_damaged = true;
                Verdict::Drop
            }
        }
    }
}

/// Step and values of a whole row.
fn row(line: &[u8], columns: usize) -> Option<(u64, Vec<f64>)> {
    let mut cells = std::str::from_utf8(line).ok()?.split(',');
    let step = cells.next()?.parse().ok()?;
    let values: Vec<f64> = cells.map(|cell| cell.parse().ok()).collect::<Option<_>>()?;
    (values.len() == columns).then_some((step, values))
}

fn header(columns: &[Column<'_>]) -> String {
    let mut header = String::from("step");
    for Column { name, unit } in columns {
        header.push_str(&if unit.is_empty() { format!(",{name}") } else { format!(",{name} [{unit}]") });
    }
    header + "\n"
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

    const fn up_to(step: u64) -> Kept {
        Kept { to: step, expected: Some(step) }
    }

    fn path(dir: &tempfile::TempDir, name: &str) -> std::path::PathBuf {
        dir.path().join(name)
    }

    fn append(path: &Path, bytes: &[u8]) {
        let mut text = std::fs::read(path).unwrap();
        text.extend_from_slice(bytes);
        std::fs::write(path, text).unwrap();
    }

    /// Rows of the steps 0 to 19, written in one go.
    fn whole() -> Vec<u8> {
        let dir = tempfile::tempdir().unwrap();
        let path = path(&dir, "whole.csv");
        write(&mut History::create(&path, &COLUMNS).unwrap(), 0..20);
        std::fs::read(&path).unwrap()
    }

    #[test]
    fn resumed_file_equals_an_uninterrupted_one() {
        let dir = tempfile::tempdir().unwrap();
        let torn = path(&dir, "torn.csv");
        write(&mut History::create(&torn, &COLUMNS).unwrap(), 0..15);
        append(&torn, b"15,0.3");
        let (mut history, gaps) = History::resume(&torn, &COLUMNS, 1, up_to(9)).unwrap();
        assert_eq!(gaps, []);
        write(&mut history, 10..20);
        let text = String::from_utf8(whole()).unwrap();
        assert_eq!(text, std::fs::read_to_string(&torn).unwrap());
        assert!(text.starts_with("step,time [s],particles\n0,0.0,1e30\n"), "{text}");
        let third = text.lines().nth(4).unwrap().split(',').nth(1).unwrap();
        assert_eq!(third.parse::<f64>().unwrap(), 3.0 * 0.1);
    }

    #[test]
    fn torn_row_with_a_number_that_looks_whole_is_cut() {
        let dir = tempfile::tempdir().unwrap();
        let path = path(&dir, "h.csv");
        write(&mut History::create(&path, &COLUMNS).unwrap(), 0..3);
        append(&path, b"3,0.3");
        drop(History::resume(&path, &COLUMNS, 1, up_to(100)).unwrap());
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 4);
    }

    /// After any crash whole rows stay, and a warning names the missing ones.
    #[test]
    fn damage_is_cut_out_and_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = path(&dir, "h.csv");
        let (whole, row) = (whole(), |step: usize| format!("{step},{:?},1e30\n", step as f64 * 0.1));
        let text = String::from_utf8(whole.clone()).unwrap();
        let start_of = |step: usize| text.find(&row(step)).unwrap();
        let gap = |after: Option<usize>, before: Option<usize>| Gap {
            after: after.map(|step| step as f64 * 0.1),
            before: before.map(|step| step as f64 * 0.1),
        };
        // Bytes from..to become what a crash leaves of them; then the rows that are gone.
        let end = whole.len();
        let cases: [(usize, usize, &[u8], Vec<Gap>); 9] = [
            (0, end, b"", vec![gap(None, None)]),
            (0, end, &[0; 500], vec![gap(None, None)]),
            (10, end, b"", vec![gap(None, None)]),
            (start_of(0), end, b"", vec![gap(None, None)]),
            (start_of(7), end, b"", vec![gap(Some(6), None)]),
            (start_of(7) + 3, end, b"", vec![gap(Some(6), None)]),
            (start_of(7), end, b"\xff\xfe\n\xff", vec![gap(Some(6), None)]),
            (start_of(7), start_of(9), b"\0\0\0\0\n", vec![gap(Some(6), Some(9))]),
            (end, end, b"\0\0\0\0\0", vec![]),
        ];
        for (from, to, bytes, expected) in cases {
            let damaged = [&whole[..from], bytes, &whole[to..]].concat();
            std::fs::write(&path, &damaged).unwrap();
            let (mut history, gaps) = History::resume(&path, &COLUMNS, 1, up_to(15)).unwrap();
            assert_eq!(gaps, expected, "{from}..{to}");
            history.row(16, &[1.6, 1e30]).unwrap();
            let mended = std::fs::read_to_string(&path).unwrap();
            let steps: Vec<u64> =
                mended.lines().skip(1).map(|row| row.split(',').next().unwrap().parse().unwrap()).collect();
            let lost = |step: u64| {
                let time = step as f64 * 0.1;
                let is_inside =
                    |gap: &Gap| gap.after.is_none_or(|t| time > t) && gap.before.is_none_or(|t| time < t);
                expected.iter().any(is_inside)
            };
            let left: Vec<u64> = (0..16).filter(|&step| !lost(step)).chain([16]).collect();
            assert_eq!(steps, left, "{from}..{to}");
            assert!(mended.starts_with("step,time [s],particles\n"), "{mended}");
        }
    }

    #[test]
    fn a_missing_file_begins_where_the_run_goes_on() {
        let dir = tempfile::tempdir().unwrap();
        let (_, gaps) = History::resume(&path(&dir, "h.csv"), &COLUMNS, 1, up_to(3)).unwrap();
        assert_eq!(gaps, [Gap { after: None, before: None }]);
    }

    #[test]
    fn other_columns_are_refused_and_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        let path = path(&dir, "h.csv");
        write(&mut History::create(&path, &COLUMNS).unwrap(), 0..3);
        let error = History::resume(&path, &COLUMNS[..1], 1, up_to(0)).unwrap_err().to_string();
        assert!(error.contains("columns"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap().lines().count(), 4);
    }
}
