//! The way to equilibrium: kinetic damping.
//!
//! While matter falls towards equilibrium its kinetic energy rises; where it has passed a peak, all velocities are set to 0, and the
//! next fall begins from rest closer to it (Cundall 1976). The step from rest shows the unbalanced force, with the reactions of loads,
//! colliders and faces: nodes then have the velocity `Δt f / m`. The energy is an exact sum over nodes, so the peaks do not depend on ranks.
use rayon::prelude::*;

use crate::exact_sum::ExactSum;
use crate::grid::mask::block_nodes;
use crate::particle::Chunk;
use crate::particle::chunk::Layout;
use crate::solver::state::Solver;
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Not collective. Kinetic energy and mass of the real nodes that this rank counts, for [`Solver::relax`], in jobs that ask for
    /// equilibrium.
    pub(in crate::solver) fn note_motion(&mut self) {
        if self.physics.equilibrium.is_none() {
            return;
        }
        let (fields, plan) = (&self.grid.fields, &self.grid.plan);
        let nodes = block_nodes(D);
        let blocks = fields.rows.par_chunks(nodes).zip(&plan.blocks).zip(&fields.active);
        let empty = || [ExactSum::new(), ExactSum::new()];
        self.motion = self.phases.time(Phase::Nodes, || {
            let sums = blocks.with_min_len(32).filter(|(_, active)| **active).fold(
                empty,
                |mut sums, ((rows, block), _)| {
                    let counted = block.real_nodes() & block.owned;
                    for (bit, row) in rows.iter().enumerate() {
                        let mass = row.0[3];
                        if counted >> bit & 1 == 1 && mass > 0.0 {
                            row.0[..D].iter().for_each(|v| sums[0].add(0.5 * mass * v * v));
                            sums[1].add(mass);
                        }
                    }
                    sums
                },
            );
            let merge = |mut all: [ExactSum; 2], part: [ExactSum; 2]| {
                all.iter_mut().zip(&part).for_each(|(all, part)| all.merge(part));
                all
            };
            sums.reduce(empty, merge)
        });
    }

    /// Collective. Sets velocities to 0 after a step in which the kinetic energy fell, in jobs that ask for equilibrium. True once
    /// that is reached.
    pub(in crate::solver) fn relax(&mut self, dt: f64) -> bool {
        let Some(asked) = self.physics.equilibrium else { return false };
        let (comm, motion) = (&self.comm, &mut self.motion);
        self.phases.time(Phase::Reduce, || ExactSum::sum_over_ranks(comm, motion));
        let [kinetic, mass] = self.motion.each_ref().map(ExactSum::to_f64);
        if self.relaxation.note(kinetic, mass, dt) {
            self.chunks.iter_mut().for_each(stop);
        }
        self.relaxation.is_settled(&asked)
    }
}

/// Sets all velocities and their gradients to 0.
pub(in crate::solver) fn stop<const D: usize>(chunk: &mut Chunk<D>) {
    let velocity = Layout::<D>::VELOCITY..Layout::<D>::VELOCITY + D;
    let affine = Layout::<D>::AFFINE..Layout::<D>::AFFINE + D * D;
    velocity.chain(affine).for_each(|column| chunk.column_mut(column).fill(0.0));
}
