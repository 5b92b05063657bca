//! Rows of numbers of a file, and why it has none.
use crate::text::excerpt;

/// Longest piece of a file in a message.
const QUOTED: usize = 40;

/// Why a file gives no table.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// It cannot be read.
    #[error("it cannot be read: {0}")]
    System(#[from] std::io::Error),
    /// A line is wrong.
    #[error("line {line}: {reason}")]
    Line {
        /// The line, from 1.
        line: u64,
        /// Found and expected text, in words.
        reason: String,
    },
    /// No rows.
    #[error("it contains no row of numbers")]
    Empty,
    /// A record without columns.
    #[error("it is a record of PEER: values at a constant step, without columns; remove `time` and `value`")]
    Peer,
    /// Points in space between which nothing can be found.
    #[error(
        "its points are no grid; expected all combinations of their x, y and z, or points over two of them"
    )]
    Scattered,
    /// Points in a plane between which nothing can be found; in words.
    #[error("{0}")]
    Points(String),
    /// The number of values is not that of the header.
    #[error("it has {found} values; its header says NPTS = {expected}")]
    Count {
        /// Values that it has.
        found: usize,
        /// Values according to its header.
        expected: usize,
    },
}

/// Numbers of some columns of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    /// Those of each row, in the order of the requested columns.
    pub numbers: Vec<Vec<f64>>,
    /// The line of each row, from 1.
    pub lines: Vec<u64>,
}

/// The number of a cell, also with the exponent of Fortran's double precision: `1.5D-03`.
pub fn number_of(cell: &str) -> Option<f64> {
    let fortran = || {
        let is_number = cell.bytes().all(|byte| byte.is_ascii_digit() || b"+-.dD".contains(&byte));
        cell.replace(['d', 'D'], "e").parse().ok().filter(|_| is_number)
    };
    cell.parse().ok().or_else(fortran)
}

pub(in crate::quantity) fn quoted(cell: &[u8]) -> String {
    format!("\"{}\"", excerpt(&String::from_utf8_lossy(cell), QUOTED))
}
