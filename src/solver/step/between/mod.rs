//! Contact between bodies that deform, where their velocity fields meet.
//!
//! Where two fields have mass at a real node, the node's law ([`crate::boundary::bodies`]) gives each the opposite of the impulse of the
//! other. Momentum and angular momentum stay as they are to round-off, since both act at one place. Each field is prolonged by itself.
//! Particles near such nodes scatter their volumes and the gradients of these, which take the way of masses through bins, sums over ranks and
//! constrained nodes; the rest of the grid pays nothing.
//!
//! | file | what it holds |
//! |---|---|
//! | `geometry` | shares of volume and their gradients at the nodes where bodies meet |
//! | `press` | impulses at these nodes |
//! | `pressure` | the pressure there, as particles carry it |
mod geometry;
mod press;
mod pressure;

use crate::boundary::bodies::PairLaw;
use crate::solver::sorting::bins::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::bookings::ForceAndWork;
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Collective. Gives the nodes where bodies meet the impulses of their contact over `dt`, s.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan, on the rank that has it.
    pub(super) fn press_bodies(&mut self, dt: f64) -> Result<(), BinMissing> {
        // What particles have between two steps needs no holding apart.
        if self.grid.others.is_empty() || dt <= 0.0 {
            return Ok(());
        }
        self.fade_pressures();
        let meets = self.phases.time(Phase::Nodes, || self.grid.nodes_where_fields_meet());
        let is_any = meets.iter().any(|&nodes| nodes != 0);
        if !self.phases.time(Phase::Reduce, || self.comm.any(is_any)) {
            return Ok(());
        }
        let sorted = match self.physics.body_contacts.pairs.iter().all(|pair| pair.law == PairLaw::Sticky) {
            true => Ok(()),
            false => self.find_geometry(&meets),
        };
        let forces = self.press(&meets, dt);
        if sorted.is_ok() {
            self.carry_pressures(&forces);
        }
        sorted
    }

    /// Collective. Mean force of each contact of the job on its first side since the last row of the history,
    /// and its work since the start.
    pub fn body_totals(&self) -> Vec<ForceAndWork> {
        self.body_sums.force_and_work(&self.comm, self.clock.time)
    }
}
