//! Why `agimp material` cannot go on.
use std::path::{Path, PathBuf};

use agimp::material::driver::control::NoSolution;
use agimp::material::parameters::NotAModel;

/// Why `agimp material` cannot go on.
#[derive(Debug, thiserror::Error)]
pub(super) enum MaterialError {
    /// A file cannot be read.
    #[error("cannot read {}: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        error: std::io::Error,
    },
    /// The text is no model.
    #[error(transparent)]
    Model(#[from] NotAModel),
    /// The density is not above zero.
    #[error("--density {0} is out of range: it must be above 0 (kg/m³)")]
    Density(f64),
    /// Water that cannot be in the pores of this model.
    #[error("--undrained: {0}")]
    Undrained(String),
    /// The path is no valid JSON.
    #[error("{}: {error}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and why.
        error: serde_json::Error,
    },
    /// The path has no row.
    #[error(
        "{}: found no row; expected rows of 3 logarithmic strains, of the 9 numbers of a deformation gradient, or of strains and stresses named in a header",
        .0.display()
    )]
    NoRow(PathBuf),
    /// A row of the path.
    #[error("{}, row {row}: {reason}", path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// Row, counted from 1 without header and comments.
        row: usize,
        /// The fault in it.
        reason: String,
    },
    /// No strain has the stress of a row.
    #[error("{place}, row {row}: {reason}")]
    Stress {
        /// The file or the test.
        place: String,
        /// Row, counted from 1.
        row: usize,
        /// Which one.
        reason: NoSolution,
    },
    /// A number of the command line.
    #[error("--{option} {value} is out of range: it must be {range}")]
    Option {
        /// The option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// The range in words.
        range: &'static str,
    },
    /// The picture cannot be written.
    #[cfg(feature = "post")]
    #[error("cannot write {}: {reason}", path.display())]
    Plot {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The result cannot be written.
    #[error("cannot write the result: {0}")]
    Write(#[from] std::io::Error),
}

/// Text of a file.
pub(super) fn read(path: &Path) -> Result<String, MaterialError> {
    std::fs::read_to_string(path).map_err(|error| MaterialError::Read { path: path.to_path_buf(), error })
}
