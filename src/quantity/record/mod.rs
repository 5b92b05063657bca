//! Tables over time from files, such as records of earthquakes.
//!
//! Cells are separated by semicolons, tabs or commas, whichever the first line has, or else by spaces; lines
//! that begin with `#` are remarks. The first line may hold names. Records of the PEER database, values at a
//! constant step without times, are known by their header: see `peer`.
use std::path::Path;

mod peer;
mod rows;

pub(super) use rows::quoted;
pub use rows::{RecordError, Rows, number_of};

use super::{Table, TableError};
use crate::input_file;
use crate::text::counted;

/// Which column of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Column {
    /// By its number, from 1.
    Number(usize),
    /// By its name in the first line.
    Name(String),
}

/// Most bytes of a file.
pub(super) const MOST_BYTES: u64 = 1 << 28;

/// The mark of the order of bytes that some programs put first.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// The table of two columns of a file, times in s; values are multiplied by `scale`.
///
/// # Errors
/// The file cannot be read, lacks a column, or is no table.
pub fn read(path: &Path, time: &Column, value: &Column, scale: f64) -> Result<Table, RecordError> {
    parse(&input_file::read(path, MOST_BYTES)?, time, value, scale)
}

/// The rows of these columns of a file; the first has the times, s, which increase.
///
/// # Errors
/// The file cannot be read, lacks a column, or a cell has no finite number.
pub fn read_rows(path: &Path, columns: &[Column]) -> Result<Rows, RecordError> {
    let rows = rows(&input_file::read(path, MOST_BYTES)?, columns)?;
    let of_times = |value: usize| table(&rows, value, 1.0);
    (1..columns.len()).try_for_each(|value| of_times(value).map(|_| ()))?;
    Ok(rows)
}

fn parse(bytes: &[u8], time: &Column, value: &Column, scale: f64) -> Result<Table, RecordError> {
    let is_plain = [time, value] == [&Column::Number(1), &Column::Number(2)];
    match peer::values(bytes) {
        Some(_) if !is_plain => Err(RecordError::Peer),
        Some(values) => table(&values?, 1, scale),
        None => table(&rows(bytes, &[time.clone(), value.clone()])?, 1, scale),
    }
}

