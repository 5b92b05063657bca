//! The bytes of a state file, through all that `agimp info --verify` does.
#![no_main]
use std::io::Write as _;

use agimp::io::hdf5_file::prepare;
use agimp::io::snapshot::compare;
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: prepare(), |bytes: &[u8]| {
    let mut file = tempfile::NamedTempFile::new().expect("temporary file");
    file.write_all(bytes).expect("written");
    let _ = compare::verify(file.path());
    let _ = compare::digest(file.path());
});
