//! Runs on several ranks, and from one of their checkpoints, that must give the same. The test has the module
//! `launch`.
use std::path::Path;

use super::history::History;
use super::launch::{Outcome, contents, job, run, succeed, text};

/// Runs a job of that name on 1, 2 and 3 ranks and goes on from its second checkpoint: the results are the
/// same. `look` gets the directory and the output of each run.
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
            let from = &checkpoints(directory.path(), name)[1];
            assert_restart_gives(reference, directory.path(), &path, name, from);
        }
    }
}

/// Runs a job of `tests/jobs/runs` on 1, 2 and 3 ranks and with 2 threads, and goes on from the checkpoint in
/// the middle of it: the results are the same. `look` gets the history of the first run.
pub(crate) fn assert_same_in_all_ways(name: &str, look: impl FnOnce(&History)) {
    let (mut reference, mut look): (Option<Outcome>, _) = (None, Some(look));
    for (ranks, threads) in [(1, 1), (1, 2), (2, 1), (3, 1)] {
        let directory = tempfile::tempdir().expect("temporary directory");
        succeed(&mut run(directory.path(), ranks, threads, &job(name), &["--quiet"]));
        let result = Outcome::read(directory.path(), name);
        if let Some(look) = look.take() {
            look(&History::read(directory.path(), name));
            assert_middle_gives(&result, directory.path(), &job(name), name);
        }
        let reference = reference.get_or_insert(result.clone());
        reference.assert_same(&result, &format!("{ranks} ranks x {threads} threads"));
    }
}

/// Goes on from the checkpoint in the middle of a run that has left more than three, on three ranks: what is
/// left is that of the run before.
pub(crate) fn assert_middle_gives(whole: &Outcome, directory: &Path, job: &Path, name: &str) {
    let checkpoints = checkpoints(directory, name);
    assert!(checkpoints.len() > 3, "{checkpoints:?}");
    assert_restart_gives(whole, directory, job, name, &checkpoints[checkpoints.len() / 2]);
}

/// Names of the checkpoints that a run has left, in their order.
fn checkpoints(directory: &Path, name: &str) -> Vec<String> {
    let files = contents(&directory.join("out").join(name)).into_keys();
    files.filter(|file| file.contains("checkpoint") && file.ends_with("hdf")).collect()
}

/// Goes on from a checkpoint in a directory, on three ranks: what is left is that of the run before.
fn assert_restart_gives(reference: &Outcome, directory: &Path, job: &Path, name: &str, from: &str) {
    let from = format!("out/{name}/{from}");
    succeed(&mut run(directory, 3, 1, job, &["--quiet", "--restart", &from]));
    reference.assert_same(&Outcome::read(directory, name), &format!("restart from {from}"));
}
