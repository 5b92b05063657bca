//! Files that only the library's own calls can make.
use hdf5::plist::DatasetCreateBuilder;
use hdf5_sys::h5d::H5Dcreate2;

use super::*;

/// A file with one data set of that shape, in chunks or not, of which no byte is written.
fn declaring(path: &Path, shape: [usize; 2], chunk: Option<[usize; 2]>, kind: Kind) {
    let file = hdf5::File::create(path).unwrap();
    let space = hdf5::Dataspace::try_new(shape).unwrap();
    let mut list = DatasetCreateBuilder::new();
    if let Some([rows, width]) = chunk {
        list.chunk((rows, width));
    }
    let (list, kind, name) = (list.finish().unwrap(), kind.library_type().unwrap(), c_text("rows"));
    let defaults = H5P_DEFAULT;
    // SAFETY: open file and lists, terminated name; the identifier is fresh. (The crate multiplies the edges
    // of the shape, which overflows here.)
    let set: hdf5::Result<hdf5::Dataset> = unsafe {
        let id = H5Dcreate2(file.id(), name.as_ptr(), kind.id(), space.id(), defaults, list.id(), defaults);
        hdf5::h5check(id).and_then(|id| hdf5::from_id(id))
    };
    set.unwrap();
}

#[test]
fn rows_times_width_beyond_64_bits_take_no_memory() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("wraps.hdf");
    for (rows, width) in [(1 << 61, 8), (1 << 62, 4), (1 << 34, 1)] {
        declaring(&path, [rows, width], Some([64, width]), Kind::U8);
        let error = Reader::open_alone(&path).unwrap().read_slab::<u8>("rows", 0, rows as u64).unwrap_err();
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
