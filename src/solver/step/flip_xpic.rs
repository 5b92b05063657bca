//! Velocities of the nodes before the impulse of stress, for transfers whose particles take increments.
//!
//! P2G adds momentum and the impulse of stress in one pass. FLIP needs the velocities without the latter as
//! well, and XPIC filters them: with S from nodes to particles and S⁺ back, the particles of XPIC(m) take on
//! (Hammerquist & Nairn 2017)
//! ```text
//! S (Δv + Σ_{k<m} v_k),  v_0 = S⁺ V,  v_k = (1 - S⁺ S) v_{k-1}
//! ```
//! where V are their velocities before and Δv the change on the nodes. Each v_k is one more sweep of P2G with
//! one more exchange, so FLIP needs one and XPIC(m) needs m beside the usual one; APIC and TPIC need none.
use rayon::prelude::*;

use super::node_update::{Faces, apply_faces, update_velocity};
use crate::kernel::{Row, Transfer};
use crate::particle::Chunk;
use crate::particle::chunk::Layout;
use crate::solver::state::Solver;
use crate::solver::state::phases::Phase;

/// `to -= from`.
fn subtract(to: &mut [Row], from: &[Row]) {
    to.par_iter_mut().zip(from).with_min_len(4096).for_each(|(to, from)| {
        for lane in 0..3 {
            to.0[lane] -= from.0[lane];
        }
    });
}

impl<const D: usize> Solver<D> {
    /// Before P2G: velocities of the nodes without the impulse of stress, for transfers and for loads that
    /// need them.
    pub(in crate::solver) fn note_velocities(&mut self) {
        let time = self.clock.time;
        let absorbs = self.physics.absorbing.as_flattened().iter().any(Option::is_some);
        let damps = self.physics.loads.iter().any(|load| load.needs_start() && load.is_active(time));
        let is_needed = absorbs || damps;
        if is_needed {
            self.scatter_velocities();
            self.grid.increments.start.clone_from(&self.grid.fields.rows);
        }
        let sweeps = match self.physics.transfer {
            Transfer::Apic | Transfer::Tpic => return,
            Transfer::Flip { .. } => 0,
            Transfer::Xpic { order } => order.max(1) - 1,
        };
        let mut base = std::mem::take(&mut self.grid.increments.base);
        if self.physics.transfer == (Transfer::Xpic { order: 1 }) {
            base.resize(self.grid.fields.rows.len());
            base.fill(Row::default());
        } else {
            if !is_needed {
                self.scatter_velocities();
            }
            base.clone_from(&self.grid.fields.rows);
        }
        if sweeps > 0 {
            let mut rest = base.clone();
            base.fill(Row::default());
            for _ in 0..sweeps {
                self.grid.fields.rows.copy_from_slice(&rest);
                self.prolong();
                let mut other = self.interpolate();
                self.swap_velocities(&mut other);
                self.scatter_velocities();
                self.swap_velocities(&mut other);
                subtract(&mut rest, &self.grid.fields.rows);
                subtract(&mut base, &rest);
            }
        }
        self.grid.increments.base = base;
    }

    /// After the update: what the nodes give to particles, prolonged like velocities.
    pub(in crate::solver) fn form_increments(&mut self, field: usize) {
        if !self.physics.transfer.has_increments() {
            return;
        }
        let grid = &mut self.grid;
        grid.increments.rows.clone_from(&grid.fields.rows);
        subtract(&mut grid.increments.rows, &grid.increments.base);
        std::mem::swap(&mut grid.fields.rows, &mut grid.increments.rows);
        if matches!(self.physics.transfer, Transfer::Xpic { .. }) {
            // These are velocities, which the filter may have turned towards a wall.
            let gaps = self.physics.gaps(&grid.walls, &grid.solids, field);
            let faces = Faces::without_absorption(&self.physics.faces, gaps);
            apply_faces(&mut grid.fields, &grid.plan, &faces, |_, _, _| ());
        }
        self.prolong();
        let grid = &mut self.grid;
        std::mem::swap(&mut grid.fields.rows, &mut grid.increments.rows);
    }

    /// S⁺: velocities of the nodes from those of the particles alone.
    fn scatter_velocities(&mut self) {
        self.field_from_particles(0.0);
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || update_velocity(&mut grid.fields, &grid.plan, [0.0; D], 0.0));
    }

    /// Exchanges the velocities of all particles with those given, leaf by leaf.
    fn swap_velocities(&mut self, other: &mut [Vec<[f64; D]>]) {
        let swap = |(chunk, other): (&mut Chunk<D>, &mut Vec<[f64; D]>)| {
            for axis in 0..D {
                let column = chunk.column_mut(Layout::<D>::VELOCITY + axis);
                column.into_iter().zip(other.iter_mut()).for_each(|(v, o)| std::mem::swap(v, &mut o[axis]));
            }
        };
        self.chunks.par_iter_mut().zip(other).with_min_len(8).for_each(swap);
    }
}
