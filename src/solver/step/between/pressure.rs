//! Pressure of contact, as particles carry it.
use rayon::prelude::*;

use super::press::NormalForce;
use crate::grid::GridPlan;
use crate::kernel::{Row, Scheme};
use crate::solver::state::Solver;
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::state::grid::{Grid, Solids};
use crate::solver::state::phases::{Phase, Phases};
use crate::solver::step::transfer::g2p::interpolate;

/// Weight of the last step in the mean that particles carry.
const LAST: f64 = 0.05;

impl<const D: usize> Solver<D> {
    /// Not collective. Reduces the mean of the pressure by one step, before the step adds its share.
    pub(super) fn fade_pressures(&mut self) {
        let Some(column) = self.physics.followed_columns().contact_pressure else { return };
        let chunks = self.chunks.par_iter_mut().with_min_len(64);
        let carrying = chunks.filter(|chunk| chunk.carried_columns() > column);
        carrying.for_each(|chunk| chunk.carried_mut(column).iter_mut().for_each(|mean| *mean *= 1.0 - LAST));
    }

    /// Not collective. Gives particles near nodes where bodies meet the pressure `Σ w F / Σ w A` of the
    /// normal forces F on areas A there.
    pub(super) fn carry_pressures(&mut self, forces: &[NormalForce]) {
        let Some(column) = self.physics.followed_columns().contact_pressure else { return };
        let (carried, scheme) = (self.physics.carried_columns(), self.physics.scheme());
        let Grid { plan, solids, .. } = &mut self.grid;
        for (field, solids) in solids.iter_mut().enumerate() {
            let forces = forces.iter().filter(|at| at.field == field);
            let at_nodes = at_particles(plan, solids, forces, &scheme, &mut self.phases);
            let leaves = self.chunks.par_iter_mut().zip(&solids.members).zip(at_nodes);
            self.phases.time(Phase::Gather, || {
                leaves.filter(|((_, members), _)| !members.is_empty()).for_each(
                    |((chunk, members), sums)| {
                        chunk.carry(carried);
                        let means = chunk.carried_mut(column);
                        for (&p, [force, area]) in members.iter().zip(sums) {
                            if area > 0.0 {
                                means[p as usize] += LAST * force / area;
                            }
                        }
                    },
                );
            });
        }
    }
}

/// `Σ w F` and `Σ w A` over these nodes at the copies of particles, leaf by leaf. The sums at the nodes stay:
/// faces and colliders read them next.
fn at_particles<'a, const D: usize>(
    plan: &GridPlan<D>,
    solids: &mut Solids<D>,
    forces: impl Iterator<Item = &'a NormalForce>,
    scheme: &Scheme<'_>,
    phases: &mut Phases,
) -> Vec<Vec<[f64; 2]>> {
    let Solids { copies, field: VelocityField { nodes, arenas, lists, .. }, .. } = solids;
    let mut rows = vec![Row::default(); nodes.rows.len()];
    for at in forces {
        rows[at.node] = Row([at.force, at.area, 0.0, 0.0]);
    }
    phases.time(Phase::Nodes, || nodes.prolong_rows(plan, arenas, &mut rows));
    let sums = phases.time(Phase::Gather, || interpolate(plan, (lists, &rows), copies, scheme));
    sums.into_iter().map(|leaf| leaf.into_iter().map(|sums| [sums[0], sums[1]]).collect()).collect()
}
