//! Output and restart files.
//!
//! One HDF5 file per output: the group `/VTKHDF` opens in ParaView, the group `/state` holds a header
//! and, where asked for, all that a restart needs, bit by bit. A file is written under a temporary
//! name and gets its own when it is whole and on disk. Nothing in it depends on the number of ranks.
//!
//! | file or folder | content |
//! |---|---|
//! | this | files written and read |
//! | `view.rs`, `options.rs` | the run as a file shows it; optional contents |
//! | [`header`], `scalars.rs`, `place.rs` | the header of a file with its scalars, and the place of its job file |
//! | `content/` | particle fields, groups for viewers and restarts |
//! | `intact/` | checksums, limits, and the way to disk |
//! | [`outputs`], [`directory`] | the numbered files of a run; finding and keeping them |
//! | [`compare`] | digests and differences |
//! | `given.rs` | particles of a file as those of another job |

use std::path::Path;

use partition::comm::Comm;

use super::hdf5_file::{FileError, Reader, Writer};

pub mod compare;
pub mod content;
pub mod directory;
mod given;
pub mod header;
pub mod intact;
mod options;
pub mod outputs;
mod place;
mod scalars;
mod view;

pub use crate::saved::Scalars;
pub use content::fields::PointField;
pub use content::state::Restored;
use content::{state, vtkhdf};
pub use given::particles;
pub use header::Header;
pub use header::compatible;
use intact::checked::{Checked, Recorded, Rows};
use intact::commit::Unnamed;
pub use intact::sane::Limits;
pub use options::Options;
pub use outputs::Outputs;
pub use place::job_files;
pub use scalars::AXISYMMETRIC;
pub use view::{ShownWater, View};

/// Collective. Writes particles, and the state if `options` ask for it, to `path`. An error on any rank is
/// one on all ranks, and no file of that name is made or changed; a state with numbers that are not finite is
/// such an error.
pub fn write<const D: usize>(
    comm: &Comm,
    path: &Path,
    view: &View<D>,
    options: &Options,
) -> Result<(), FileError> {
    start_write(comm, path, view, options)?.finish(comm)
}

/// Collective. As [`write()`], but does not wait for the disk: the file gets its name when the caller
/// finishes what this returns.
pub fn start_write<const D: usize>(
    comm: &Comm,
    path: &Path,
    view: &View<D>,
    options: &Options,
) -> Result<Unnamed, FileError> {
    let finite =
        intact::sane::finite(view).map_err(|reason| FileError::Refused { path: path.into(), reason });
    comm.agree(finite)?;
    Unnamed::write(comm, path, |file| {
        let (leaves, particles) = totals(comm, file, view)?;
        Header::make_group(file)?;
        let mut recorded = Recorded::new(comm, file);
        state::write_job(&mut recorded, comm, view)?;
        state::write_maps(file, &mut recorded, comm, view)?;
        // The state first: data sets of it that ParaView can read get a second name there.
        if options.restart {
            state::write(file, &mut recorded, comm, view, leaves, particles)?;
        }
        vtkhdf::write_particles(file, &mut recorded, comm, view, particles, options)?;
        let header = Header::new(view, leaves.total, particles.total, options.restart);
        place::write(file, path, view.job_file)?;
        Header { checksums: recorded.checksums(), ..header }.write(file)
    })
}

/// Collective. Writes the leaves of the tree to `path`, as [`write()`] does the particles.
pub fn write_tree<const D: usize>(comm: &Comm, path: &Path, view: &View<D>) -> Result<(), FileError> {
    let written = Unnamed::write(comm, path, |file| {
        let (leaves, particles) = totals(comm, file, view)?;
        Header::make_group(file)?;
        let mut recorded = Recorded::new(comm, file);
        vtkhdf::write_leaves(file, &mut recorded, comm, view, leaves)?;
        let header = Header::new(view, leaves.total, particles.total, false);
        Header { checksums: recorded.checksums(), ..header }.write(file)
    });
    written?.finish(comm)
}

/// Collective. Reads a file for a restart on any number of ranks. Refuses, with the reason, a file that is
/// damaged, cut short, of another format or dimension, without the restart state, of another job, or with
/// particles that cannot be.
pub fn read<const D: usize>(
    comm: &Comm,
    path: &Path,
    job_digest: Option<u64>,
    limits: Limits,
) -> Result<Restored<D>, FileError> {
    let file = Reader::open(comm, path)?;
    let header = Header::read(&file)?;
    let reason = if !header.restart {
        Some("the file holds no restart state (output with `restart = false`, or a tree)".to_owned())
    } else if header.dimension != D {
        Some(format!("the file is from a {}D run, but the job is {D}D", header.dimension))
    } else if !compatible(&header.program) {
        let (theirs, ours) = (&header.program, env!("CARGO_PKG_VERSION"));
        Some(format!("written by agimp {theirs}, whose states this version ({ours}) cannot continue"))
    } else {
        job_digest.filter(|&ours| ours != header.job_digest).map(|ours| {
            format!(
                "the file belongs to another job: its digest is {:016x}, this job's is {ours:016x} \
                 (outputs and end time may differ, everything else must not)",
                header.job_digest
            )
        })
    };
    if let Some(reason) = reason {
        return Err(file.refuse(reason));
    }
    state::read(&file, comm, &header, limits)
}

/// Not collective. Text of the job file of the run that wrote a file with a restart state; `None` if it holds
/// none, or none that can be read.
pub fn job_text(path: &Path) -> Option<String> {
    let file = Reader::open_alone(path).ok()?;
    let header = Header::read(&file).ok()?;
    if !file.exists(state::JOB) {
        return None;
    }
    let bytes = file.stored(state::JOB).ok()?.rows;
    if bytes > LONGEST_JOB {
        return None;
    }
    let text = Checked::new(None, &file, &header).read_all::<u8>(state::JOB, bytes, 0).ok()?;
    String::from_utf8(text).ok()
}

/// Not collective. The values of a map in a file, if it has as many.
pub fn map_values(path: &Path, name: &str, what: &str, cells: usize) -> Option<Vec<f64>> {
    let file = Reader::open_alone(path).ok()?;
    let header = Header::read(&file).ok()?;
    let dataset = state::map(name, what);
    if !file.exists(&dataset) {
        return None;
    }
    Checked::new(None, &file, &header).read_all(&dataset, cells as u64, 0).ok()
}

/// Bytes of the longest job file that is read back.
const LONGEST_JOB: u64 = 1 << 26;

/// Collective. Places of this rank's leaves and particles; refuses a view that does not fit together.
fn totals<const D: usize>(comm: &Comm, file: &Writer, view: &View<D>) -> Result<(Rows, Rows), FileError> {
    let lengths = view.leaf_fields.iter().map(|(_, values)| values.len()).chain([view.chunks.len()]);
    let fits = lengths.into_iter().all(|length| length == view.leaves.len());
    file.agree(if fits {
        Ok(())
    } else {
        Err(file.refuse("leaves, particles and leaf fields do not match"))
    })?;
    let particles = view.chunks.iter().map(|chunk| chunk.len() as u64).sum();
    Ok((Rows::place(comm, view.leaves.len() as u64), Rows::place(comm, particles)))
}
