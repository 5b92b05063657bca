//! Errors of files.
use std::path::PathBuf;

use partition::comm::Disagreement;

use crate::io::cause::explain;

/// Why a file could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The HDF5 library refused.
    #[error("{path}: cannot {action} {object}: {reason}", path = path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// The refused operation.
        action: &'static str,
        /// The data set, group or attribute.
        object: String,
        /// The library's own words.
        reason: String,
    },
    /// The file is shorter than its own header says.
    #[error("{path}: the file was cut short ({reason})", path = path.display())]
    CutShort {
        /// The file.
        path: PathBuf,
        /// The library's own words.
        reason: String,
    },
    /// Not a file of this format.
    #[error("{path}: not an HDF5 file", path = path.display())]
    NotHdf5 {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("{path}: cannot {action}: {reason}", path = path.display(), reason = explain(path, source))]
    System {
        /// The file.
        path: PathBuf,
        /// The refused operation.
        action: &'static str,
        /// The system's own words.
        source: std::io::Error,
    },
    /// The contents cannot be what this program wrote.
    #[error("{path}: {reason}", path = path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// The fault in its contents.
        reason: String,
    },
    /// One or more ranks failed; all ranks hold the message of the lowest of them.
    #[error(transparent)]
    Agreed(#[from] Disagreement),
}
