//! Tables of particles that other programs write: comma-separated values, and vertices of PLY.
use std::path::Path;

use crate::geometry::mesh::{ReadError, ply_columns};
use crate::input_file;
use crate::quantity::record::number_of;
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
        /// The fault in it.
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

/// Reads a table; a text in brackets behind a name in its header is the unit.
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
    let (mut table, mut is_spaced) = (Table::default(), false);
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    for (line, text) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        let fault = |reason| TableError::Line { line, reason };
        if text.trim_ascii().is_empty() || text[0] == b'#' {
            continue;
        }
        let text = std::str::from_utf8(text).map_err(|_| fault("it is no text".into()))?;
        if table.columns.is_empty() {
            is_spaced = !text.contains([',', ';', '\t']);
        }
        let cells = text.trim().split(|c| if is_spaced { c == ' ' } else { matches!(c, ',' | ';' | '\t') });
        // Several spaces are one.
        let cells = cells.filter(|cell| !is_spaced || !cell.is_empty());
        let cells = cells.map(|cell| cell.trim().trim_matches('"'));
        if table.columns.is_empty() {
            let names = cells.map(|cell| cell.split('[').next().unwrap_or_default().trim().to_owned());
            table.columns = names.map(|name| (name, Vec::new())).collect();
            // ParaView writes all arrays of its points.
            table.may_have_others = rename_from_paraview(&mut table.columns);
            continue;
        }
        let found = cells.clone().count();
        if found != table.columns.len() {
            let expected = table.columns.len();
            return Err(fault(format!("found {found} columns; expected {expected}, as the first line has")));
        }
        for (cell, (name, values)) in cells.zip(&mut table.columns) {
            let value = number_of(cell).filter(|value| value.is_finite() || table.may_have_others);
            values.push(value.ok_or_else(|| {
                let (cell, name) = (excerpt(cell, SHOWN), excerpt(name, SHOWN));
                fault(format!("found \"{cell}\" in the column \"{name}\"; expected a number"))
            })?);
        }
        table.lines.push(line);
    }
    if table.lines.is_empty() { Err(TableError::Empty) } else { Ok(table) }
}

/// Gives columns of ParaView's tables (`Points:0`, `velocity_2`, `stress:3`) the names that they have here.
/// Returns whether it is such a table.
fn rename_from_paraview(columns: &mut [(String, Vec<f64>)]) -> bool {
    let is_points = |name: &str| component(name, "points").is_some();
    if !columns.iter().any(|(name, _)| is_points(name)) {
        return false;
    }
    let all_of = |vector: &str, count: usize| {
        (0..count).all(|k| columns.iter().any(|(name, _)| component(name, vector) == Some(k.to_string())))
    };
    // Other fields may be called so: principal stresses are stress_1 to stress_3.
    let by_number =
        [("points", 3), ("velocity", 3), ("stress", 6), ("f", 9)].map(|(name, n)| all_of(name, n));
    for (name, _) in columns {
        for ((vector, names), by_number) in PARAVIEW.into_iter().zip(by_number) {
            let Some(end) = component(name, vector) else { continue };
            let number = end.parse::<usize>().ok().filter(|_| by_number).and_then(|k| names.get(k)).copied();
            let ending = number.or_else(|| names.iter().find(|known| **known == end).copied());
            if let Some(ending) = ending {
                *name = if vector == "points" { ending.into() } else { format!("{vector}_{ending}") };
                break;
            }
        }
    }
    true
}

/// Fields of ParaView's tables with the components of each in its order.
const PARAVIEW: [(&str, &[&str]); 4] = [
    ("points", &["x", "y", "z"]),
    ("velocity", &["x", "y", "z"]),
    ("stress", &["xx", "yy", "zz", "xy", "yz", "xz"]),
    ("f", &["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"]),
];

/// Component in a column's name: its part after the field's name and a colon or underscore, in small letters.
fn component(name: &str, field: &str) -> Option<String> {
    let name = name.to_ascii_lowercase();
    Some(name.strip_prefix(field)?.strip_prefix([':', '_'])?.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(text: &str) -> Vec<String> {
        parse(text.as_bytes()).expect("a table").columns.into_iter().map(|(name, _)| name).collect()
    }

    #[test]
    fn tables_of_paraview_have_our_names() {
        let of = |head: &str| names(&format!("{head}\n{}\n", vec!["1"; head.split(',').count()].join(",")));
        assert_eq!(
            of(
                "\"velocity:0\",\"velocity:1\",\"velocity:2\",\"volume\",\"Points:0\",\"Points:1\",\"Points:2\",\"Points_Magnitude\""
            ),
            ["velocity_x", "velocity_y", "velocity_z", "volume", "x", "y", "z", "Points_Magnitude"]
        );
        assert_eq!(
            of("Point ID,Points_0,Points_1,Points_2,stress_1"),
            ["Point ID", "x", "y", "z", "stress_1"]
        );
        assert_eq!(
            of("Points_X,Points_Y,Points_Z,stress:0,stress:1,stress:2,stress:3,stress:4,stress:5,f_XY"),
            [
                "x",
                "y",
                "z",
                "stress_xx",
                "stress_yy",
                "stress_zz",
                "stress_xy",
                "stress_yz",
                "stress_xz",
                "f_xy"
            ]
        );
        assert_eq!(of("x,y,velocity_0"), ["x", "y", "velocity_0"]);
    }

    #[test]
    fn cells_may_be_apart_by_spaces_with_exponents_of_fortran() {
        let table = parse(b"# made by hand\n  x    y  volume\n 1.0D-01   .5d0  2E-3 \n").expect("a table");
        let values: Vec<f64> = table.columns.iter().map(|(_, values)| values[0]).collect();
        assert_eq!(values, [0.1, 0.5, 2e-3]);
    }
}
