//! Data sets: tables of numbers, of which each rank writes or reads a contiguous part.
use std::ffi::c_void;

use hdf5_sys::h5::herr_t;
use hdf5_sys::h5d::{H5Dclose, H5Dcreate2, H5Dget_space, H5Dget_type, H5Dopen2, H5Dread, H5Dwrite};
use hdf5_sys::h5i::hid_t;
use hdf5_sys::h5p::H5P_DEFAULT;
use hdf5_sys::h5s::{
    H5S_SELECT_SET, H5Sclose, H5Screate_simple, H5Sget_simple_extent_dims, H5Sget_simple_extent_ndims,
    H5Sselect_hyperslab, H5Sselect_none,
};
use hdf5_sys::h5t::{H5Tclose, H5Tget_size};

use super::{Element, FileError, Handle, ParallelFile, c_text};

/// Most bytes that one rank hands to one collective transfer; larger slabs go in rounds.
const ROUND_BYTES: u64 = 1 << 30;

/// A rank's part of a data set.
#[derive(Clone, Copy)]
struct Slab {
    offset: u64,
    rows: u64,
    width: u64,
}

impl ParallelFile {
    /// Creates a data set of `global_rows` rows of `components` numbers (`0`: a plain list) and writes
    /// this rank's `rows`, which begin at row `offset`. Ranks may have no rows.
    pub fn write_slab<T: Element>(
        &self,
        dataset: &str,
        global_rows: u64,
        components: usize,
        offset: u64,
        rows: &[T],
    ) -> Result<(), FileError> {
        let shape = [global_rows, components as u64];
        let rank = if components == 0 { 1 } else { 2 };
        let name = c_text(dataset);
        // SAFETY: open file, terminated name, `rank` dimensions; results are checked.
        let created = unsafe {
            let space = H5Screate_simple(rank, shape.as_ptr(), std::ptr::null());
            self.wrap(space, H5Sclose, "describe", dataset).and_then(|space| {
                let id = H5Dcreate2(
                    self.id(),
                    name.as_ptr(),
                    T::file_type(),
                    space.id,
                    H5P_DEFAULT,
                    self.create.id,
                    H5P_DEFAULT,
                );
                self.wrap(id, H5Dclose, "create", dataset)
            })
        };
        let set = self.agree(created)?;
        let width = components.max(1);
        debug_assert_eq!(rows.len() % width, 0);
        let slab = Slab { offset, rows: (rows.len() / width) as u64, width: width as u64 };
        self.in_rounds::<T>(&set, dataset, slab, global_rows, "write", |memory, file, first| {
            let part = &rows[first * width..];
            let source = if part.is_empty() { std::ptr::NonNull::dangling().as_ptr() } else { part.as_ptr() };
            // SAFETY: the memory space selects no more elements than `part` holds.
            unsafe {
                H5Dwrite(set.id, T::memory_type(), memory, file, self.transfer.id, source.cast::<c_void>())
            }
        })
    }

    /// Reads rows `offset .. offset + rows` of a data set; numbers are converted to `T`.
    pub fn read_slab<T: Element>(&self, dataset: &str, offset: u64, rows: u64) -> Result<Vec<T>, FileError> {
        let opened = self.open_dataset(dataset).and_then(|set| {
            let (global_rows, components) = self.shape(dataset)?;
            if offset.checked_add(rows).is_none_or(|end| end > global_rows) {
                return Err(self.refuse(format!(
                    "{dataset} has {global_rows} rows; {rows} from row {offset} were asked for"
                )));
            }
            let width = components.max(1);
            let row_bytes = width.saturating_mul(size_of::<T>());
            self.check_bytes(rows, row_bytes, || format!("data set {dataset}"))?;
            Ok((set, global_rows, width, rows as usize * width))
        });
        let (set, global_rows, width, numbers) = self.agree(opened)?;
        let mut values = vec![T::zeroed(); numbers];
        let slab = Slab { offset, rows, width: width as u64 };
        self.in_rounds::<T>(&set, dataset, slab, global_rows, "read", |memory, file, first| {
            let part = &mut values[first * width..];
            // SAFETY: the memory space selects no more elements than `part` holds.
            unsafe {
                H5Dread(set.id, T::memory_type(), memory, file, self.transfer.id, part.as_mut_ptr().cast())
            }
        })?;
        Ok(values)
    }

