//! A run that goes on from one of its checkpoints. The test has the module `launch`.
use std::path::Path;

use crate::launch::{Outcome, contents, run, succeed};

/// Goes on from the second of the checkpoints in a directory, on three ranks: what is left is that of the run before.
pub(crate) fn assert_restart_gives(reference: &Outcome, directory: &Path, job: &Path, name: &str) {
    let files = contents(&directory.join("out").join(name));
    let mut checkpoints: Vec<_> =
        files.keys().filter(|file| file.contains("checkpoint") && file.ends_with("hdf")).collect();
    checkpoints.sort();
    let from = format!("out/{name}/{}", checkpoints[1]);
    succeed(&mut run(directory, 3, 1, job, &["--quiet", "--restart", &from]));
    reference.assert_same(&Outcome::read(directory, name), &format!("restart from {from}"));
}
