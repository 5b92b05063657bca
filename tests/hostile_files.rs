//! Files made with intent: whatever a file declares, reading it ends with a message.
use std::path::Path;

use agimp::io::hdf5_file::Reader;
use hdf5::types::FixedAscii;

fn file_in(directory: &Path) -> (std::path::PathBuf, hdf5::File) {
    let path = directory.join("hostile.vtkhdf");
    let file = hdf5::File::create(&path).expect("created");
    (path, file)
}

/// The contents of an attribute do not run over the memory that its type asks for.
#[test]
fn a_text_with_many_elements_is_refused() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let (path, file) = file_in(directory.path());
    let group = file.create_group("state").expect("group");
    let text = FixedAscii::<20>::from_ascii(b"agimp state AAAAAAAA").expect("ASCII");
    let magic = group.new_attr::<FixedAscii<20>>().shape(3000).create("magic").expect("attribute");
    magic.write_raw(&vec![text; 3000]).expect("written");
    drop((magic, group));
    file.close().expect("closed");
    let read = Reader::open_alone(&path).expect("opened").text("state", "magic");
    let error = read.expect_err("3000 texts are no text").to_string();
    assert!(error.contains("hostile.vtkhdf: attribute state/magic is not one text"), "{error}");
}

/// A text of variable length is not read as the address of its letters.
#[test]
fn a_text_of_variable_length_is_refused() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let (path, file) = file_in(directory.path());
    let group = file.create_group("state").expect("group");
    let text = hdf5::types::VarLenAscii::from_ascii("agimp state").expect("ASCII");
    let magic = group.new_attr::<hdf5::types::VarLenAscii>().create("magic").expect("attribute");
    magic.write_scalar(&text).expect("written");
    drop((magic, group));
    file.close().expect("closed");
    let read = Reader::open_alone(&path).expect("opened").text("state", "magic");
    let error = read.expect_err("an address is no text").to_string();
    assert!(error.contains("attribute state/magic is not one text of fixed length"), "{error}");
}

/// A data set without any bytes on disk declares more rows than memory, or than 64 bits count in bytes.
#[test]
fn declared_sizes_are_compared_with_the_file() {
    for rows in [1_usize << 34, 1 << 44, 1 << 60, 1 << 62] {
        let directory = tempfile::tempdir().expect("temporary directory");
        let (path, file) = file_in(directory.path());
        let set = file.new_dataset::<u32>().chunk(64).shape(rows).create("coord");
        drop(set.expect("data set"));
        file.close().expect("closed");
        let read = Reader::open_alone(&path).expect("opened").read_slab::<u32>("coord", 0, rows as u64);
        let error = read.expect_err("no file holds so much").to_string();
        assert!(error.contains("hostile.vtkhdf: coord is in pieces"), "{error}");
    }
}
