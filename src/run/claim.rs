//! A run's claim on its directory: one run at a time, and no results destroyed without the user's consent.
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read as _, Seek as _, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use partition::comm::{Comm, host};

use super::RunError;
use super::restart::differing_keys;
use crate::io::hdf5_file::FileError;
use crate::io::log::progress::warn;
use crate::io::snapshot::directory::{AtStake, at_stake};
use crate::job::Problem;

/// How long a run waits for one that is ending: ranks that were killed need a moment.
const PATIENCE: Duration = Duration::from_secs(3);

/// The lock of a run, `JOB.lock` in its directory. Rank 0 holds it; other ranks have an empty one. It ends
/// with the process, however that ends, so that a file left by a crash blocks no run.
#[derive(Debug, Default)]
pub(super) struct Claim(Option<Held>);

/// A lock file that this process holds until it drops this.
#[derive(Debug)]
pub struct Held {
    file: File,
    path: PathBuf,
}

/// Why the lock was not taken.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// Another one has it.
    #[error("{}: found another {what} that writes here ({holder}); wait until it ends, or stop it", path.display())]
    Taken {
        /// The file of the lock.
        path: PathBuf,
        /// Kind of its holder.
        what: &'static str,
        /// Its process, as far as it is known.
        holder: String,
    },
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
}

impl Claim {
    /// Collective. Takes the lock unless this run has it already. Where the directory is not there yet,
    /// nothing is made, and there is nothing to lock.
    ///
    /// # Errors
    /// Another run has the lock, its file cannot be written, or some rank does not see it; the same on all
    /// ranks.
    pub(super) fn take<const D: usize>(&mut self, comm: &Comm, problem: &Problem<D>) -> Result<(), RunError> {
        let directory = &problem.output.directory;
        let path = directory.join(format!("{}.lock", problem.name));
        let mut is_taken = false;
        let mut taken = Ok(None);
        if comm.rank() == 0 && self.0.is_none() && directory.is_dir() {
            taken = lock(&path, "run").map(Some);
            is_taken = matches!(taken, Err(Refusal::Taken { .. }));
        }
        let is_taken = comm.any(is_taken);
        match comm.agree(taken) {
            Ok(held) => {
                let is_new = comm.any(held.is_some());
                self.0 = self.0.take().or(held);
                if is_new { expect_shared(comm, directory, &path) } else { Ok(()) }
            }
            Err(disagreement) if is_taken => Err(RunError::Refused(disagreement.message)),
            Err(disagreement) => Err(disagreement.into()),
        }
    }
}

/// Collective. Refuses a directory in which some rank does not see the lock that rank 0 has taken: one that
/// is not on a file system of all hosts.
fn expect_shared(comm: &Comm, directory: &Path, lock: &Path) -> Result<(), RunError> {
    let started = Instant::now();
    let mut is_seen = lock.exists();
    // A file system may take a moment to show to one host what another has made.
    while !is_seen && started.elapsed() < PATIENCE {
        std::thread::sleep(PATIENCE / 30);
        is_seen = lock.exists();
    }
    let unseen = || {
        format!(
            "{}: host {} does not see this directory as rank 0 does; expected an output.directory on a file system that all hosts share",
            directory.display(),
            host()
        )
    };
    let seen = comm.agree(if is_seen { Ok(()) } else { Err(unseen()) });
    seen.map_err(|disagreement| RunError::Refused(disagreement.message))
}

