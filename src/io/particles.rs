//! Tables of particles that other programs write: comma-separated values, and vertices of PLY.
use std::path::Path;

use crate::geometry::mesh::{ReadError, ply_columns};
use crate::input_file;
use crate::text::excerpt;

/// Numbers of particles by columns of the same length, at least 1.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Name and values of each column.
    pub columns: Vec<(String, Vec<f64>)>,
    /// Line of the file that each row stands in; empty where a file has no lines.
    pub lines: Vec<u64>,
    /// Whether columns that are not known may stand there.
    pub may_have_others: bool,
}

/// Why a file gives no table.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// It cannot be read.
    #[error("it cannot be read: {0}")]
    System(#[from] std::io::Error),
    /// No PLY file, or damaged.
    #[error(transparent)]
    Mesh(#[from] ReadError),
    /// A line is wrong.
    #[error("line {line}: {reason}")]
    Line {
        /// From 1.
        line: u64,
        /// What is wrong.
        reason: String,
    },
    /// It has no row.
    #[error("it has no particle")]
    Empty,
    /// It has another ending.
    #[error("its name does not end with .csv, .ply, .hdf or .h5")]
    Kind,
}

/// Most bytes of a file.
const MOST_BYTES: u64 = 1 << 34;

/// Characters of a cell that a message shows.
const SHOWN: usize = 40;

/// Reads a table; what follows a name in its header in brackets is its unit.
///
/// # Errors
/// The file cannot be read, is of another kind, or damaged.
pub fn table(path: &Path) -> Result<Table, TableError> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !["csv", "ply"].contains(&ending.as_str()) {
        return Err(TableError::Kind);
    }
    let bytes = input_file::read(path, MOST_BYTES)?;
    match ending.as_str() {
        "csv" => parse(&bytes),
        _ => Ok(Table { columns: ply_columns(&bytes)?, lines: Vec::new(), may_have_others: true }),
    }
}

fn parse(bytes: &[u8]) -> Result<Table, TableError> {
    let mut table = Table::default();
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    for (line, text) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        let fault = |reason| TableError::Line { line, reason };
        if text.trim_ascii().is_empty() || text[0] == b'#' {
            continue;
        }
        let text = std::str::from_utf8(text).map_err(|_| fault("it is no text".into()))?;
        let cells = text.split([',', ';', '\t']).map(|cell| cell.trim().trim_matches('"'));
        if table.columns.is_empty() {
            let names = cells.map(|cell| cell.split('[').next().unwrap_or_default().trim().to_owned());
            table.columns = names.map(|name| (name, Vec::new())).collect();
            continue;
        }
        let found = cells.clone().count();
        if found != table.columns.len() {
            let expected = table.columns.len();
            return Err(fault(format!("found {found} columns; expected {expected}, as the first line has")));
        }
        for (cell, (name, values)) in cells.zip(&mut table.columns) {
            let value = cell.parse().ok().filter(|value: &f64| value.is_finite());
            values.push(value.ok_or_else(|| {
                let (cell, name) = (excerpt(cell, SHOWN), excerpt(name, SHOWN));
                fault(format!("found \"{cell}\" in the column \"{name}\"; expected a number"))
            })?);
        }
        table.lines.push(line);
    }
    if table.lines.is_empty() { Err(TableError::Empty) } else { Ok(table) }
}
