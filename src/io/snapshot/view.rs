//! The run as a file shows it.
use std::path::Path;

use partition::{Brick, Octant};

use crate::load::Water;
use crate::particle::chunk::Chunk;
use crate::particle::followed::Followed;
use crate::probe::{Map, Maxima};
use crate::saved::Scalars;

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
