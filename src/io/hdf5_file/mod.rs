//! Files of the HDF5 format, written and read by all ranks together.
//!
//! The only folder that calls HDF5's C functions. Every data set is contiguous and unfiltered;
//! transfers are collective. Handles live no longer than the call or the file they belong to, so that
//! none is open when MPI is finalised. To be used from the main thread only.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_uint, c_void};
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};

use hdf5_sys::h5::{H5open, herr_t};
use hdf5_sys::h5d::H5D_FILL_TIME_NEVER;
use hdf5_sys::h5e::{H5E_DEFAULT, H5E_WALK_UPWARD, H5E_error2_t, H5Eclear2, H5Eset_auto2, H5Ewalk2};
use hdf5_sys::h5f::{
    H5F_ACC_RDONLY, H5F_ACC_TRUNC, H5F_LIBVER_LATEST, H5F_LIBVER_V18, H5Fclose, H5Fcreate, H5Fopen,
};
use hdf5_sys::h5g::{H5Gclose, H5Gcreate2};
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5l::{H5Lcreate_hard, H5Lexists};
use hdf5_sys::h5p::{
    H5FD_mpio_xfer_t, H5P_CLS_DATASET_CREATE, H5P_CLS_DATASET_XFER, H5P_CLS_FILE_ACCESS, H5P_CLS_FILE_CREATE,
    H5P_CLS_GROUP_CREATE, H5P_DEFAULT, H5Pclose, H5Pcreate, H5Pset_alignment, H5Pset_attr_phase_change,
    H5Pset_coll_metadata_write, H5Pset_dxpl_mpio, H5Pset_fill_time, H5Pset_libver_bounds,
    H5Pset_link_phase_change, H5Pset_obj_track_times, H5Pset_small_data_block_size,
};
use partition::comm::Comm;

mod attribute;
mod dataset;
mod element;
mod error;

pub use element::Element;
pub use error::FileError;

/// Data sets of at least this many bytes start at a multiple of [`ALIGNMENT`].
const ALIGN_FROM: u64 = 4 << 20;
/// Links or attributes of a group that are stored without an index.
const MOST_COMPACT: c_uint = 255;
/// The usual stripe of parallel file systems.
const ALIGNMENT: u64 = 1 << 20;

/// An HDF5 identifier that is closed when dropped.
struct Handle {
    id: hid_t,
    close: unsafe extern "C" fn(hid_t) -> herr_t,
}

impl Drop for Handle {
    fn drop(&mut self) {
        // SAFETY: the identifier is open and owned by this value alone.
        unsafe { (self.close)(self.id) };
    }
}

/// What the library last complained about, innermost first; clears its error stack.
fn library_error() -> String {
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
    texts.truncate(3);
    if texts.is_empty() { "no reason given".to_owned() } else { texts.join("; ") }
}

/// An open HDF5 file: shared by all ranks of a communicator, or opened by one process alone.
///
/// On a shared file every method is collective and gives an error on all ranks if any rank fails, so
/// that callers may use `?`.
pub struct ParallelFile {
    path: PathBuf,
    comm: Option<Comm>,
    transfer: Handle,
    create: Handle,
    file: Option<Handle>,
}

impl ParallelFile {
    /// Collective. Creates the file, replacing one of that name.
    pub fn create(comm: &Comm, path: &Path) -> Result<Self, FileError> {
        Self::start(Some(comm), path, true)
    }

    /// Collective. Opens the file for reading.
    pub fn open(comm: &Comm, path: &Path) -> Result<Self, FileError> {
        Self::start(Some(comm), path, false)
    }

    /// Not collective. Opens the file for reading by this process alone; needs no MPI.
    pub fn open_alone(path: &Path) -> Result<Self, FileError> {
        Self::start(None, path, false)
    }

    fn start(comm: Option<&Comm>, path: &Path, new: bool) -> Result<Self, FileError> {
        // One rank looks first: it can tell a missing or foreign file apart without the other ranks.
        let mut seen = Ok(());
        if !new && comm.is_none_or(|comm| comm.rank() == 0) {
            seen = looks_like_hdf5(path);
        }
        agreed(comm, seen)?;
        let opened = Self::open_handles(comm, path, new);
        agreed(comm, opened)
    }

