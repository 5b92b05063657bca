//! Loads in a step: their effect on nodes, with the sums of impulse and work.
use rayon::prelude::*;

use crate::grid::mask::block_nodes;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::Row;
use crate::leapfrog::Lengths;
use crate::load::Load;
use crate::solver::state::Solver;
use crate::solver::state::bookings::ForceAndWork;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::state::phases::Phase;

/// Impulse of a load on one node in one step.
pub(in crate::solver) struct Push<const D: usize> {
    load: usize,
    node: usize,
    impulse: [f64; D],
}

/// Applies the loads to the velocities of real nodes, in the order of the job; `start` has those at the start
/// of the step, where a load needs them. Returns the impulses on the nodes that this rank counts, in the
/// order of the nodes.
fn apply<const D: usize>(
    fields: &mut NodeFields<D>,
    start: &[Row],
    plan: &GridPlan<D>,
    loads: &[(usize, &Load<D>)],
    (time, lengths): (f64, Lengths),
) -> Vec<Push<D>> {
    let nodes = block_nodes(D);
    let blocks = fields.rows.par_chunks_mut(nodes).zip(&plan.blocks).zip(&fields.active).enumerate();
    let active = blocks.with_min_len(32).filter(|(_, (_, active))| **active);
    let pushed = active.map(|(index, ((rows, block), _))| {
        let mut pushes = Vec::new();
        let real = block.real_nodes();
        for (bit, row) in rows.iter_mut().enumerate() {
            let mass = row.0[3];
            if real >> bit & 1 == 0 || mass <= 0.0 {
                continue;
            }
            let x = plan.node_place(block, bit);
            let mut velocity: [f64; D] = std::array::from_fn(|a| row.0[a]);
            for &(number, load) in loads.iter().filter(|(_, load)| load.reaches(&x)) {
                let before = velocity;
                load.apply(&mut velocity, &x, time, lengths);
                if load.needs_start()
                    && let Some(Row(start)) = start.get(index * nodes + bit)
                {
                    load.damp(&mut velocity, &std::array::from_fn(|a| start[a]));
                }
                if block.owned >> bit & 1 == 1 {
                    let impulse = std::array::from_fn(|a| mass * (velocity[a] - before[a]));
                    pushes.push(Push { load: number, node: index * nodes + bit, impulse });
                }
            }
            row.0[..D].copy_from_slice(&velocity);
        }
        pushes
    });
    pushed.collect::<Vec<_>>().into_iter().flatten().collect()
}

impl<const D: usize> Solver<D> {
    /// Not collective. Applies loads to the velocities of the real nodes of a velocity field. Returns their
    /// impulses, for [`Solver::book_loads`].
    pub(in crate::solver) fn apply_loads(&mut self, field: usize, lengths: Lengths) -> Vec<Push<D>> {
        let time = self.clock.time;
        let scaled = self.physics.has_scaled_masses();
        let loads = self.physics.loads.iter().enumerate();
        let active = loads.filter(|(_, load)| !load.acts_on_particles(scaled) && load.is_active(time));
        let active: Vec<(usize, &Load<D>)> = active.collect();
        if active.is_empty() {
            return Vec::new();
        }
        let Grid { plan, fields, .. } = &mut self.grid;
        let VelocityField { nodes, increments, .. } = &mut fields[field];
        self.phases.time(Phase::Nodes, || {
            // The pass ahead of a regrid takes no time, and no force acts in it.
            let start = if lengths.kick > 0.0 { &increments.start[..] } else { &[] };
            apply(nodes, start, plan, &active, (time, lengths))
        })
    }

    /// Not collective. Adds impulse and work of the loads on a velocity field to their sums, once its nodes
    /// have their final velocities.
    pub(in crate::solver) fn book_loads(&mut self, field: usize, pushes: &[Push<D>]) {
        for push in pushes {
            let row = &self.grid.fields[field].nodes.rows[push.node].0;
            let sums = &mut self.sums.loads.of[push.load];
            for a in 0..D {
                sums[a].add(push.impulse[a]);
                // A product of two numbers, rounded once; the sum is exact.
                sums[3].add(push.impulse[a] * row[a]);
            }
        }
    }

    /// Collective. Mean force and work of each load.
    pub fn load_totals(&self) -> Vec<ForceAndWork> {
        self.sums.loads.force_and_work(&self.comm, self.time_of_velocities())
    }
}
