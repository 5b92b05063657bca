//! Files of the HDF5 format: one file, laid out by one rank and filled by all.
//!
//! The only folder that calls HDF5's C functions, and it calls them for names, shapes and attributes alone.
//! Data sets are contiguous, unfiltered and little-endian: rows in the file have the layout of memory, and
//! every rank writes and reads its own with plain system calls, at the place that the library has assigned to
//! the data set. So no rank waits inside a library for one that has failed, the system's own reason for a
//! failure is known, and sizes that a file declares are compared with its own before memory is allocated.
//! Handles live no longer than the call or the file that they belong to. The library knows no threads:
//! whoever calls it holds its lock (`library`).
//!
//! | file | concern |
//! |---|---|
//! | `writer.rs` | a new file of all ranks |
//! | `reader.rs` | an existing file, opened by each rank for itself |
//! | `attribute.rs` | short arrays and texts attached to groups |
//! | `element.rs` | number types |
//! | `error.rs` | errors |
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_uint, c_void};
use std::path::Path;
use std::sync::Once;

use hdf5_sys::h5::{H5dont_atexit, H5open, herr_t};
use hdf5_sys::h5e::{H5E_DEFAULT, H5E_WALK_UPWARD, H5E_error2_t, H5Eclear2, H5Eset_auto2, H5Ewalk2};
use hdf5_sys::h5i::hid_t;
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

/// An HDF5 identifier that is closed when dropped.
struct Handle {
    id: hid_t,
    close: unsafe extern "C" fn(hid_t) -> herr_t,
}

impl Handle {
    /// Takes over a fresh identifier; an error if the call failed.
    fn new(id: hid_t, close: unsafe extern "C" fn(hid_t) -> herr_t) -> Result<Self, Complaint> {
        if id < 0 { Err(Complaint::fetch()) } else { Ok(Self { id, close }) }
    }
}

impl Drop for Handle {
    fn drop(&mut self) {
        let _turn = library();
        // SAFETY: the identifier is open and owned by this value alone.
        unsafe { (self.close)(self.id) };
    }
}

/// Starts the library. To be called before MPI starts if the program must survive a file that cannot be
/// closed: a parallel HDF5 library that starts later finalizes with MPI, and tries to write such a file
/// again.
pub fn prepare() {
    drop(library());
}

/// Waits for the library, and keeps other threads out of it while the result lives. Starts it, once per
/// process.
fn library() -> impl Drop {
    static START: Once = Once::new();
    let turn = hdf5_sys::LOCK.lock();
    START.call_once(|| {
        // SAFETY: plain calls, the first before all others. Files that stay open at the end of the program
        // could not be written, and another attempt then would crash; error messages are fetched by us, so
        // the library must not print them.
        unsafe {
            H5dont_atexit();
            H5open();
            H5Eset_auto2(H5E_DEFAULT, None, std::ptr::null_mut());
        }
    });
    turn
}

/// Last error of the library.
struct Complaint {
    /// Its own words, innermost first.
    words: String,
    /// The error of the operating system that it names.
    system: Option<i32>,
}

impl Complaint {
    /// Fetches the complaint and clears the library's error stack.
    fn fetch() -> Self {
        unsafe extern "C" fn collect(_: c_uint, error: *const H5E_error2_t, out: *mut c_void) -> herr_t {
            // SAFETY: HDF5 passes a valid record, and `out` is the vector handed to `H5Ewalk2` below.
            let (text, out) = unsafe { (CStr::from_ptr((*error).desc), &mut *out.cast::<Vec<String>>()) };
            out.push(text.to_string_lossy().into_owned());
            0
        }
        let mut texts: Vec<String> = Vec::new();
        // SAFETY: the callback only appends to `texts`, which outlives the call.
        unsafe {
            H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, Some(collect), (&raw mut texts).cast());
            H5Eclear2(H5E_DEFAULT);
        }
        // "…, errno = 28, error message = '…'"
        let system = texts.iter().find_map(|text| {
            let digits = text.rsplit_once("errno = ")?.1;
            digits[..digits.find(|c: char| !c.is_ascii_digit())?].parse().ok()
        });
        texts.truncate(3);
        let words = if texts.is_empty() { "no reason given".to_owned() } else { texts.join("; ") };
        Self { words, system }
    }

    /// The error of a file; the system's reason where there is one.
    fn into_error(self, path: &Path, action: &'static str, object: &str) -> FileError {
        match self.system {
            Some(code) => {
                let source = std::io::Error::from_raw_os_error(code);
                FileError::System { path: path.into(), action, source }
            }
            None => FileError::Hdf5 { path: path.into(), action, object: object.into(), reason: self.words },
        }
    }
}

/// The error of a call that failed, if it did.
fn check(code: herr_t, path: &Path, action: &'static str, object: &str) -> Result<(), FileError> {
    if code < 0 { Err(Complaint::fetch().into_error(path, action, object)) } else { Ok(()) }
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
