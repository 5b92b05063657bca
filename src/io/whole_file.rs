//! Files that are written whole, so that a reader never sees half of one.
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::Path;

use super::hdf5_file::FileError;

/// Writes a file under a temporary name, which becomes its own when it is on disk.
pub fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    write_in_pieces(path, |out| out.write_all(bytes))
}

/// [`write_whole`] with the bytes that `fill` writes, piece by piece.
pub fn write_in_pieces(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let part = path.with_added_extension("part");
    let mut out = BufWriter::new(create_new(&part)?);
    fill(&mut out)?;
    out.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()?;
    std::fs::rename(&part, path)
}

/// Creates a file in the place of an old one. A symbolic link is replaced, not followed.
pub fn create_new(path: &Path) -> std::io::Result<File> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error),
        _ => OpenOptions::new().write(true).create_new(true).open(path),
    }
}

/// Error of the operating system, with the file and the refused operation.
pub fn system(path: &Path, action: &'static str, source: std::io::Error) -> FileError {
    FileError::System { path: path.into(), action, source }
}