    /// Transfers a slab by collective calls of at most [`ROUND_BYTES`] per rank. All ranks make the same
    /// number of calls; one that has nothing (left) takes part with an empty selection. Such a selection
    /// must come from a space with a dimension of zero: with an `H5S_NULL` memory space some versions
    /// of the library damage what the other ranks write.
    fn in_rounds<T: Element>(
        &self,
        set: &Handle,
        dataset: &str,
        slab: Slab,
        global_rows: u64,
        action: &'static str,
        mut transfer: impl FnMut(hid_t, hid_t, usize) -> herr_t,
    ) -> Result<(), FileError> {
        if global_rows == 0 {
            return Ok(());
        }
        let rows_per_round = (ROUND_BYTES / (slab.width * size_of::<T>() as u64)).max(1);
        let mut rounds = [slab.rows.div_ceil(rows_per_round).max(1)];
        if let Some(comm) = &self.comm {
            comm.max_u64(&mut rounds);
        }
        for round in 0..rounds[0] {
            let first = (round * rows_per_round).min(slab.rows);
            let count = (slab.rows - first).min(rows_per_round);
            let (start, extent) = ([slab.offset + first, 0], [count, slab.width]);
            // SAFETY: `set` is open; start and extent have as many entries as the data set has
            // dimensions (two at most), and HDF5 checks the selection against the extent.
            let mut select_and_transfer = || unsafe {
                let file = self.wrap(H5Dget_space(set.id), H5Sclose, action, dataset)?;
                let rank = H5Sget_simple_extent_ndims(file.id);
                let memory = H5Screate_simple(rank, extent.as_ptr(), std::ptr::null());
                let memory = self.wrap(memory, H5Sclose, action, dataset)?;
                let selected = if count == 0 {
                    H5Sselect_none(file.id).min(H5Sselect_none(memory.id))
                } else {
                    let none = std::ptr::null();
                    H5Sselect_hyperslab(file.id, H5S_SELECT_SET, start.as_ptr(), none, extent.as_ptr(), none)
                };
                self.check(selected, action, dataset)
                    .and_then(|()| self.check(transfer(memory.id, file.id, first as usize), action, dataset))
            };
            let done = select_and_transfer();
            self.agree(done)?;
        }
        Ok(())
    }

    fn open_dataset(&self, dataset: &str) -> Result<Handle, FileError> {
        if !self.exists(dataset) {
            return Err(self.refuse(format!("data set {dataset} is missing")));
        }
        let name = c_text(dataset);
        // SAFETY: open file, terminated name.
        let id = unsafe { H5Dopen2(self.id(), name.as_ptr(), H5P_DEFAULT) };
        self.wrap(id, H5Dclose, "open", dataset)
    }

    /// Not collective. Rows and components of a data set; a plain list has 0 components.
    pub fn shape(&self, dataset: &str) -> Result<(u64, usize), FileError> {
        let set = self.open_dataset(dataset)?;
        let mut dims = [0; 2];
        // SAFETY: open data set; `dims` is only filled when it is long enough.
        unsafe {
            let space = self.wrap(H5Dget_space(set.id), H5Sclose, "describe", dataset)?;
            let rank = H5Sget_simple_extent_ndims(space.id);
            if !(1..=2).contains(&rank) {
                return Err(self.refuse(format!("{dataset} has {rank} dimensions, not one or two")));
            }
            let code = H5Sget_simple_extent_dims(space.id, dims.as_mut_ptr(), std::ptr::null_mut());
            self.check(code, "describe", dataset)?;
        }
        Ok((dims[0], dims[1] as usize))
    }

    /// Not collective. Bytes of one number of a data set.
    pub fn element_bytes(&self, dataset: &str) -> Result<usize, FileError> {
        let set = self.open_dataset(dataset)?;
        // SAFETY: open data set; the type is checked and closed by `wrap`.
        unsafe {
            let kind = self.wrap(H5Dget_type(set.id), H5Tclose, "describe", dataset)?;
            Ok(H5Tget_size(kind.id))
        }
    }
}
