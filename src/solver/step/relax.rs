//! The way to equilibrium: kinetic damping.
//!
//! While material moves towards equilibrium its kinetic energy rises; after a peak all velocities are set to
//! 0, and motion starts again from rest, closer to equilibrium (Cundall 1976). The step from rest shows the
//! unbalanced force, with the reactions of loads, colliders and faces: nodes then have the velocity
//! `Δt f / 2 m`, since forces act over half the step. The energy is an exact sum over nodes, so the peaks do
//! not depend on ranks.
use rayon::prelude::*;

use crate::exact_sum::ExactSum;
use crate::grid::NodeFields;
use crate::grid::mask::block_nodes;
use crate::leapfrog::Lengths;
use crate::particle::Chunk;
use crate::particle::chunk::Layout;
use crate::solver::state::Solver;
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Not collective. Sums over the real nodes that this rank counts, for [`Solver::relax`], in jobs that
    /// relax to equilibrium: kinetic energy of the masses with which they move; masses of the material; and
    /// `½ s m v²` with mass scaling by s, so that after a step from rest, `v = Δt f / 2 m`, it is
    /// `⅛ Δt² f² s / m`, the force over the mass of the material.
    pub(in crate::solver) fn note_motion(&mut self) {
        if self.physics.equilibrium.is_none() {
            return;
        }
        let (grid, plan, physics) = (&self.grid, &self.grid.plan, &self.physics);
        let nodes = block_nodes(D);
        let empty = || [(); 3].map(|()| ExactSum::new());
        let merge = |mut all: [ExactSum; 3], part: [ExactSum; 3]| {
            all.iter_mut().zip(&part).for_each(|(all, part)| all.merge(part));
            all
        };
        self.equilibrium.motion = self.phases.time(Phase::Nodes, || {
            let of_field = |fields: &NodeFields<D>| {
                let blocks = fields.rows.par_chunks(nodes).zip(&plan.blocks).zip(&fields.active);
                let sums = blocks.with_min_len(32).filter(|(_, active)| **active).fold(
                    empty,
                    |mut sums, ((rows, block), _)| {
                        let counted = block.real_nodes() & block.owned;
                        let scale = physics.mass_scale(block.level);
                        for (bit, row) in rows.iter().enumerate() {
                            let mass = row.0[3];
                            if counted >> bit & 1 == 1 && mass > 0.0 {
                                row.0[..D].iter().for_each(|v| sums[0].add(0.5 * mass * v * v));
                                sums[1].add(mass / scale.unwrap_or(1.0));
                                if let Some(scale) = scale {
                                    row.0[..D].iter().for_each(|v| sums[2].add(0.5 * scale * mass * v * v));
                                }
                            }
                        }
                        sums
                    },
                );
                sums.reduce(empty, merge)
            };
            grid.all_fields().map(of_field).fold(empty(), merge)
        });
    }

    /// Not collective. Velocities have been set, so that they belong to the present time and no longer to one
    /// that is `lag` before, s: no force acts in between, and means over the history leave that out.
    pub(in crate::solver) fn skip_forces(&mut self, lag: f64) {
        self.contacts.sums.since += lag;
        self.sums.loads.since += lag;
        self.sums.faces.since += lag;
        self.sums.bodies.since += lag;
    }

    /// Collective. Sets velocities to 0 after a step in which the kinetic energy fell, in jobs that relax to
    /// equilibrium. True once that is reached.
    pub(in crate::solver) fn relax(&mut self, lengths: Lengths) -> bool {
        let Some(asked) = self.physics.equilibrium else { return false };
        let (comm, motion) = (&self.comm, &mut self.equilibrium.motion);
        self.phases.time(Phase::Reduce, || ExactSum::sum_over_ranks(comm, motion));
        let [kinetic, mass, scaled] = self.equilibrium.motion.each_ref().map(ExactSum::to_f64);
        let pulled = if self.physics.has_scaled_masses() { scaled } else { kinetic };
        let lag = self.lag();
        if self.equilibrium.relaxation.note([kinetic, pulled], mass, lengths.kick) {
            self.chunks.iter_mut().for_each(stop);
            self.skip_forces(lag);
        }
        self.equilibrium.relaxation.is_settled(&asked)
    }
}

/// Sets all velocities and their gradients to 0.
pub(in crate::solver) fn stop<const D: usize>(chunk: &mut Chunk<D>) {
    let velocity = Layout::<D>::VELOCITY..Layout::<D>::VELOCITY + D;
    let motion = velocity.chain(Layout::<D>::AFFINE..Layout::<D>::AFFINE + D * D);
    motion.for_each(|column| chunk.column_mut(column).fill(0.0));
}
