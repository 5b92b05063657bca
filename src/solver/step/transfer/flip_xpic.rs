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

use crate::kernel::{GivenColumn, Row, Transfer};
use crate::memory::Block;
use crate::particle::chunk::Layout;
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::velocity_field::{Increments, VelocityField};
use crate::solver::state::phases::Phase;
use crate::solver::step::node_update::{Faces, apply_faces, update_velocity};

/// `to -= from`.
fn subtract(to: &mut [Row], from: &[Row]) {
    to.par_iter_mut().zip(from).with_min_len(4096).for_each(|(to, from)| {
        for lane in 0..3 {
            to.0[lane] -= from.0[lane];
        }
    });
}

/// Columns of a leaf that are given, and these velocities of its particles.
fn with_velocities<const D: usize>(mut given: Vec<GivenColumn>, velocities: &[[f64; D]]) -> Vec<GivenColumn> {
    given.extend((0..D).map(|axis| {
        let values = velocities.iter().map(|velocity| velocity[axis]).collect();
        GivenColumn { column: Layout::<D>::VELOCITY + axis, values }
    }));
    given
}

impl<const D: usize> Solver<D> {
    /// Before P2G: velocities of the nodes of a velocity field without the impulse of stress, for transfers
    /// and for loads that need them. Masses may be given in place of those of the particles.
    pub(in crate::solver::step) fn note_velocities(&mut self, field: usize, given: &[Vec<GivenColumn>]) {
        let time = self.clock.time;
        let absorbs = self.physics.absorbing.as_flattened().iter().any(Option::is_some);
        let damps = self.physics.loads.iter().any(|load| load.needs_start() && load.is_active(time));
        let is_needed = absorbs || damps;
        if is_needed {
            self.scatter_velocities(field, given);
            let VelocityField { nodes, increments, .. } = &mut self.grid.fields[field];
            increments.start.clone_from(&nodes.rows);
        }
        let order = match self.physics.transfer {
            Transfer::Apic | Transfer::Tpic => return,
            Transfer::Flip { .. } => None,
            Transfer::Xpic { order } => Some(order),
        };
        if order != Some(1) && !is_needed {
            self.scatter_velocities(field, given);
        }
        let VelocityField { nodes, increments: Increments { base, .. }, .. } = &mut self.grid.fields[field];
        let Some(order) = order else { return base.clone_from(&nodes.rows) };
        base.resize(nodes.rows.len());
        base.fill(Row::default());
        let given_of = |leaf: usize| given.get(leaf).cloned().unwrap_or_default();
        let mut rest = if order > 1 { nodes.rows.clone() } else { Block::default() };
        for _ in 1..order {
            self.grid.fields[field].nodes.rows.copy_from_slice(&rest);
            self.prolong(field);
            let velocities = self.interpolate(field);
            let given = velocities.par_iter().enumerate().with_min_len(8);
            let given = given.map(|(leaf, velocities)| with_velocities(given_of(leaf), velocities));
            self.scatter_velocities(field, &given.collect::<Vec<_>>());
            let VelocityField { nodes, increments, .. } = &mut self.grid.fields[field];
            subtract(&mut rest, &nodes.rows);
            subtract(&mut increments.base, &rest);
        }
    }

    /// After the update: what the nodes of a velocity field give to particles, prolonged like velocities.
    pub(in crate::solver) fn form_increments(&mut self, field: usize) {
        if !self.physics.transfer.has_increments() {
            return;
        }
        let Grid { plan, fields, walls, solids, .. } = &mut self.grid;
        let VelocityField { nodes, arenas, increments, .. } = &mut fields[field];
        let Increments { base, rows, .. } = increments;
        rows.clone_from(&nodes.rows);
        subtract(rows, base);
        if matches!(self.physics.transfer, Transfer::Xpic { .. }) {
            // These are velocities, which the filter may have turned towards a wall.
            let gaps = self.physics.gaps(walls, solids, field);
            let faces = Faces::without_absorption(&self.physics.faces, gaps);
            apply_faces((rows, &nodes.active), plan, &faces, |_, _, _| ());
        }
        self.phases.time(Phase::Nodes, || nodes.prolong_rows(plan, arenas, rows));
    }

    /// S⁺: velocities of the nodes from those of the particles alone.
    fn scatter_velocities(&mut self, field: usize, given: &[Vec<GivenColumn>]) {
        self.field_from_particles(field, 0.0, given);
        let Grid { plan, fields, .. } = &mut self.grid;
        self.phases.time(Phase::Nodes, || update_velocity(&mut fields[field].nodes, plan, [0.0; D], 0.0));
    }
}
