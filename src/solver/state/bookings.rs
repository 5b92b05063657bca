//! Impulse and work of colliders, faces and loads, summed since the last row of the history or since the
//! start.
use partition::comm::Comm;

use crate::boundary::ColliderState;
use crate::boundary::rigid::Features;
use crate::exact_sum::ExactSum;
use crate::saved::Saved;
use crate::solver::physics::Physics;

/// Components of an impulse and of an angular impulse.
pub const SUMS: usize = 6;

/// Force and torque that the material exerts on a collider.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reaction {
    /// Force, N; in plane strain per metre of thickness, and without a third component.
    pub force: [f64; 3],
    /// Torque about the reference point, N m; in plane strain only the third component.
    pub torque: [f64; 3],
}

/// Exact sums of some things on this rank, `N` for each, of which some go over the time since a row of the
/// history.
#[derive(Clone, Debug, Default)]
pub struct ExactSums<const N: usize> {
    /// Sums of each thing.
    pub of: Vec<[ExactSum; N]>,
    /// Time up to which forces had acted at the last row of the history, s.
    pub since: f64,
}

impl<const N: usize> ExactSums<N> {
    /// Zero sums of so many things.
    pub(in crate::solver) fn new(things: usize, time: f64) -> Self {
        Self { of: vec![std::array::from_fn(|_| ExactSum::new()); things], since: time }
    }

    /// Collective to a file. The sums of one kind of things (loads, colliders, …), numbered consecutively.
    pub(in crate::solver) fn save(&mut self, kind: &str, saved: &mut Saved<'_>) {
        if self.of.is_empty() {
            return;
        }
        saved.real(format!("{kind}_sums_since"), &mut self.since);
        let sums: Vec<&mut ExactSum> = self.of.iter_mut().flatten().collect();
        saved.sums(|i| format!("{kind}_sum_{i}"), sums.into_iter());
    }

    /// Collective. Totals over all ranks, exact before they are rounded once.
    pub fn totals(&self, comm: &Comm) -> Vec<[f64; N]> {
        let mut all: Vec<ExactSum> = self.of.iter().flatten().cloned().collect();
        ExactSum::sum_over_ranks(comm, &mut all);
        all.chunks_exact(N).map(|sums| std::array::from_fn(|i| sums[i].to_f64())).collect()
    }

    /// Mean rate of a sum since the last row, per second, at a time up to which forces have acted (s); 0 at
    /// that of the row.
    pub fn mean(&self, sum: f64, time: f64) -> f64 {
        let elapsed = time - self.since;
        if elapsed > 0.0 { sum / elapsed } else { 0.0 }
    }

    /// Not collective. Starts the first sums of each thing anew at a time up to which forces have acted, s.
    pub fn forget(&mut self, first: usize, time: f64) {
        self.of.iter_mut().for_each(|sums| sums[..first].fill_with(ExactSum::new));
        self.since = time;
    }
}

/// The colliders, and per collider impulse and angular impulse since the last row, from the nodes of this
/// rank.
#[derive(Clone, Debug)]
pub struct Contacts<const D: usize> {
    /// State of each collider; the same on all ranks.
    pub states: Vec<ColliderState<D>>,
    /// Points of each that may touch another; none if no free body feels others.
    pub features: Vec<Features<D>>,
    /// Impulse (kg m/s) and angular impulse (kg m²/s) on each since the last row of the history.
    pub sums: ExactSums<SUMS>,
}

impl<const D: usize> Contacts<D> {
    /// The colliders at a time, nothing summed.
    pub(in crate::solver) fn new(physics: &Physics<D>, time: f64) -> Self {
        Self {
            states: physics.colliders.iter().map(|collider| collider.state_at(time)).collect(),
            features: Features::of_all(&physics.colliders),
            sums: ExactSums::new(physics.colliders.len(), time),
        }
    }
}

/// Components of the impulse on a face.
pub const FACE_SUMS: usize = 3;

/// Sums of a load, and of a contact between bodies: three components of the impulse since the last row (kg
/// m/s), and the work since the start (J), of the nodes that this rank counts.
pub const LOAD_SUMS: usize = 4;

/// Sums of a source since the start: mass (kg), three components of momentum (kg m/s), kinetic energy (J).
pub const SOURCE_SUMS: usize = 5;

/// Sums over particles that have failed and gone since the start: number of those deleted and of those that
/// have become another material; mass (kg), three components of momentum (kg m/s) and kinetic energy (J) of
/// those deleted; elastic energy (J) that has gone with both; gravitational energy and plastic work (J) of
/// those deleted.
pub const FAILED_SUMS: usize = 10;

/// Impulse and work of a source on a particle in its shape in one step, which keep the velocity of the
/// particle.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct SourcePush<const D: usize> {
    /// Number of the source.
    pub source: u32,
    /// Impulse, kg m/s.
    pub impulse: [f64; D],
    /// Kinetic energy, J.
    pub work: f64,
}

/// A load's force on one particle in one step.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct ParticlePush<const D: usize> {
    /// Its index in its chunk.
    pub particle: u32,
    /// Index of the load.
    pub load: u32,
    /// The force, N.
    pub force: [f64; D],
    /// Its moment about the centre of the particle, N m: component i by the place along k.
    pub moment: [[f64; D]; D],
    /// Place of the particle, m; after G2P its displacement in the step, m.
    pub way: [f64; D],
    /// Work of the moment in the step, J.
    pub turn: f64,
}

/// Totals of a load that particles carry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CarriedTotals {
    /// Particles that carry any.
    pub particles: u64,
    /// Sum of the sizes of their areas, m² (in plane strain m); `None` for point forces.
    pub area: Option<f64>,
    /// Force, N; in plane strain per metre of thickness.
    pub force: [f64; 3],
}

/// Mean force and work of a load, or of a contact between bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceAndWork {
    /// Mean force on the material, or on the first side of a contact, since the last row of the history, N;
    /// in plane strain per metre of thickness.
    pub force: [f64; 3],
    /// Work on the material, or on both sides of a contact, since the start, J: impulse times the velocity
    /// with which the step moves the material, or one side along the other. Friction takes away, so its work
    /// is below 0.
    pub work: f64,
}

impl ExactSums<LOAD_SUMS> {
    /// Collective. Mean force and work of each thing at a time up to which forces have acted, s.
    pub(in crate::solver) fn force_and_work(&self, comm: &Comm, time: f64) -> Vec<ForceAndWork> {
        let mean = |impulse: f64| self.mean(impulse, time);
        let all = self.totals(comm).into_iter();
        all.map(|[x, y, z, work]| ForceAndWork { force: [x, y, z].map(mean), work }).collect()
    }
}

/// Impulse of a particle on a face of the domain that its way led to.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct Struck<const D: usize> {
    /// Number of the face: lower and upper along each axis.
    pub face: usize,
    /// The impulse, kg m/s.
    pub impulse: [f64; D],
}

/// A particle that may touch the surface of a collider in a step.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct Near<const D: usize> {
    /// Its index in its chunk.
    pub particle: u32,
    /// Number of the collider.
    pub collider: u32,
    /// Its place, m: before the step, then where the collider stopped it, if it did.
    pub place: [f64; D],
    /// Impulse that it gave to the collider there, kg m/s.
    pub impulse: [f64; D],
}

impl<const D: usize> Near<D> {
    /// A particle of a chunk at a place (m), ahead of the step.
    pub(in crate::solver) fn new(collider: usize, particle: u32, place: [f64; D]) -> Self {
        Self { particle, collider: collider as u32, place, impulse: [0.0; D] }
    }
}
