//! The bytes of a job file.
use std::io::Read as _;
use std::path::Path;

use super::error::JobError;

/// Longest job file, bytes. Reading it takes up to a hundred times as much memory.
pub(super) const MOST_BYTES: u64 = 2_000_000;

/// The bytes of a job file. Not collective.
///
/// # Errors
/// The file cannot be read, or is too long.
pub fn read(path: &Path) -> Result<Vec<u8>, JobError> {
    let mut bytes = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut bytes));
    read.map_err(|source| JobError::Unreadable { path: path.to_path_buf(), source })?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(JobError::TooLong { path: path.to_path_buf(), most: MOST_BYTES / 1_000_000 });
    }
    Ok(bytes)
}
