//! A new file of all ranks.
use std::fs::{File, OpenOptions};
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use hdf5_sys::h5d::{H5D_ALLOC_TIME_EARLY, H5D_FILL_TIME_NEVER, H5Dclose, H5Dcreate2, H5Dget_offset};
use hdf5_sys::h5f::{
    H5F_ACC_EXCL, H5F_LIBVER_LATEST, H5F_LIBVER_V18, H5F_SCOPE_LOCAL, H5Fclose, H5Fcreate, H5Fflush,
};
use hdf5_sys::h5g::{H5Gclose, H5Gcreate2};
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5l::H5Lcreate_hard;
use hdf5_sys::h5p::{
    H5P_CLS_DATASET_CREATE, H5P_CLS_FILE_ACCESS, H5P_CLS_FILE_CREATE, H5P_CLS_GROUP_CREATE, H5P_DEFAULT,
    H5Pclose, H5Pcreate, H5Pset_alignment, H5Pset_alloc_time, H5Pset_attr_phase_change, H5Pset_fill_time,
    H5Pset_libver_bounds, H5Pset_link_phase_change, H5Pset_obj_track_times, H5Pset_small_data_block_size,
};
use hdf5_sys::h5s::{H5Sclose, H5Screate_simple};
use partition::comm::Comm;

use super::{Complaint, Element, FileError, Handle, Kind, agreed, c_path, c_text, check, library};

/// Data sets of at least this many bytes start at a multiple of [`ALIGNMENT`].
const ALIGN_FROM: u64 = 4 << 20;
/// The usual stripe of parallel file systems.
const ALIGNMENT: u64 = 1 << 20;
/// Links or attributes of a group that are stored without an index.
const MOST_COMPACT: std::ffi::c_uint = 255;

/// A new file of all ranks. Rank 0 alone keeps names, shapes and attributes; every rank writes its own rows.
///
/// Every method is collective and gives an error on all ranks if any rank fails, so that callers may use `?`.
/// A file that is given up must be [abandoned](Writer::abandon).
pub struct Writer {
    path: PathBuf,
    comm: Comm,
    /// The library's file, on rank 0.
    layout: Option<Layout>,
    /// The file for plain writes of this rank's rows.
    rows: File,
}

/// The library's file. If it is dropped before it is closed, it stays open to the end of the program: closing
/// writes the library's buffers, and where space has run out the library destroys its record of the file
/// without releasing it, and crashes at the end.
struct Layout(hid_t);

impl Layout {
    fn close(self, path: &Path) -> Result<(), FileError> {
        let _turn = library();
        // SAFETY: the file is open, and nobody else has its identifier.
        check(unsafe { H5Fclose(self.0) }, path, "close", "the file")
    }
}

impl Writer {
    /// Collective. Creates the file. An old one of that name is removed; if it is a symbolic link, its target
    /// stays.
    pub fn create(comm: &Comm, path: &Path) -> Result<Self, FileError> {
        let layout = if comm.rank() == 0 { lay_out(path).map(Some) } else { Ok(None) };
        let layout = agreed(Some(comm), layout)?;
        let opened = OpenOptions::new().write(true).custom_flags(libc::O_NOFOLLOW).open(path);
        let failed = |source| FileError::System { path: path.into(), action: "open", source };
        let rows = agreed(Some(comm), opened.map_err(failed))?;
        Ok(Self { path: path.into(), comm: comm.clone(), layout, rows })
    }

    /// An error in the data to be written.
    pub fn refuse(&self, reason: impl Into<String>) -> FileError {
        FileError::Refused { path: self.path.clone(), reason: reason.into() }
    }

    /// Collective. The same result on all ranks.
    pub fn agree<T>(&self, result: Result<T, FileError>) -> Result<T, FileError> {
        agreed(Some(&self.comm), result)
    }

    /// Collective. Runs `act` with the library's file, on rank 0.
    pub(super) fn on_rank_0<T>(
        &self,
        act: impl FnOnce(hid_t, &Path) -> Result<T, FileError>,
    ) -> Result<Option<T>, FileError> {
        let act_alone = |file: &Layout| {
            let _turn = library();
            act(file.0, &self.path)
        };
        self.agree(self.layout.as_ref().map(act_alone).transpose())
    }

    /// Collective. Creates a group. Its parent must exist.
    pub fn create_group(&self, group: &str) -> Result<(), FileError> {
        let made = self.on_rank_0(|file, path| {
            let name = c_text(group);
            // SAFETY: open file, terminated name; the results are checked.
            let made = unsafe {
                let list = H5Pcreate(*H5P_CLS_GROUP_CREATE);
                H5Pset_obj_track_times(list, 0);
                // Up to these numbers, links and attributes stay in the group's header: smaller files, and no
                // remains of outgrown indices in them.
                H5Pset_link_phase_change(list, MOST_COMPACT, 0);
                H5Pset_attr_phase_change(list, MOST_COMPACT, 0);
                let id = H5Gcreate2(file, name.as_ptr(), H5P_DEFAULT, list, H5P_DEFAULT);
                let made = Handle::new(id, H5Gclose);
                H5Pclose(list);
                made
            };
            made.map(drop).map_err(|words| words.into_error(path, "create", group))
        });
        made.map(drop)
    }

