//! Tables over time from files of comma-separated values, such as records of earthquakes.
//!
//! Cells are separated by commas, semicolons or tabs, whichever the first line has; lines that begin with `#` are remarks. The first
//! line may hold names.
use std::path::Path;

use super::{Table, TableError};
use crate::input_file;
use crate::text::excerpt;

/// Which column of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Column {
    /// By its number, from 1.
    Number(usize),
    /// By its name in the first line.
    Name(String),
}

/// Why a file gives no table.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// It cannot be read.
    #[error("it cannot be read: {0}")]
    System(#[from] std::io::Error),
    /// What is wrong in a line.
    #[error("line {line}: {reason}")]
    Line {
        /// The line, from 1.
        line: u64,
        /// What was found and what is expected.
        reason: String,
    },
    /// No rows.
    #[error("it contains no row of numbers")]
    Empty,
}

/// Most bytes of a file.
const MOST_BYTES: u64 = 1 << 28;

/// Longest piece of a file in a message.
const QUOTED: usize = 40;

/// The table of two columns of a file, times in s; values are multiplied by `scale`.
///
/// # Errors
/// The file cannot be read, lacks a column, or holds what is no table.
pub fn read(path: &Path, time: &Column, value: &Column, scale: f64) -> Result<Table, RecordError> {
    parse(&input_file::read(path, MOST_BYTES)?, time, value, scale)
}

fn parse(bytes: &[u8], time: &Column, value: &Column, scale: f64) -> Result<Table, RecordError> {
    // Some programs put a mark of the order of bytes first.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = csv::ReaderBuilder::new();
    reader.has_headers(false).flexible(true).trim(csv::Trim::All).delimiter(separator(bytes));
    let mut record = csv::ByteRecord::new();
    let (mut columns, mut rows, mut lines) = (None, Vec::new(), Vec::new());
    for (line, text) in (1..).zip(bytes.split(|&byte| byte == b'\n')).filter(|(_, text)| holds_cells(text)) {
        // One line at a time: the reader would not count those that it passes over.
        let read = reader.buffer_capacity(text.len()).from_reader(text).read_byte_record(&mut record);
        read.map_err(|error| RecordError::Line { line, reason: error.to_string() })?;
        let [time_at, value_at] = match columns {
            Some(columns) => columns,
            None => {
                let (found, is_header) = find_columns(&record, time, value, line)?;
                columns = Some(found);
                if is_header {
                    continue;
                }
                found
            }
        };
        let row = (number(&record, time_at, line)?, scale * number(&record, value_at, line)?);
        rows.push(row);
        lines.push(line);
    }
    Table::new(&rows).map_err(|error| {
        let of_row = |row: usize| lines.get(row - 1).copied().unwrap_or(0);
        match error {
            TableError::Empty => RecordError::Empty,
            TableError::Order { row, time } => RecordError::Line {
                line: of_row(row),
                reason: format!(
                    "found the time {time} s, which is not later than the previous row; expected increasing times"
                ),
            },
            TableError::NotFinite { row } => RecordError::Line {
                line: of_row(row),
                reason: "found a number that is not finite; expected finite times and values".into(),
            },
        }
    })
}

/// What separates cells: the one of comma, semicolon and tab that the first line with something to read has.
fn separator(bytes: &[u8]) -> u8 {
    let first = bytes.split(|&byte| byte == b'\n').find(|text| holds_cells(text)).unwrap_or_default();
    b";\t".iter().copied().find(|separator| first.contains(separator)).unwrap_or(b',')
}

/// Whether a line is neither blank nor a remark.
fn holds_cells(text: &[u8]) -> bool {
    !text.trim_ascii().is_empty() && text[0] != b'#'
}

