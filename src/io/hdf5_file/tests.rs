//! Files that only the library's own calls can make.
use hdf5_sys::h5d::{H5Dclose, H5Dcreate2};
use hdf5_sys::h5f::{H5F_ACC_TRUNC, H5Fclose, H5Fcreate};
use hdf5_sys::h5p::{H5P_CLS_DATASET_CREATE, H5P_DEFAULT, H5Pclose, H5Pcreate, H5Pset_chunk};
use hdf5_sys::h5s::{H5Sclose, H5Screate_simple};

use super::*;

/// A file with one data set of that shape, in chunks or not, of which no byte is written.
fn declaring(path: &Path, shape: [u64; 2], chunk: Option<[u64; 2]>, kind: Kind) {
    let _turn = library();
    let (name, set) = (c_path(path), c_text("rows"));
    // SAFETY: terminated names, two dimensions each; the identifiers are closed.
    unsafe {
        let file = H5Fcreate(name.as_ptr(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
        let space = H5Screate_simple(2, shape.as_ptr(), std::ptr::null());
        let list = H5Pcreate(*H5P_CLS_DATASET_CREATE);
        if let Some(chunk) = chunk {
            H5Pset_chunk(list, 2, chunk.as_ptr());
        }
        let id = H5Dcreate2(file, set.as_ptr(), kind.library_type(), space, H5P_DEFAULT, list, H5P_DEFAULT);
        assert!(id >= 0, "{}", Complaint::fetch().words);
        H5Dclose(id);
        H5Pclose(list);
        H5Sclose(space);
        H5Fclose(file);
    }
}

#[test]
fn rows_times_width_beyond_64_bits_take_no_memory() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("wraps.hdf");
    for (rows, width) in [(1 << 61, 8), (1 << 62, 4), (1 << 34, 1)] {
        declaring(&path, [rows, width], Some([64, width]), Kind::U8);
        let error = Reader::open_alone(&path).unwrap().read_slab::<u8>("rows", 0, rows).unwrap_err();
        assert!(error.to_string().contains("wraps.hdf: rows is chunked"), "{error}");
    }
}

#[test]
fn a_contiguous_data_set_is_not_longer_than_its_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("long.hdf");
    for (rows, width) in [(1 << 57, 8), (1 << 34, 1), (1 << 20, 3)] {
        declaring(&path, [rows, width], None, Kind::F64);
        let error = Reader::open_alone(&path).unwrap().stored("rows").unwrap_err();
        assert!(error.to_string().contains("more than the file of"), "{error}");
    }
    // Short enough, but the file has no bytes of it.
    declaring(&path, [2, 3], None, Kind::F64);
    let error = Reader::open_alone(&path).unwrap().stored("rows").unwrap_err();
    assert!(error.to_string().contains("does not lie within the file"), "{error}");
}
