//! Output and restart files.
//!
//! One HDF5 file per output: the group `/VTKHDF` opens in ParaView, the group `/state` holds a header
//! and, where asked for, all that a restart needs, bit by bit. A file is written under a temporary
//! name and gets its own when it is whole and on disk. Nothing in it depends on the number of ranks.
//!
//! | file or folder | content |
//! |---|---|
//! | this | files written and read |
//! | [`header`], `place.rs` | the header of a file, and the place of its job file |
//! | `content/` | particle fields, groups for viewers and restarts |
//! | `intact/` | checksums, limits, and the way to disk |
//! | [`outputs`], [`directory`] | the numbered files of a run; finding and keeping them |
//! | [`compare`] | digests and differences |
//! | `given.rs` | particles of a file as those of another job |

use std::path::Path;

use partition::comm::Comm;
use partition::{Brick, Octant};

use super::hdf5_file::{FileError, Reader, Writer};
use crate::load::Water;
use crate::particle::chunk::Chunk;
use crate::particle::followed::Followed;
use crate::probe::{Map, Maxima};

pub mod compare;
pub(crate) mod content;
pub mod directory;
mod given;
pub mod header;
pub mod intact;
pub mod outputs;
mod place;

pub use content::fields::PointField;
use content::{state, vtkhdf};
pub use given::particles;
pub use header::{AXISYMMETRIC, Header, Scalars};
use intact::checked::{Checked, Recorded, Rows};
use intact::commit::Unnamed;
pub use intact::sane::Limits;
pub use outputs::Outputs;
pub use place::job_files;

/// The run as a file shows it: borrowed, this rank's part.
#[derive(Clone, Copy, Debug)]
pub struct View<'a, const D: usize> {
    /// Leaves of this rank, in curve order.
    pub leaves: &'a [Octant<D>],
    /// Particles of each leaf.
    pub chunks: &'a [Chunk<D>],
    /// Quantities that particles carry of their past.
    pub followed: Followed,
    /// Extra values per leaf; the same names on all ranks.
    pub leaf_fields: &'a [(String, Vec<f64>)],
    /// Rasters in plan.
    pub maps: &'a [Map],
    /// Their largest values so far, the same on all ranks.
    pub maxima: &'a [Maxima],
    /// Lower corner of the domain, m.
    pub origin: [f64; D],
    /// Edge of a root octant, m.
    pub root_edge: f64,
    /// Root octants.
    pub brick: Brick<D>,
    /// Names of the materials.
    pub materials: &'a [String],
    /// Stiffness of water that cannot leave the pores, by material, Pa; 0 where there is none.
    pub water_moduli: &'a [f64],
    /// Water in the pores, where it acts.
    pub water: Option<ShownWater<'a, D>>,
    /// Names of the bodies.
    pub bodies: &'a [String],
    /// Names of the history variables.
    pub histories: &'a [String],
    /// Digest of the job.
    pub job_digest: u64,
    /// Text of the job file.
    pub job_text: &'a str,
    /// The job file, from the root of the file system; empty if that is not known.
    pub job_file: &'a Path,
    /// Steps done.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Last time step, s.
    pub dt: f64,
    /// Scalars to be restored.
    pub scalars: &'a Scalars,
}

/// Water in the pores as a file shows it.
#[derive(Clone, Copy, Debug)]
pub struct ShownWater<'a, const D: usize> {
    /// The water.
    pub water: &'a Water,
    /// Time from which its own time is counted, s.
    pub since: f64,
    /// Gravity, m/s².
    pub gravity: [f64; D],
}

/// Optional contents of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Fields of the particles for ParaView.
    pub fields: Vec<PointField>,
    /// Those fields in single precision, but for those that the restart state holds already: that never is.
    pub single: bool,
    /// Also write all that a restart needs.
    pub restart: bool,
}

/// A run read back: this rank's share, to be partitioned anew by the caller.
#[derive(Clone, Debug)]
pub struct Restored<const D: usize> {
    /// Header of the file, with the scalars.
    pub header: Header,
    /// Leaves of this rank: a contiguous part of the curve.
    pub leaves: Vec<Octant<D>>,
    /// Particles of each leaf.
    pub chunks: Vec<Chunk<D>>,
    /// Extra values per leaf.
    pub leaf_fields: Vec<(String, Vec<f64>)>,
}

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

/// States are continued within one minor version below 1.0 and one major version from there on.
pub(crate) fn compatible(program: &str) -> bool {
    let series = |version: &str| -> Option<(u64, u64)> {
        let mut parts = version.split('.').map(|part| part.parse().ok());
        let (major, minor) = (parts.next()??, parts.next()??);
        Some(if major == 0 { (0, minor) } else { (major, 0) })
    };
    series(program).is_some() && series(program) == series(env!("CARGO_PKG_VERSION"))
}

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

#[cfg(test)]
mod tests {
    use super::compatible;

    #[test]
    fn states_of_the_same_series_are_continued() {
        assert!(compatible(env!("CARGO_PKG_VERSION")));
        assert!(!compatible("9999.0.0"));
        assert!(!compatible(""));
        assert!(!compatible("new"));
    }
}
