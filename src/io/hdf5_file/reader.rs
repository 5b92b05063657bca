//! An existing file, opened by each rank for itself.
use std::fs::{File, OpenOptions};
use std::io::Read;
use std::mem::MaybeUninit;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use hdf5_sys::h5d::H5D_CONTIGUOUS;
use hdf5_sys::h5f::{H5F_ACC_RDONLY, H5Fopen};
#[allow(deprecated)] // In 1.12 and later; the newer call is not in 1.10.
use hdf5_sys::h5l::H5Lget_info1;
use hdf5_sys::h5l::{H5L_TYPE_HARD, H5L_info1_t, H5Lexists};
use hdf5_sys::h5p::{H5P_DEFAULT, H5Pget_external_count, H5Pget_layout, H5Pget_nfilters};
use partition::comm::Comm;

use super::{Element, FileError, Kind, OfFile as _, agreed, c_path, c_text, library, words};
use crate::memory::may_fail;

/// No data set of this program has more numbers in a row.
const MOST_COMPONENTS: u64 = 1 << 10;
/// Bytes that are read together when a data set is checked piece by piece.
const PIECE: u64 = 1 << 20;

/// An existing file, opened for reading. Its declarations are not trusted: only groups and data sets of the
/// file itself are read, only contiguous ones without filters, and none that would be longer than the file.
pub struct Reader {
    path: PathBuf,
    comm: Option<Comm>,
    layout: hdf5::File,
    /// The file for plain reads of rows.
    rows: File,
    /// Bytes of the file.
    size: u64,
}

/// A data set as the file describes it. It lies within the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Rows.
    pub rows: u64,
    /// Numbers of a row; 0 for a plain list, which has one.
    pub components: usize,
    /// Its numbers.
    pub kind: Kind,
    /// First byte.
    place: u64,
    /// Bytes.
    bytes: u64,
}

impl Reader {
    /// Collective. Opens the file on all ranks.
    pub fn open(comm: &Comm, path: &Path) -> Result<Self, FileError> {
        // One rank tries first: a file that is missing or foreign is opened once.
        let seen = if comm.rank() == 0 { look_at(path).map(drop) } else { Ok(()) };
        agreed(Some(comm), seen)?;
        agreed(Some(comm), Self::open_here(Some(comm), path))
    }

    /// Not collective. Opens the file for this process alone; needs no MPI.
    pub fn open_alone(path: &Path) -> Result<Self, FileError> {
        Self::open_here(None, path)
    }

    fn open_here(comm: Option<&Comm>, path: &Path) -> Result<Self, FileError> {
        let (rows, size) = look_at(path)?;
        let _turn = library();
        let name = c_path(path);
        // SAFETY: a terminated name; the identifier is fresh.
        let opened = unsafe {
            hdf5::h5check(H5Fopen(name.as_ptr(), H5F_ACC_RDONLY, H5P_DEFAULT))
                .and_then(|id| hdf5::from_id(id))
        };
        let layout = match opened {
            Err(error) if words(&error).iter().take(3).any(|text| text.contains("truncated")) => {
                let reason = words(&error).into_iter().take(3).collect::<Vec<_>>().join("; ");
                return Err(FileError::CutShort { path: path.into(), reason });
            }
            opened => opened.of_file(path, "open", "the file")?,
        };
        Ok(Self { path: path.into(), comm: comm.cloned(), layout, rows, size })
    }