/// Places of the two columns, and whether the first line holds names.
fn find_columns(
    first: &csv::ByteRecord,
    time: &Column,
    value: &Column,
    line: u64,
) -> Result<([usize; 2], bool), RecordError> {
    let place = |column: &Column| match column {
        Column::Number(number) => Ok(number - 1),
        Column::Name(name) => first.iter().position(|cell| cell == name.as_bytes()).ok_or_else(|| {
            let names: Vec<String> = first.iter().take(20).map(quoted).collect();
            let reason =
                format!("found no column {}; this line has {}", quoted(name.as_bytes()), names.join(", "));
            RecordError::Line { line, reason }
        }),
    };
    let places = [place(time)?, place(value)?];
    let is_named = [time, value].iter().any(|column| matches!(column, Column::Name(_)));
    let is_text = |at: &usize| first.get(*at).is_some_and(|cell| parsed(cell).is_none());
    Ok((places, is_named || places.iter().all(is_text)))
}

fn parsed(cell: &[u8]) -> Option<f64> {
    std::str::from_utf8(cell).ok()?.parse().ok()
}

fn number(record: &csv::ByteRecord, at: usize, line: u64) -> Result<f64, RecordError> {
    let fault = |reason| RecordError::Line { line, reason };
    let cell = record.get(at).ok_or_else(|| {
        fault(format!("found {} columns; expected a number in column {}", record.len(), at + 1))
    })?;
    parsed(cell)
        .ok_or_else(|| fault(format!("found {} in column {}; expected a number", quoted(cell), at + 1)))
}

fn quoted(cell: &[u8]) -> String {
    format!("\"{}\"", excerpt(&String::from_utf8_lossy(cell), QUOTED))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> Column {
        Column::Name(name.into())
    }

    fn by_number(text: &str) -> Result<Table, RecordError> {
        parse(text.as_bytes(), &Column::Number(1), &Column::Number(2), 1.0)
    }

    /// One record written as programs write it: with names or without, with commas, semicolons or tabs, with remarks, blank lines,
    /// quotes, ends of lines of Windows and a mark of the order of bytes.
    #[test]
    fn forms_of_one_record_give_one_table() {
        let table = Table::new(&[(0.0, 1.0), (0.5, -2e-3), (1.0, 4.0)]).unwrap();
        for text in [
            "0,1\n0.5,-2e-3\n1,4\n",
            "t,a\n0,1\n0.5,-0.002\n1,4",
            "# remark, with a comma\n\n t ; a ;b\r\n0;1;7\r\n0.5;-2e-3;x\r\n\r\n1;+4.0;\r\n",
            "\u{feff}\"t\"\t\"a\"\n0.0\t1.0\n# in between\n.5\t-2E-3\n1\t4\n",
        ] {
            assert_eq!(by_number(text).unwrap(), table, "{text:?}");
            if text.contains('t') {
                let found = parse(text.as_bytes(), &named("t"), &named("a"), 1.0).unwrap();
                assert_eq!(found, table, "{text:?}");
            }
        }
        let scaled = parse(b"v,t\n2,0\n3,1", &named("t"), &Column::Number(1), 0.5).unwrap();
        assert_eq!(scaled, Table::new(&[(0.0, 1.0), (1.0, 1.5)]).unwrap());
    }

    /// Each fault with its line.
    #[test]
    fn faults_name_their_line() {
        let reason = |result: Result<Table, RecordError>| result.unwrap_err().to_string();
        assert_eq!(
            reason(by_number("t,a\n0,1\n\n1,abc\n")),
            "line 4: found \"abc\" in column 2; expected a number"
        );
        assert_eq!(
            reason(by_number("0,1\n# remark\n0,2\n")),
            "line 3: found the time 0 s, which is not later than the previous row; expected increasing times"
        );
        assert_eq!(reason(by_number("0,1\n1\n")), "line 2: found 1 columns; expected a number in column 2");
        assert!(reason(by_number("0,1\n1,inf\n")).starts_with("line 2: found a number that is not finite"));
        assert!(
            reason(by_number("0,1\n1,1,5\n2,nan")).starts_with("line 3: found a number that is not finite")
        );
        assert_eq!(reason(by_number("t,a\n")), "it contains no row of numbers");
        assert_eq!(reason(by_number("")), "it contains no row of numbers");
        assert_eq!(
            reason(parse(b"# r\nt,a\n0,1\n", &named("t"), &named("acc"), 1.0)),
            "line 2: found no column \"acc\"; this line has \"t\", \"a\""
        );
    }
}