    fn open_handles(comm: Option<&Comm>, path: &Path, new: bool) -> Result<Self, FileError> {
        let fail =
            |action, reason| FileError::Hdf5 { path: path.into(), action, object: "the file".into(), reason };
        // The property list with the communicator comes from the hdf5 crate, which spares us naming MPI;
        // it lives until the file is open.
        let (parallel, single);
        let access = match comm {
            Some(comm) => {
                parallel = hdf5::plist::FileAccess::build()
                    .mpio(comm.raw(), None)
                    .finish()
                    .map_err(|e| fail("prepare", e.to_string()))?;
                parallel.id()
            }
            None => {
                // SAFETY: plain creation of a property list; the result is checked by `wrap`.
                let id = unsafe {
                    H5open();
                    H5Pcreate(*H5P_CLS_FILE_ACCESS)
                };
                single = wrap(id, H5Pclose).map_err(|e| fail("prepare", e))?;
                single.id
            }
        };
        // SAFETY: `access` is a file access list; the calls only set values in it. Error messages are
        // fetched by us, so the library shall not print them.
        unsafe {
            H5Eset_auto2(H5E_DEFAULT, None, std::ptr::null_mut());
            // The 1.8 format carries checksums of its own metadata, which the older one does not.
            H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_LATEST);
            H5Pset_alignment(access, ALIGN_FROM, ALIGNMENT);
            // No reserve for small data sets: what stays unused of it would hold arbitrary bytes.
            H5Pset_small_data_block_size(access, 0);
            if comm.is_some() {
                H5Pset_coll_metadata_write(access, 1);
            }
        }
        let name = c_path(path);
        // SAFETY: `name` is a terminated string that outlives the calls; the new identifiers are checked
        // by `wrap`. The root group keeps no timestamps, like all other objects.
        let (transfer, create, file) = unsafe {
            let transfer = H5Pcreate(*H5P_CLS_DATASET_XFER);
            let create = H5Pcreate(*H5P_CLS_DATASET_CREATE);
            let file = if new {
                let root = H5Pcreate(*H5P_CLS_FILE_CREATE);
                H5Pset_obj_track_times(root, 0);
                let file = H5Fcreate(name.as_ptr(), H5F_ACC_TRUNC, root, access);
                H5Pclose(root);
                file
            } else {
                H5Fopen(name.as_ptr(), H5F_ACC_RDONLY, access)
            };
            (transfer, create, file)
        };
        let transfer = wrap(transfer, H5Pclose).map_err(|e| fail("prepare", e))?;
        let create = wrap(create, H5Pclose).map_err(|e| fail("prepare", e))?;
        let file = wrap(file, H5Fclose).map_err(|reason| {
            if reason.contains("truncated") {
                FileError::CutShort { path: path.into(), reason }
            } else {
                fail(if new { "create" } else { "open" }, reason)
            }
        })?;
        // SAFETY: both lists are open. Contents are always written in full, so no fill values; no
        // timestamps, so that equal contents give equal files.
        unsafe {
            H5Pset_fill_time(create.id, H5D_FILL_TIME_NEVER);
            H5Pset_obj_track_times(create.id, 0);
            if comm.is_some() {
                H5Pset_dxpl_mpio(transfer.id, H5FD_mpio_xfer_t::H5FD_MPIO_COLLECTIVE);
            }
        }
        Ok(Self { path: path.into(), comm: comm.cloned(), transfer, create, file: Some(file) })
    }

    /// The file's name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn id(&self) -> hid_t {
        self.file.as_ref().map_or(-1, |file| file.id)
    }

    fn error(&self, action: &'static str, object: &str, reason: String) -> FileError {
        FileError::Hdf5 { path: self.path.clone(), action, object: object.into(), reason }
    }

    /// Wraps a fresh identifier, or says what failed.
    fn wrap(
        &self,
        id: hid_t,
        close: unsafe extern "C" fn(hid_t) -> herr_t,
        action: &'static str,
        object: &str,
    ) -> Result<Handle, FileError> {
        wrap(id, close).map_err(|reason| self.error(action, object, reason))
    }

    fn check(&self, code: herr_t, action: &'static str, object: &str) -> Result<(), FileError> {
        if code < 0 { Err(self.error(action, object, library_error())) } else { Ok(()) }
    }

    /// An error of this file that lies in its contents.
    pub fn refuse(&self, reason: impl Into<String>) -> FileError {
        FileError::Refused { path: self.path.clone(), reason: reason.into() }
    }

    /// Not collective. Refuses an object of that many elements of so many bytes if the file cannot hold it. To be asked before any
    /// memory whose size a file tells is taken.
    fn check_bytes(&self, count: u64, element: usize, object: impl Fn() -> String) -> Result<(), FileError> {
        let held = std::fs::metadata(&self.path).map_or(0, |data| data.len());
        // No type of ours shrinks a number to less than an eighth, when the file's are converted.
        let most = held.saturating_mul(8);
        match count.checked_mul(element as u64) {
            Some(bytes) if bytes <= most && usize::try_from(bytes).is_ok() => Ok(()),
            _ => Err(self.refuse(format!(
                "{} has {count} elements of {element} bytes, more than the file of {held} bytes holds",
                object()
            ))),
        }
    }

    /// Collective on a shared file. The same result on all ranks.
    pub fn agree<T>(&self, result: Result<T, FileError>) -> Result<T, FileError> {
        agreed(self.comm.as_ref(), result)
    }

    /// Creates a group. Its parent must exist.
    pub fn create_group(&self, group: &str) -> Result<(), FileError> {
        let name = c_text(group);
        // SAFETY: open file, terminated name; the results are checked.
        let made = unsafe {
            let list = H5Pcreate(*H5P_CLS_GROUP_CREATE);
            H5Pset_obj_track_times(list, 0);
            // Up to these numbers, links and attributes stay in the group's header: smaller files, and no
            // remains of outgrown indices in them.
            H5Pset_link_phase_change(list, MOST_COMPACT, 0);
            H5Pset_attr_phase_change(list, MOST_COMPACT, 0);
            let id = H5Gcreate2(self.id(), name.as_ptr(), H5P_DEFAULT, list, H5P_DEFAULT);
            let made = self.wrap(id, H5Gclose, "create group", group);
            H5Pclose(list);
            made
        };
        self.agree(made.map(drop))
    }

    /// Gives an existing object a second name.
    pub fn hard_link(&self, existing: &str, new: &str) -> Result<(), FileError> {
        let (from, to) = (c_text(existing), c_text(new));
        // SAFETY: open file, terminated names.
        let code = unsafe {
            H5Lcreate_hard(self.id(), from.as_ptr(), self.id(), to.as_ptr(), H5P_DEFAULT, H5P_DEFAULT)
        };
        self.agree(self.check(code, "link", new))
    }

    /// Not collective. True when the object and all groups above it exist.
    pub fn exists(&self, object: &str) -> bool {
        let object = object.trim_matches('/');
        let ends = object.match_indices('/').map(|(at, _)| at).chain([object.len()]);
        // SAFETY: open file, terminated names.
        ends.map(|end| c_text(&object[..end]))
            .all(|name| unsafe { H5Lexists(self.id(), name.as_ptr(), H5P_DEFAULT) > 0 })
    }

    /// Hands everything to the operating system and closes the file. Does not wait for the disk, as a flush of a
    /// shared file would.
    pub fn close(mut self) -> Result<(), FileError> {
        let Some(file) = self.file.take() else { return Ok(()) };
        // SAFETY: the file is open, and its handle is forgotten after the explicit close.
        let closed = unsafe {
            let closed = self.check(H5Fclose(file.id), "close", "the file");
            std::mem::forget(file);
            closed
        };
        self.agree(closed)
    }
}

fn wrap(id: hid_t, close: unsafe extern "C" fn(hid_t) -> herr_t) -> Result<Handle, String> {
    if id < 0 { Err(library_error()) } else { Ok(Handle { id, close }) }
}

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

/// A terminated copy of a path, which need not be UTF-8.
fn c_path(path: &Path) -> CString {
    let bytes = path.as_os_str().as_bytes();
    CString::new(bytes.split(|&byte| byte == 0).next().unwrap_or_default()).unwrap_or_default()
}

/// The first bytes of the file are those of the format.
fn looks_like_hdf5(path: &Path) -> Result<(), FileError> {
    use std::io::Read;
    let system = |source| FileError::System { path: path.into(), action: "open", source };
    let mut start = [0; 8];
    let mut file = std::fs::File::open(path).map_err(system)?;
    match file.read_exact(&mut start) {
        Ok(()) if start == *b"\x89HDF\r\n\x1a\n" => Ok(()),
        Ok(()) => Err(FileError::NotHdf5 { path: path.into() }),
        Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            Err(FileError::CutShort { path: path.into(), reason: "fewer than 8 bytes".into() })
        }
        Err(e) => Err(system(e)),
    }
}
