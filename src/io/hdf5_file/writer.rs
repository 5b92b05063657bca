//! A new file of all ranks.
use std::fs::{File, OpenOptions};
use std::mem::ManuallyDrop;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use hdf5::Dataspace;
use hdf5::plist::dataset_create::{AllocTime, FillTime};
use hdf5::plist::group_create::LinkPhaseChange;
use hdf5::plist::{DatasetCreateBuilder, FileAccessBuilder, FileCreateBuilder};
use hdf5_sys::h5d::H5Dcreate2;
use hdf5_sys::h5f::{H5F_ACC_EXCL, H5Fcreate};
use hdf5_sys::h5p::H5P_DEFAULT;
use partition::comm::Comm;

use super::{Element, FileError, Kind, OfFile as _, agreed, c_path, c_text, library};

/// Data sets of at least this many bytes start at a multiple of [`ALIGNMENT`].
const ALIGN_FROM: u64 = 4 << 20;
/// The usual stripe of parallel file systems.
const ALIGNMENT: u64 = 1 << 20;
/// Links or attributes of a group that are stored without an index.
const MOST_COMPACT: u32 = 255;

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
struct Layout(ManuallyDrop<hdf5::File>);

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
        act: impl FnOnce(&hdf5::File, &Path) -> Result<T, FileError>,
    ) -> Result<Option<T>, FileError> {
        let act_alone = |file: &Layout| {
            let _turn = library();
            act(&file.0, &self.path)
        };
        self.agree(self.layout.as_ref().map(act_alone).transpose())
    }

    /// Collective. Creates a group. Its parent must exist.
    pub fn create_group(&self, group: &str) -> Result<(), FileError> {
        // Up to these numbers, links and attributes stay in the group's header: smaller files, and no remains
        // of outgrown indices in them.
        let links = LinkPhaseChange { max_compact: MOST_COMPACT, min_dense: 0 };
        let made = self.on_rank_0(|file, path| {
            file.create_group_builder()
                .create_intermediate_group(false)
                .with_gcpl(|list| {
                    list.obj_track_times(false).link_phase_change(links).attr_phase_change(MOST_COMPACT, 0)
                })
                .create(group)
                .of_file(path, "create", group)
        });
        made.map(drop)
    }

    /// Collective. Gives an existing object a second name.
    pub fn hard_link(&self, existing: &str, new: &str) -> Result<(), FileError> {
        self.on_rank_0(|file, path| file.link_hard(existing, new).of_file(path, "link", new)).map(drop)
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
        let flushed = self.on_rank_0(|file, path| file.flush().of_file(path, "write", "the file"));
        if let Err(error) = flushed {
            self.abandon();
            return Err(error);
        }
        let Self { path, comm, layout, rows } = self;
        let closed = layout.map_or(Ok(()), |file| {
            let _turn = library();
            ManuallyDrop::into_inner(file.0).close().of_file(&path, "close", "the file")
        });
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
    let create = || {
        // The 1.8 format carries checksums of its own metadata, which the older one does not. No reserve for
        // small data sets, which would be left in the file.
        let access = FileAccessBuilder::new()
            .libver_v18()
            .alignment(ALIGN_FROM, ALIGNMENT)
            .small_data_block_size(0)
            .finish()?;
        // The root group keeps no timestamps, like all other objects.
        let root = FileCreateBuilder::new().obj_track_times(false).finish()?;
        let name = c_path(path);
        // SAFETY: open property lists and a terminated name; the identifier is fresh. Exclusive creation does
        // not follow links.
        unsafe {
            let id = H5Fcreate(name.as_ptr(), H5F_ACC_EXCL, root.id(), access.id());
            hdf5::from_id(hdf5::h5check(id)?)
        }
    };
    create().map(|file| Layout(ManuallyDrop::new(file))).of_file(path, "create", "the file")
}

/// Adds a data set, by rank 0. Returns the place of its first byte, 0 if it has no bytes.
fn add_dataset(
    file: &hdf5::File,
    path: &Path,
    dataset: &str,
    kind: Kind,
    rows: u64,
    components: usize,
) -> Result<u64, FileError> {
    let shape = [rows as usize, components];
    let create = || -> hdf5::Result<hdf5::Dataset> {
        let space = Dataspace::try_new(&shape[..if components == 0 { 1 } else { 2 }])?;
        // Allocated at once, for its place. Contents are always written in full, so no fill values; no
        // timestamps, so that equal contents give equal files.
        let list = DatasetCreateBuilder::new()
            .alloc_time(Some(AllocTime::Early))
            .fill_time(FillTime::Never)
            .obj_track_times(false)
            .finish()?;
        let (kind, name) = (kind.library_type()?, c_text(dataset));
        // SAFETY: open file and lists, terminated name; the identifier is fresh.
        unsafe {
            let id = H5Dcreate2(
                file.id(),
                name.as_ptr(),
                kind.id(),
                space.id(),
                H5P_DEFAULT,
                list.id(),
                H5P_DEFAULT,
            );
            hdf5::from_id(hdf5::h5check(id)?)
        }
    };
    let set = create().of_file(path, "create", dataset)?;
    match set.offset() {
        _ if rows == 0 => Ok(0),
        Some(place) => Ok(place),
        None => Err(hdf5::Error::from("no place in the file")).of_file(path, "create", dataset),
    }
}
