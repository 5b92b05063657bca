//! Contact between bodies that deform, where their velocity fields meet.
//!
//! Where two fields have mass at a real node, the node's law ([`crate::boundary::bodies`]) gives each the
//! opposite of the impulse of the other. Momentum and angular momentum stay as they are to round-off, since
//! both act at one place. Each field is prolonged by itself. Where their surfaces are says
//! `step/surfaces.rs`.
//!
//! | file | what it holds |
//! |---|---|
//! | `geometry` | the nodes where bodies meet, and the volumes of their basis functions |
//! | `normals` | normals between bodies, smoothed over cells |
//! | `press` | impulses at these nodes |
//! | `pressure` | the pressure there, as particles carry it |
mod geometry;
mod normals;
mod press;
mod pressure;

use crate::boundary::bodies::PairLaw;
use crate::leapfrog::Lengths;
use crate::solver::state::Solver;
use crate::solver::state::bookings::ForceAndWork;
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Collective. The real nodes at which bodies press on each other in a step, block by block; nothing
    /// where there is none, and between two steps.
    pub(super) fn meeting_nodes(&mut self, is_step: bool) -> Vec<u64> {
        // What particles have between two steps needs no holding apart.
        if self.grid.fields.len() == 1 || !is_step {
            return Vec::new();
        }
        self.fade_pressures();
        let meets = self.phases.time(Phase::Nodes, || self.grid.nodes_where_fields_meet());
        let is_any = meets.iter().any(|&nodes| nodes != 0);
        match self.phases.time(Phase::Reduce, || self.comm.any(is_any)) {
            true => meets,
            false => Vec::new(),
        }
    }

    /// Whether any law between bodies asks for the places of their surfaces.
    pub(super) fn has_surfaces_between(&self) -> bool {
        !self.physics.body_contacts.pairs.iter().all(|pair| pair.law == PairLaw::Sticky)
    }

    /// Collective over neighbours. Gives the nodes where bodies meet the impulses of their contact in a step
    /// of these lengths. With `found`: the places of surfaces are known there.
    pub(super) fn press_bodies(&mut self, meets: &[u64], found: bool, lengths: Lengths) {
        if meets.is_empty() {
            return;
        }
        let smoothed = self.has_surfaces_between().then(|| {
            self.find_hats();
            self.smooth_gradients(meets)
        });
        let forces = self.press(meets, smoothed.as_ref(), lengths);
        if found {
            self.carry_pressures(&forces);
        }
    }

    /// Collective. Mean force of each contact of the job on its first side since the last row of the history,
    /// and its work since the start.
    pub fn body_totals(&self) -> Vec<ForceAndWork> {
        self.sums.bodies.force_and_work(&self.comm, self.time_of_velocities())
    }
}