    /// Collective. Gives an existing object a second name.
    pub fn hard_link(&self, existing: &str, new: &str) -> Result<(), FileError> {
        let linked = self.on_rank_0(|file, path| {
            let (from, to) = (c_text(existing), c_text(new));
            // SAFETY: open file, terminated names.
            let code =
                unsafe { H5Lcreate_hard(file, from.as_ptr(), file, to.as_ptr(), H5P_DEFAULT, H5P_DEFAULT) };
            check(code, path, "link", new)
        });
        linked.map(drop)
    }

    /// Collective. Creates a data set of `global_rows` rows of `components` numbers (`0`: a plain list) and
    /// writes this rank's `rows`, which begin at row `offset`. Ranks may have no rows.
    pub fn write_slab<T: Element>(
        &self,
        dataset: &str,
        global_rows: u64,
        components: usize,
        offset: u64,
        rows: &[T],
    ) -> Result<(), FileError> {
        debug_assert_eq!(rows.len() % components.max(1), 0);
        let place =
            self.on_rank_0(|file, path| add_dataset(file, path, dataset, T::KIND, global_rows, components));
        let mut place = [place?.unwrap_or(0)];
        self.comm.max_u64(&mut place);
        let at = place[0] + offset * (components.max(1) * size_of::<T>()) as u64;
        let written = self.rows.write_all_at(bytemuck::cast_slice(rows), at);
        let failed = |source| FileError::System { path: self.path.clone(), action: "write", source };
        self.agree(written.map_err(failed))
    }

    /// Collective. Passes all data to the operating system and closes the library's file. Returns this rank's
    /// own file, through which it can wait for the disk.
    pub fn close(self) -> Result<File, FileError> {
        let flushed = self.on_rank_0(|file, path| {
            // SAFETY: open file.
            check(unsafe { H5Fflush(file, H5F_SCOPE_LOCAL) }, path, "write", "the file")
        });
        if let Err(error) = flushed {
            self.abandon();
            return Err(error);
        }
        let Self { path, comm, layout, rows } = self;
        let closed = layout.map_or(Ok(()), |file| file.close(&path));
        agreed(Some(&comm), closed.map(|()| rows))
    }

    /// Not collective; after an error on any rank. Gives up the file; the caller removes it.
    pub fn abandon(self) {
        if self.layout.is_some() {
            // The library keeps it open, so that removal alone would not free its space. If this fails too,
            // the first error matters.
            let _ = self.rows.set_len(0);
        }
    }
}

/// Creates the file, by rank 0.
fn lay_out(path: &Path) -> Result<Layout, FileError> {
    let _turn = library();
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            return Err(FileError::System { path: path.into(), action: "replace", source });
        }
        _ => {}
    }
    let name = c_path(path);
    // SAFETY: fresh property lists, closed below, and a terminated name. Exclusive creation does not follow
    // links. The root group keeps no timestamps, like all other objects.
    let file = unsafe {
        let access = H5Pcreate(*H5P_CLS_FILE_ACCESS);
        // The 1.8 format carries checksums of its own metadata, which the older one does not.
        H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_LATEST);
        H5Pset_alignment(access, ALIGN_FROM, ALIGNMENT);
        // No reserve for small data sets, which would be left in the file.
        H5Pset_small_data_block_size(access, 0);
        let root = H5Pcreate(*H5P_CLS_FILE_CREATE);
        H5Pset_obj_track_times(root, 0);
        let file = H5Fcreate(name.as_ptr(), H5F_ACC_EXCL, root, access);
        // At once: the next call clears the complaint.
        let file = if file < 0 { Err(Complaint::fetch()) } else { Ok(Layout(file)) };
        H5Pclose(root);
        H5Pclose(access);
        file
    };
    file.map_err(|words| words.into_error(path, "create", "the file"))
}

/// Adds a data set, by rank 0. Returns the place of its first byte, 0 if it has no bytes.
fn add_dataset(
    file: hid_t,
    path: &Path,
    dataset: &str,
    kind: Kind,
    rows: u64,
    components: usize,
) -> Result<u64, FileError> {
    let failed = |words: Complaint| words.into_error(path, "create", dataset);
    let (shape, rank) = ([rows, components as u64], if components == 0 { 1 } else { 2 });
    let name = c_text(dataset);
    // SAFETY: open file, terminated name, `rank` dimensions; results are checked.
    unsafe {
        let space = H5Screate_simple(rank, shape.as_ptr(), std::ptr::null());
        let space = Handle::new(space, H5Sclose).map_err(failed)?;
        let list = Handle::new(H5Pcreate(*H5P_CLS_DATASET_CREATE), H5Pclose).map_err(failed)?;
        // Allocated at once, for its place. Contents are always written in full, so no fill values; no
        // timestamps, so that equal contents give equal files.
        H5Pset_alloc_time(list.id, H5D_ALLOC_TIME_EARLY);
        H5Pset_fill_time(list.id, H5D_FILL_TIME_NEVER);
        H5Pset_obj_track_times(list.id, 0);
        let kind = kind.library_type();
        let set = H5Dcreate2(file, name.as_ptr(), kind, space.id, H5P_DEFAULT, list.id, H5P_DEFAULT);
        let set = Handle::new(set, H5Dclose).map_err(failed)?;
        if rows == 0 {
            return Ok(0);
        }
        match H5Dget_offset(set.id) {
            u64::MAX => Err(failed(Complaint::fetch())),
            place => Ok(place),
        }
    }
}
