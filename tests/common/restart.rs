//! Runs on several ranks, and from one of their checkpoints, that must give the same. The test has the module `launch`.
use std::path::Path;

use super::launch::{Outcome, contents, run, succeed, text};

/// Runs a job of that name on 1, 2 and 3 ranks and goes on from its second checkpoint: the results are the same. `look` sees the
/// directory of each run, and what the run said.
pub(crate) fn assert_same_on_any_ranks(job: &str, name: &str, mut look: impl FnMut(&Path, &str)) {
    let mut reference: Option<Outcome> = None;
    for ranks in [1, 2, 3] {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join(format!("{name}.toml"));
        std::fs::write(&path, job).expect("job");
        let output = succeed(&mut run(directory.path(), ranks, 1, &path, &[]));
        look(directory.path(), &text(&output));
        let result = Outcome::read(directory.path(), name);
        let reference = reference.get_or_insert(result.clone());
        reference.assert_same(&result, &format!("{ranks} ranks"));
        if ranks == 2 {
            assert_restart_gives(reference, directory.path(), &path, name);
        }
    }
}

/// Goes on from the second of the checkpoints in a directory, on three ranks: what is left is that of the run before.
fn assert_restart_gives(reference: &Outcome, directory: &Path, job: &Path, name: &str) {
    let files = contents(&directory.join("out").join(name));
    let mut checkpoints: Vec<_> =
        files.keys().filter(|file| file.contains("checkpoint") && file.ends_with("hdf")).collect();
    checkpoints.sort();
    let from = format!("out/{name}/{}", checkpoints[1]);
    succeed(&mut run(directory, 3, 1, job, &["--quiet", "--restart", &from]));
    reference.assert_same(&Outcome::read(directory, name), &format!("restart from {from}"));
}
