//! Parts of the solver's state, by what they are for.
use partition::comm::Traffic;

use super::bookings::{
    ExactSums, FACE_SUMS, FAILED_SUMS, LOAD_SUMS, Near, ParticlePush, SOURCE_SUMS, SourcePush,
};
use super::cost::Costs;
use super::last_partition::LastPartition;
use super::regrid_cache::RegridCache;
use super::regrid_timers::RegridTimers;
use super::relaxation::Relaxation;
use crate::adaptivity::resample::ledger::Ledger;
use crate::exact_sum::ExactSum;
use crate::material::SHOCK_SUMS;
use crate::probe::{Maxima, Tracked};
use crate::saved::Saved;
use crate::solver::migration::crossings::Crossings;
use crate::solver::physics::Physics;

/// Impulses, work and masses summed for the history, of this rank.
pub struct Sums {
    /// Impulse of each load since the last row of the history, and its work since the start.
    pub loads: ExactSums<LOAD_SUMS>,
    /// Impulse on each face of the domain since the last row, kg m/s: lower and upper along each axis; empty
    /// if the job does not ask for them.
    pub faces: ExactSums<FACE_SUMS>,
    /// Impulse of each contact between bodies since the last row of the history, and its work since the
    /// start.
    pub bodies: ExactSums<LOAD_SUMS>,
    /// Work of the shifts that keep fluids in their volume since the start, J; none without fluids.
    pub shifts: ExactSums<1>,
    /// Work of artificial viscosity since the start and the part of it that is heat of the material, J; none
    /// without.
    pub shocks: ExactSums<SHOCK_SUMS>,
    /// Mass, momentum and kinetic energy that sources have added since the start.
    pub sources: ExactSums<SOURCE_SUMS>,
    /// Particles that have failed and gone since the start, with what went with them; none where none can.
    pub failed: ExactSums<FAILED_SUMS>,
    /// Mass, momentum and energy of the water that has come into pores since the start; none where ground
    /// weighs the same with and without it.
    pub pores: ExactSums<SOURCE_SUMS>,
    /// Flow into the ground at each head that is held, and last through its surface, m³/s; none where no
    /// water seeps.
    pub flow: ExactSums<1>,
    /// How often heads have been looked for in vain since the start of this process.
    pub unsettled_heads: u64,
    /// Particles that each source has fed on this rank since the start of this process, and those among them
    /// that entered where other material was.
    pub fed: Vec<[u64; 2]>,
}

impl Sums {
    /// Zero sums for a problem, from a time (s) on.
    pub(in crate::solver) fn new<const D: usize>(physics: &Physics<D>, time: f64) -> Self {
        Self {
            loads: ExactSums::new(physics.loads.len(), time),
            faces: ExactSums::new(if physics.face_forces { 2 * D } else { 0 }, time),
            bodies: ExactSums::new(physics.body_contacts.names.len(), time),
            shifts: ExactSums::new(usize::from(physics.has_fluids()), time),
            shocks: ExactSums::new(usize::from(physics.viscosity.is_some()), time),
            sources: ExactSums::new(physics.sources.len(), time),
            failed: ExactSums::new(usize::from(physics.can_fail()), time),
            pores: ExactSums::new(usize::from(physics.followed.saturation), time),
            flow: ExactSums::new(physics.seepage.as_ref().map_or(0, |s| s.heads.len() + 1), time),
            unsettled_heads: 0,
            fed: vec![[0; 2]; physics.sources.len()],
        }
    }
}

impl Sums {
    /// Collective to a file. Those that begin with the process stay out.
    pub(in crate::solver) fn save(&mut self, saved: &mut Saved<'_>) {
        self.sources.save("source", saved);
        self.failed.save("failed", saved);
        self.pores.save("pore_water", saved);
        self.flow.save("flow", saved);
        self.loads.save("load", saved);
        self.bodies.save("contact", saved);
        self.shifts.save("shift", saved);
        // A job may ask for these later than the run that has written the file: then they begin here.
        saved.if_there(|saved| self.shocks.save("shock", saved));
        saved.if_there(|saved| self.faces.save("face", saved));
    }
}

/// Forces on particles themselves in the last step, by own leaf; each empty where there are none.
#[derive(Default)]
pub(in crate::solver) struct ParticleForces<const D: usize> {
    /// Impulse and work of sources on particles in their shapes.
    pub(in crate::solver) conveyed: Vec<Vec<SourcePush<D>>>,
    /// Forces of loads that particles carry.
    pub(in crate::solver) loads: Vec<Vec<ParticlePush<D>>>,
    /// Particles near colliders that act on particles.
    pub(in crate::solver) near: Vec<Vec<Near<D>>>,
}

/// The way to equilibrium, in jobs that ask for it.
#[derive(Default)]
pub struct EquilibriumState {
    /// How the last load step went.
    pub effort: Effort,
    /// Length of the next load step, s, unless something is due earlier.
    pub(in crate::solver) next_load_step: f64,
    /// Progress of kinetic damping.
    pub relaxation: Relaxation,
    /// Kinetic energy (J) and masses (kg) of the nodes of this rank in the last step, for kinetic damping.
    pub(in crate::solver) motion: [ExactSum; 3],
}

/// Measures that go on over the run.
#[derive(Default)]
pub struct Measured<const D: usize> {
    /// Particles that crossed the faces of the domain so far.
    pub crossings: Crossings,
    /// Particles that are followed.
    pub tracked: Vec<Tracked<D>>,
    /// Largest values of maps so far; the same on all ranks.
    pub maxima: Vec<Maxima>,
}

/// Changes of the tree, and of particles with it.
#[derive(Default)]
pub struct Adaptation<const D: usize> {
    /// Splits and merges of particles so far.
    pub ledger: Ledger,
    /// Changes of the tree since the start of this process.
    pub regrids: u64,
    /// Wall time of the parts of regrids since the start of this process.
    pub timers: RegridTimers,
    /// Data kept from one regrid to the next; no bit of the state depends on it.
    pub(in crate::solver) cache: RegridCache<D>,
    /// Whether boxes of any rank may have to be halved after this step.
    pub(in crate::solver) has_wide: bool,
    /// In how many pieces each body was when the first particle was halved; empty where that is not known.
    pub pieces_before: Vec<u64>,
}

/// Measured work and traffic, and what follows for the partition.
pub struct Balance {
    /// Messages and bytes that grids of earlier trees and partitions have sent.
    pub(in crate::solver) sent_before: Traffic,
    /// Least bytes that the exchanged nodes need, in the last step that measured the mass error.
    pub(in crate::solver) surface_bytes: u64,
    pub(in crate::solver) costs: Costs,
    pub(in crate::solver) partitioned: LastPartition,
    /// New partitions since the start of this process.
    pub partitions: u64,
    pub(in crate::solver) is_to_weigh: bool,
    pub(in crate::solver) weighed: Option<Weighed>,
}

/// How a load step went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effort {
    /// Newton iterations.
    pub newton: u32,
    /// Iterations of linear systems.
    pub linear: u32,
    /// Unbalanced force over that of loads or stress, whichever is greater.
    pub residual: f64,
    /// Attempts at the step that were given up.
    pub cuts: u32,
    /// Place of the node with the greatest unbalanced force of an attempt that failed, m from the lower
    /// corner of the domain.
    pub worst: [f64; 3],
}

/// Mass of the particles, and on the real nodes, in one step, on one rank.
#[derive(Clone, Debug)]
pub(in crate::solver) struct Weighed {
    pub(in crate::solver) particles: ExactSum,
    pub(in crate::solver) nodes: ExactSum,
}
