//! Pressure of contact, as particles carry it.
use rayon::prelude::*;

use super::press::NormalForce;
use crate::kernel::Row;
use crate::solver::state::Solver;
use crate::solver::state::grid::Solids;
use crate::solver::state::phases::Phase;

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
        let mut all = std::mem::take(&mut self.grid.solids);
        for (field, solids) in all.iter_mut().enumerate() {
            let at_nodes = self.at_particles(solids, forces.iter().filter(|at| at.field == field));
            let carried = self.physics.carried_columns();
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
        self.grid.solids = all;
    }

    /// `Σ w F` and `Σ w A` over these nodes at the copies of particles, leaf by leaf. The sums at the
    /// nodes stay: faces and colliders read them next.
    fn at_particles<'a>(
        &mut self,
        solids: &mut Solids<D>,
        forces: impl Iterator<Item = &'a NormalForce>,
    ) -> Vec<Vec<[f64; 2]>> {
        self.grid.swap(&mut solids.field);
        std::mem::swap(&mut self.chunks, &mut solids.copies);
        let kept = self.grid.fields.rows.to_vec();
        self.grid.fields.rows.fill(Row::default());
        for at in forces {
            self.grid.fields.rows[at.node] = Row([at.force, at.area, 0.0, 0.0]);
        }
        self.prolong();
        let sums = self.interpolate();
        self.grid.fields.rows.copy_from_slice(&kept);
        std::mem::swap(&mut self.chunks, &mut solids.copies);
        self.grid.swap(&mut solids.field);
        sums.into_iter().map(|leaf| leaf.into_iter().map(|sums| [sums[0], sums[1]]).collect()).collect()
    }
}
