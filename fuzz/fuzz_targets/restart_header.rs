//! The bytes of a state file, as far as its header is read.
#![no_main]
use std::io::Write as _;

use agimp::io::hdf5_file::{Reader, prepare};
use agimp::io::snapshot::{Header, job_text};
use libfuzzer_sys::fuzz_target;

fuzz_target!(init: prepare(), |bytes: &[u8]| {
    let mut file = tempfile::NamedTempFile::new().expect("temporary file");
    file.write_all(bytes).expect("written");
    if let Ok(reader) = Reader::open_alone(file.path()) {
        let _ = Header::read(&reader);
    }
    let _ = job_text(file.path());
});
