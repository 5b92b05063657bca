//! One command on many ranks: the same command line, and the job that rank 0 has read.
//!
//! Each rank is a process of its own: it may have been started with other arguments, and it may see another
//! text of the job, when the file is edited while a batch system starts the ranks or when a network file
//! system holds an old copy. Ranks that ran different jobs would wait for each other for ever, or compute a
//! job that nobody has requested.
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt as _;
use std::path::Path;

use partition::comm::Comm;

use super::message::together;
use crate::Failure;
use agimp::job::{self, AnyProblem, Settings};

/// Collective. Refuses ranks whose command differs from that of rank 0. `words` are the words of the command
/// that decide its results.
pub(crate) fn same_command(comm: &Comm, words: &[&OsStr]) -> Result<(), Failure> {
    // Ranks whose command line cannot be used at all report it here.
    together(comm, Ok(()))?;
    let own = words.join(OsStr::new(" "));
    let mut first = own.as_bytes().to_vec();
    comm.broadcast_bytes(0, &mut first);
    let same = if own.as_bytes() == first { Ok(()) } else { Err(differs(comm.rank(), &own, &first)) };
    together(comm, same)
}

fn differs(rank: usize, own: &OsStr, first: &[u8]) -> Failure {
    Failure::Usage(format!(
        "rank {rank} was started with `{}`, rank 0 with `{}`; expected the same on all ranks",
        own.display(),
        OsStr::from_bytes(first).display()
    ))
}

/// Collective. The job as rank 0 reads it, on all ranks, with the settings that all ranks have.
pub(crate) fn load(comm: &Comm, path: &Path, settings: &Settings) -> Result<AnyProblem, Failure> {
    let read = if comm.rank() == 0 { job::read(path) } else { Ok(Vec::new()) };
    let mut bytes = together(comm, read.map_err(Failure::from))?;
    comm.broadcast_bytes(0, &mut bytes);
    let problem = together(comm, job::from_bytes(bytes, path, settings).map_err(Failure::from))?;
    // Each rank has read the files that the job names.
    let own = problem.digest().to_ne_bytes();
    let mut first = own.to_vec();
    comm.broadcast_bytes(0, &mut first);
    let same = own == *first;
    let reason = || {
        format!(
            "rank {} has read files (meshes, records) that differ from those of rank 0; expected the same on all ranks",
            comm.rank()
        )
    };
    together(comm, if same { Ok(problem) } else { Err(Failure::Usage(reason())) })
}
