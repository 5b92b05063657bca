//! Files of the HDF5 format: one file, laid out by one rank and filled by all.
//!
//! The only folder that uses the crate `hdf5`, and it uses it for names, shapes and attributes alone.
//! Data sets are contiguous, unfiltered and little-endian: rows in the file have the layout of memory, and
//! every rank writes and reads its own with plain system calls, at the place that the library has assigned to
//! the data set. So no rank waits inside a library for one that has failed, the system's own reason for a
//! failure is known, and sizes that a file declares are compared with its own before memory is allocated.
//! C functions are called where the crate has no way that fits: for paths that are not UTF-8, for empty data
//! sets without chunks, for texts of any length, and for what a file of unknown origin may declare, which the
//! crate would believe (`docs/design/rejected.md`).
//!
//! | file | concern |
//! |---|---|
//! | `writer.rs` | a new file of all ranks |
//! | `reader.rs` | an existing file, opened by each rank for itself |
//! | `attribute.rs` | short arrays and texts attached to groups |
//! | `element.rs` | number types |
//! | `error.rs` | errors |
#![allow(unsafe_code)]

use std::ffi::CString;
use std::path::Path;

use hdf5_sys::h5o::H5Oopen;
use hdf5_sys::h5p::H5P_DEFAULT;
use partition::comm::Comm;

mod attribute;
mod element;
mod error;
mod reader;
mod writer;

pub use element::{Element, Kind};
pub use error::FileError;
pub use reader::{Reader, Stored};
pub use writer::Writer;

#[cfg(test)]
mod tests;

// Rows in the file have the layout of memory.
const _: () = assert!(cfg!(target_endian = "little"), "files are little-endian, and so must be the machine");

/// Starts the library. To be called before MPI starts if the program must survive a file that cannot be
/// closed: a parallel HDF5 library that starts later finalizes with MPI, and tries to write such a file
/// again.
pub fn prepare() {
    drop(library());
}

/// Waits for the library, and keeps other threads out of it while the result lives. Starts it, once per
/// process: it then closes no file at the end of the program, since files that stay open then could not be
/// written and another attempt would crash, and it prints no errors.
fn library() -> impl Drop {
    hdf5::sync::sync(|| ());
    hdf5_sys::LOCK.lock()
}

/// The library's own words on a failure, innermost first.
fn words(error: &hdf5::Error) -> Vec<String> {
    match error.stack() {
        Some(stack) => stack.iter().rev().map(|frame| frame.desc().to_owned()).collect(),
        None => vec![error.to_string()],
    }
}

/// A result of the library as one of a file.
trait OfFile<T> {
    /// The error is the system's own where the library names one.
    fn of_file(self, path: &Path, action: &'static str, object: &str) -> Result<T, FileError>;
}

impl<T> OfFile<T> for hdf5::Result<T> {
    fn of_file(self, path: &Path, action: &'static str, object: &str) -> Result<T, FileError> {
        self.map_err(|error| {
            let mut texts = words(&error);
            // "…, errno = 28, error message = '…'"
            let system = texts.iter().find_map(|text| {
                let digits = text.rsplit_once("errno = ")?.1;
                digits[..digits.find(|c: char| !c.is_ascii_digit())?].parse().ok()
            });
            if let Some(code) = system {
                let source = std::io::Error::from_raw_os_error(code);
                return FileError::System { path: path.into(), action, source };
            }
            texts.truncate(3);
            let reason = if texts.is_empty() { "no reason given".to_owned() } else { texts.join("; ") };
            FileError::Hdf5 { path: path.into(), action, object: object.into(), reason }
        })
    }
}

/// Opens a group or a data set.
fn open_object(file: &hdf5::File, name: &str) -> hdf5::Result<hdf5::Location> {
    let name = c_text(name);
    // SAFETY: open file, terminated name; the identifier is fresh.
    unsafe { hdf5::from_id(hdf5::h5check(H5Oopen(file.id(), name.as_ptr(), H5P_DEFAULT))?) }
}

/// Collective with a communicator. The same result on all ranks.
fn agreed<T>(comm: Option<&Comm>, result: Result<T, FileError>) -> Result<T, FileError> {
    match (comm, result) {
        // All ranks hold this one already.
        (_, Err(FileError::Agreed(disagreement))) => Err(FileError::Agreed(disagreement)),
        (Some(comm), result) => Ok(comm.agree(result)?),
        (None, result) => result,
    }
}

/// A terminated copy; HDF5 names and our paths have no inner zero bytes, and one would end the name.
fn c_text(text: &str) -> CString {
    CString::new(text.split('\0').next().unwrap_or_default()).unwrap_or_default()
}

/// A terminated copy of a path, whatever its bytes.
fn c_path(path: &Path) -> CString {
    use std::os::unix::ffi::OsStrExt;
    CString::new(path.as_os_str().as_bytes()).unwrap_or_default()
}