/// The table of the first number of each row, the time, and another one.
fn table(rows: &Rows, value: usize, scale: f64) -> Result<Table, RecordError> {
    let pairs: Vec<(f64, f64)> = rows.numbers.iter().map(|row| (row[0], scale * row[value])).collect();
    Table::new(&pairs).map_err(|error| {
        let of_row = |row: usize| rows.lines.get(row - 1).copied().unwrap_or(0);
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

/// The cells of the first line that is neither blank nor a remark, and its number, from 1.
pub(super) fn first_line(bytes: &[u8]) -> Option<(u64, Vec<Vec<u8>>)> {
    let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
    let mut lines = (1..).zip(bytes.split(|&byte| byte == b'\n'));
    let (line, text) = lines.find(|(_, text)| holds_cells(text))?;
    let mut cells = Vec::new();
    Cells::of(bytes).cut(text, &mut cells).ok()?;
    Some((line, cells))
}

pub(super) fn rows(bytes: &[u8], columns: &[Column]) -> Result<Rows, RecordError> {
    let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
    let cells = Cells::of(bytes);
    let (mut places, mut rows) = (None, Rows::default());
    let mut record = Vec::new();
    for (line, text) in (1..).zip(bytes.split(|&byte| byte == b'\n')).filter(|(_, text)| holds_cells(text)) {
        cells.cut(text, &mut record).map_err(|reason| RecordError::Line { line, reason })?;
        let places = match &places {
            Some(places) => places,
            None => {
                let (found, is_header) = find_columns(&record, columns, line)?;
                let found = places.insert(found);
                if is_header {
                    continue;
                }
                found
            }
        };
        let numbers = places.iter().map(|&at| number(&record, at, line));
        rows.numbers.push(numbers.collect::<Result<_, _>>()?);
        rows.lines.push(line);
    }
    Ok(rows)
}

/// Separation of cells in a line.
enum Cells {
    /// At each of this byte.
    At(u8),
    /// At spaces, however many.
    Spaces,
}

impl Cells {
    /// By the first line that is neither blank nor a remark: at semicolons, tabs or commas if it has some,
    /// else at spaces.
    fn of(bytes: &[u8]) -> Self {
        let first = bytes.split(|&byte| byte == b'\n').find(|text| holds_cells(text)).unwrap_or_default();
        b";\t,".iter().find(|separator| first.contains(separator)).map_or(Self::Spaces, |at| Self::At(*at))
    }

    /// The cells of a line.
    fn cut(&self, text: &[u8], cells: &mut Vec<Vec<u8>>) -> Result<(), String> {
        cells.clear();
        match self {
            Self::Spaces => {
                let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
                cells.extend(words.map(<[u8]>::to_vec));
            }
            // Quotes may hold separators.
            Self::At(separator) if text.contains(&b'"') => {
                let mut reader = csv::ReaderBuilder::new();
                reader.has_headers(false).flexible(true).trim(csv::Trim::All).delimiter(*separator);
                let mut record = csv::ByteRecord::new();
                let read = reader.buffer_capacity(text.len()).from_reader(text).read_byte_record(&mut record);
                read.map_err(|error| error.to_string())?;
                cells.extend(record.iter().map(<[u8]>::to_vec));
            }
            Self::At(separator) => {
                cells.extend(text.split(|byte| byte == separator).map(|cell| cell.trim_ascii().to_vec()));
            }
        }
        Ok(())
    }
}

/// Whether a line is neither blank nor a remark.
fn holds_cells(text: &[u8]) -> bool {
    !text.trim_ascii().is_empty() && text[0] != b'#'
}

/// Places of columns, and whether the first line holds names.
fn find_columns(first: &[Vec<u8>], columns: &[Column], line: u64) -> Result<(Vec<usize>, bool), RecordError> {
    let place = |column: &Column| match column {
        Column::Number(number) => Ok(number - 1),
        Column::Name(name) => named(first, name).ok_or_else(|| {
            let names: Vec<String> = first.iter().take(20).map(|name| quoted(name)).collect();
            let reason =
                format!("found no column {}; this line has {}", quoted(name.as_bytes()), names.join(", "));
            RecordError::Line { line, reason }
        }),
    };
    let places = columns.iter().map(place).collect::<Result<Vec<_>, _>>()?;
    let is_named = columns.iter().any(|column| matches!(column, Column::Name(_)));
    // Of columns that the line does not have, the first row of numbers tells.
    let there: Vec<_> = places.iter().filter_map(|at| first.get(*at)).collect();
    let is_header = is_named || !there.is_empty() && there.iter().all(|cell| parsed(cell).is_none());
    Ok((places, is_header))
}

/// Place of a name: as it is written, or else in letters of either case and without a unit in brackets after
/// it.
pub(super) fn named(first: &[Vec<u8>], name: &str) -> Option<usize> {
    let is_like = |cell: &Vec<u8>| {
        let bare = cell.split(|byte| matches!(byte, b'[' | b'(')).next().unwrap_or_default().trim_ascii();
        [cell, bare].iter().any(|cell| cell.eq_ignore_ascii_case(name.as_bytes()))
    };
    first.iter().position(|cell| cell == name.as_bytes()).or_else(|| first.iter().position(is_like))
}

fn parsed(cell: &[u8]) -> Option<f64> {
    number_of(std::str::from_utf8(cell).ok()?)
}

fn number(record: &[Vec<u8>], at: usize, line: u64) -> Result<f64, RecordError> {
    let fault = |reason| RecordError::Line { line, reason };
    let cell = record.get(at).ok_or_else(|| {
        let found = counted(record.len() as u64, "column");
        fault(format!("found {found}; expected a number in column {}", at + 1))
    })?;
    parsed(cell)
        .ok_or_else(|| fault(format!("found {} in column {}; expected a number", quoted(cell), at + 1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::thread_seconds;

    fn named(name: &str) -> Column {
        Column::Name(name.into())
    }

    fn by_number(text: &str) -> Result<Table, RecordError> {
        parse(text.as_bytes(), &Column::Number(1), &Column::Number(2), 1.0)
    }

    /// One record written as programs write it: with names or without, with commas, semicolons or tabs, with
    /// remarks, blank lines, quotes, ends of lines of Windows and a mark of the order of bytes.
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

    /// Spaces between cells, exponents of Fortran, names in capitals and with units.
    #[test]
    fn forms_of_other_programs() {
        let table = Table::new(&[(0.0, 1.0), (0.5, -2e-3), (1.0, 4.0)]).unwrap();
        for text in [
            "  0.0   1.0\n  0.5  -2.0D-03\n  1.0   0.4D+01\n",
            "T A\n0 1\n0.5 -.2d-2\n1 4E0\n",
            "0,1\n5D-1,-2D-3\n1,4\n",
            "Time [s],Acceleration [m/s2]\n0,1\n0.5,-0.002\n1,4\n",
        ] {
            assert_eq!(by_number(text).unwrap(), table, "{text:?}");
        }
        for (text, time, value) in [
            ("T;A\n0;1\n0.5;-0.002\n1;4\n", "t", "a"),
            ("Time [s],A (g)\n0,1\n0.5,-0.002\n1,4\n", "time", "a"),
            ("A a T\n9 1 0\n9 -2D-3 .5\n9 4 1\n", "t", "a"),
        ] {
            assert_eq!(parse(text.as_bytes(), &named(time), &named(value), 1.0).unwrap(), table, "{text:?}");
        }
        assert!(by_number("0 1\n1 dead\n").is_err() && by_number("0 1\n1 D\n").is_err());
    }

    /// 400,000 rows in some seconds, also in a build without optimisation on a busy machine.
    #[test]
    fn long_records_take_little_time() {
        let text: String = (0..400_000).map(|i| format!("{i},{}\n", i & 7)).collect();
        let start = thread_seconds();
        assert_eq!(by_number(&text).unwrap().at(399_999.0), 7.0);
        assert!(thread_seconds() - start < 8.0);
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
        assert_eq!(reason(by_number("0,1\n1\n")), "line 2: found 1 column; expected a number in column 2");
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
