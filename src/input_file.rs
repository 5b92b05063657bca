//! Files that a job names.
use std::path::Path;

/// The bytes of a plain file of at most `most` bytes.
///
/// # Errors
/// It cannot be read, is no plain file, or is larger.
pub fn read(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    if metadata.len() > most {
        return Err(std::io::Error::other(format!(
            "it has {} bytes; expected at most {most}",
            metadata.len()
        )));
    }
    std::fs::read(path)
}