    /// The file's name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn file(&self) -> &hdf5::File {
        &self.layout
    }

    /// An error of this file that lies in its contents.
    pub fn refuse(&self, reason: impl Into<String>) -> FileError {
        FileError::Refused { path: self.path.clone(), reason: reason.into() }
    }

    /// Collective on a shared file. The same result on all ranks.
    pub fn agree<T>(&self, result: Result<T, FileError>) -> Result<T, FileError> {
        agreed(self.comm.as_ref(), result)
    }

    /// Not collective. Refuses an object of that many elements of so many bytes if the file cannot hold it;
    /// returns its bytes. To be called before memory is allocated whose size the file declares.
    pub(super) fn held_bytes(&self, object: &str, count: u64, element: usize) -> Result<u64, FileError> {
        match count.checked_mul(element as u64) {
            Some(bytes) if bytes <= self.size && usize::try_from(bytes).is_ok() => Ok(bytes),
            _ => Err(self.refuse(format!(
                "{object} has {count} elements of {element} bytes, more than the file of {} bytes holds",
                self.size
            ))),
        }
    }

    /// Not collective. True when the object and all groups above it exist in this file.
    pub fn exists(&self, object: &str) -> bool {
        matches!(self.leads_to(object), Ok(true))
    }

    /// Not collective. Whether a path leads to an object. One that leads through a link to another place or
    /// file is refused, and not followed.
    pub(super) fn leads_to(&self, object: &str) -> Result<bool, FileError> {
        let _turn = library();
        let object = object.trim_matches('/');
        let ends = object.match_indices('/').map(|(at, _)| at).chain([object.len()]);
        for end in ends {
            let name = c_text(&object[..end]);
            // SAFETY: open file, terminated name. The library fills the record when it succeeds; its kind is
            // read as the number that it is in C, since links of user-defined kinds have numbers without a
            // name.
            #[allow(deprecated)]
            let is_hard = unsafe {
                let file = self.layout.id();
                if H5Lexists(file, name.as_ptr(), H5P_DEFAULT) <= 0 {
                    return Ok(false);
                }
                let mut info = MaybeUninit::<H5L_info1_t>::zeroed();
                hdf5::h5check(H5Lget_info1(file, name.as_ptr(), info.as_mut_ptr(), H5P_DEFAULT))
                    .of_file(&self.path, "read", object)?;
                let kind = (&raw const (*info.as_ptr()).type_).cast::<std::ffi::c_int>();
                kind.read() == H5L_TYPE_HARD as std::ffi::c_int
            };
            if !is_hard {
                let link = &object[..end];
                return Err(
                    self.refuse(format!("{link} is a link to another location; agimp does not follow it"))
                );
            }
        }
        Ok(true)
    }

    /// Not collective. Type, size and place of a data set, if it is one that this program could have written.
    pub fn stored(&self, dataset: &str) -> Result<Stored, FileError> {
        let _turn = library();
        if !self.leads_to(dataset)? {
            return Err(self.refuse(format!("data set {dataset} is missing")));
        }
        let set = self.layout.dataset(dataset).of_file(&self.path, "read", dataset)?;
        let list = set.create_plist().of_file(&self.path, "read", dataset)?;
        // SAFETY: an open property list.
        let plain = unsafe {
            H5Pget_layout(list.id()) == H5D_CONTIGUOUS
                && H5Pget_external_count(list.id()) == 0
                && H5Pget_nfilters(list.id()) == 0
        };
        if !plain {
            let reason =
                "is chunked, compressed or external; expected a contiguous data set, as agimp writes it";
            return Err(self.refuse(format!("{dataset} {reason}")));
        }
        let kind = set.dtype().of_file(&self.path, "read", dataset)?;
        let Some(kind) = Kind::of_type(&kind) else {
            return Err(self.refuse(format!("{dataset} holds no numbers of a type that agimp writes")));
        };
        let (rows, components) = match set.space().of_file(&self.path, "read", dataset)?.shape()[..] {
            [rows] => (rows as u64, 0),
            [rows, components] => (rows as u64, components as u64),
            ref shape => {
                let rank = shape.len();
                return Err(self.refuse(format!("{dataset} has {rank} dimensions, not one or two")));
            }
        };
        if components > MOST_COMPONENTS {
            return Err(self.refuse(format!("{dataset} has {components} numbers in each row")));
        }
        let row = components.max(1) as usize * kind.bytes();
        let bytes = self.held_bytes(dataset, rows, row)?;
        // Without a place, beyond any file.
        let place = if bytes == 0 { 0 } else { set.offset().unwrap_or(u64::MAX) };
        if place.checked_add(bytes).is_none_or(|end| end > self.size) {
            return Err(self.refuse(format!("{dataset} does not lie within the file")));
        }
        Ok(Stored { rows, components: components as usize, kind, place, bytes })
    }

    /// Collective on a shared file. Reads rows `offset .. offset + rows` of a data set of numbers of type
    /// `T`.
    pub fn read_slab<T: Element>(&self, dataset: &str, offset: u64, rows: u64) -> Result<Vec<T>, FileError> {
        let read = self.stored(dataset).and_then(|stored| self.read_rows(dataset, stored, offset, rows));
        self.agree(read)
    }

    fn read_rows<T: Element>(
        &self,
        dataset: &str,
        stored: Stored,
        offset: u64,
        rows: u64,
    ) -> Result<Vec<T>, FileError> {
        if stored.kind != T::KIND {
            return Err(self.refuse(format!("{dataset} holds {}; expected {}", stored.kind, T::KIND)));
        }
        if offset.checked_add(rows).is_none_or(|end| end > stored.rows) {
            let held = stored.rows;
            let reason = format!("{dataset} has {held} rows; expected {rows} from row {offset}");
            return Err(self.refuse(reason));
        }
        // Both are at most the bytes of the data set, which lies within the file.
        let row = stored.components.max(1);
        let mut values = Vec::new();
        let numbers = rows as usize * row;
        if may_fail(|| values.try_reserve_exact(numbers)).is_err() {
            let bytes = numbers * size_of::<T>();
            return Err(self.refuse(format!("no memory for {bytes} bytes of {dataset}")));
        }
        values.resize(numbers, T::zeroed());
        let at = stored.place + offset * (row * size_of::<T>()) as u64;
        self.read_exact(bytemuck::cast_slice_mut(&mut values), at)?;
        Ok(values)
    }

    /// Not collective. Passes all bytes of a data set to `each`, piece by piece.
    pub fn for_bytes(&self, dataset: &str, mut each: impl FnMut(&[u8])) -> Result<(), FileError> {
        let stored = self.stored(dataset)?;
        let mut piece = vec![0; stored.bytes.min(PIECE) as usize];
        for start in (0..stored.bytes).step_by(PIECE as usize) {
            let piece = &mut piece[..(stored.bytes - start).min(PIECE) as usize];
            self.read_exact(piece, stored.place + start)?;
            each(piece);
        }
        Ok(())
    }

    fn read_exact(&self, bytes: &mut [u8], at: u64) -> Result<(), FileError> {
        let failed = |source| FileError::System { path: self.path.clone(), action: "read", source };
        self.rows.read_exact_at(bytes, at).map_err(failed)
    }
}

/// Opens a file and checks its first bytes. Returns it with its size.
fn look_at(path: &Path) -> Result<(File, u64), FileError> {
    let system = |source| FileError::System { path: path.into(), action: "open", source };
    // Without waiting: the file may be a pipe to which nobody ever writes.
    let mut file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path).map_err(system)?;
    let data = file.metadata().map_err(system)?;
    if !data.is_file() {
        let reason = "neither a file nor a link to one".into();
        return Err(FileError::Refused { path: path.into(), reason });
    }
    let mut start = [0; 8];
    match file.read_exact(&mut start) {
        Ok(()) if start == *b"\x89HDF\r\n\x1a\n" => Ok((file, data.len())),
        Ok(()) => Err(FileError::NotHdf5 { path: path.into() }),
        Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            Err(FileError::CutShort { path: path.into(), reason: "fewer than 8 bytes".into() })
        }
        Err(e) => Err(system(e)),
    }
}