impl Drop for Held {
    fn drop(&mut self) {
        // Removed while it is locked, so that no other run has taken it. It may be gone with its directory;
        // then nothing is left to do.
        if is_at(&self.file, &self.path) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Not collective. Locks the file for a run or a sweep (`what`) and writes the owner into it.
///
/// # Errors
/// Another one has it, or the file cannot be written.
pub fn lock(path: &Path, what: &'static str) -> Result<Held, Refusal> {
    let failed = |action| move |source| FileError::System { path: path.into(), action, source };
    let started = Instant::now();
    loop {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false).custom_flags(libc::O_NOFOLLOW);
        let mut file = options.open(path).map_err(failed("create"))?;
        match file.try_lock() {
            // The run that had it may have removed it meanwhile; then another may lock the next file of that
            // name.
            Ok(()) if !is_at(&file, path) => continue,
            Ok(()) => {}
            Err(TryLockError::WouldBlock) if started.elapsed() < PATIENCE => {
                std::thread::sleep(PATIENCE / 30);
                continue;
            }
            Err(TryLockError::WouldBlock) => {
                let mut holder = String::new();
                // Bytes that cannot be read are left out.
                let _ = file.take(200).read_to_string(&mut holder);
                let holder = holder.trim().escape_debug().to_string();
                return Err(Refusal::Taken { path: path.into(), what, holder });
            }
            // Some file systems of clusters have no locks.
            Err(TryLockError::Error(error)) if cannot_lock(&error) => warn(&format!(
                "{}: cannot be locked ({error}); make sure that no other run writes here",
                path.display()
            )),
            Err(TryLockError::Error(error)) => return Err(failed("lock")(error).into()),
        }
        let holder = format!("process {} on host {}\n", std::process::id(), host());
        let written = file.set_len(0).and_then(|()| file.rewind());
        written.and_then(|()| file.write_all(holder.as_bytes())).map_err(failed("write"))?;
        return Ok(Held { file, path: path.into() });
    }
}

/// Who holds a lock file, if a process does now. A file that a crash has left is held by nobody.
pub fn holder(path: &Path) -> Option<String> {
    let file = OpenOptions::new().read(true).custom_flags(libc::O_NOFOLLOW).open(path).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => {
            let mut holder = String::new();
            // Bytes that cannot be read are left out.
            let _ = file.take(200).read_to_string(&mut holder);
            Some(holder.trim().escape_debug().to_string())
        }
        _ => None,
    }
}

fn cannot_lock(error: &std::io::Error) -> bool {
    error.kind() == ErrorKind::Unsupported
        || matches!(error.raw_os_error(), Some(libc::ENOSYS | libc::ENOLCK | libc::EOPNOTSUPP))
}

/// Whether the open file is the one of that name.
fn is_at(file: &File, path: &Path) -> bool {
    let same = |a: std::fs::Metadata, b: std::fs::Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    file.metadata().is_ok_and(|a| path.symlink_metadata().is_ok_and(|b| same(a, b)))
}

/// Collective. Refuses to start anew where that would destroy results which took long to get.
///
/// # Errors
/// The directory holds checkpoints of this name, or outputs of another job; the same on all ranks.
pub(super) fn spare_results<const D: usize>(comm: &Comm, problem: &Problem<D>) -> Result<(), RunError> {
    let directory = &problem.output.directory;
    let found = match comm.rank() {
        0 if directory.is_dir() => at_stake(directory, &problem.name, problem.digest),
        _ => Ok(None),
    };
    let refusal = match comm.agree(found)? {
        None => Ok(()),
        Some(AtStake::Checkpoint(path)) => Err(format!(
            "{}: found a checkpoint of an earlier run; continue it with --restart latest, or start again and replace its results with --overwrite",
            path.display()
        )),
        Some(AtStake::OtherJob(path)) => Err(format!(
            "{}: found a result of another job: {}; choose another output.directory, or replace its results with --overwrite",
            path.display(),
            differing_keys(problem, &path).unwrap_or_else(|| "keys that affect the state differ".into())
        )),
    };
    comm.agree(refusal).map_err(|disagreement| RunError::Refused(disagreement.message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holder_at_a_time() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.lock");
        // As a process that was killed leaves it.
        std::fs::write(&path, "process 1 on host gone, with a long name of its own\n").unwrap();
        let held = lock(&path, "run").unwrap();
        let told = std::fs::read_to_string(&path).unwrap();
        assert!(told.starts_with(&format!("process {} on host ", std::process::id())), "{told}");
        let refusal = lock(&path, "run").unwrap_err().to_string();
        assert!(refusal.contains("another run that writes here (process "), "{refusal}");
        assert!(holder(&path).is_some_and(|who| who.starts_with("process ")));
        drop(held);
        assert_eq!(holder(&path), None);
        assert!(!path.exists());
        drop(lock(&path, "run").unwrap());
    }

    #[test]
    fn the_lock_of_another_directory_stays() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.lock");
        let held = lock(&path, "run").unwrap();
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, "of somebody else").unwrap();
        drop(held);
        assert!(path.exists());
    }
}
