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
        assert!(error.contains("hostile.vtkhdf: coord is chunked"), "{error}");
    }
}

/// A pipe under the name of a state is no file: nobody waits for what another program might write to it.
#[test]
fn pipes_are_refused_at_once() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("pipe.hdf");
    let name = std::ffi::CString::new(path.to_str().expect("UTF-8")).expect("no zero byte");
    // SAFETY: a terminated name that lives through the call.
    assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0, "the pipe is made");
    let error = Reader::open_alone(&path).map(drop).expect_err("a pipe").to_string();
    assert!(error.contains("pipe.hdf") && error.contains("neither a file nor a link to one"), "{error}");
    // Among the states that a run may go on from it does not count.
    let checkpoint = directory.path().join("col.checkpoint_000000010.hdf");
    std::fs::rename(&path, checkpoint).expect("renamed");
    let found = agimp::io::snapshot::directory::candidates(directory.path(), "col", None).expect("listed");
    assert!(found.whole.is_empty() && found.damaged.is_empty(), "{found:?}");
}
