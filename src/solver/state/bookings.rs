//! What is booked of colliders and loads on the way.
use partition::comm::Comm;

use crate::boundary::ColliderState;
use crate::exact_sum::ExactSum;
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

/// States of the colliders and what has been summed up of their reactions.
#[derive(Clone, Debug)]
pub struct Contacts<const D: usize> {
    /// State of each collider; the same on all ranks.
    pub states: Vec<ColliderState<D>>,
    /// Per collider, impulse and angular impulse from the nodes of this rank since [`Contacts::since`].
    pub sums: Vec<[ExactSum; SUMS]>,
    /// Time of the last row of the history, s.
    pub since: f64,
}

impl<const D: usize> Contacts<D> {
    /// The colliders at a time, nothing summed.
    pub(in crate::solver) fn new(physics: &Physics<D>, time: f64) -> Self {
        Self {
            states: physics.colliders.iter().map(|collider| collider.state_at(time)).collect(),
            sums: vec![std::array::from_fn(|_| ExactSum::new()); physics.colliders.len()],
            since: time,
        }
    }
}

/// Sums of a load: three components of the impulse, and the work.
pub const LOAD_SUMS: usize = 4;

/// What is booked of the loads of a run on this rank.
#[derive(Clone, Debug, Default)]
pub struct LoadBooks {
    /// Per load, impulse since [`LoadBooks::since`] (kg m/s) and work since the start (J), of the nodes that this rank counts.
    pub sums: Vec<[ExactSum; LOAD_SUMS]>,
    /// Time of the last row of the history, s.
    pub since: f64,
}

impl LoadBooks {
    /// Nothing booked.
    pub(in crate::solver) fn new(loads: usize, time: f64) -> Self {
        Self { sums: vec![std::array::from_fn(|_| ExactSum::new()); loads], since: time }
    }

    /// Collective. Mean force since the last row (N) and work since the start (J) of each load.
    pub fn totals(&self, comm: &Comm, time: f64) -> Vec<LoadTotals> {
        if self.sums.is_empty() {
            return Vec::new();
        }
        let mut flat: Vec<ExactSum> = self.sums.iter().flatten().cloned().collect();
        ExactSum::sum_over_ranks(comm, &mut flat);
        let elapsed = time - self.since;
        let mean = |impulse: &ExactSum| if elapsed > 0.0 { impulse.to_f64() / elapsed } else { 0.0 };
        flat.chunks_exact(LOAD_SUMS)
            .map(|sums| LoadTotals { force: std::array::from_fn(|a| mean(&sums[a])), work: sums[3].to_f64() })
            .collect()
    }

    /// Not collective. Starts the mean forces anew at a time, s.
    pub fn forget_forces(&mut self, time: f64) {
        self.sums.iter_mut().for_each(|sums| sums[..3].fill_with(ExactSum::new));
        self.since = time;
    }
}

/// Mean force and work of a load.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadTotals {
    /// Mean force on the material since the last row of the history, N; in plane strain per metre of thickness.
    pub force: [f64; 3],
    /// Work on the material since the start, J: impulse times the velocity with which the step moves the material.
    pub work: f64,
}
