//! Nodes behind the surface of a collider that acts on particles.
//!
//! The box of a particle in contact reaches a little into the collider, so that nodes there get slivers of
//! its mass. A node whose hat hardly reaches the surface has no part in the condition of contact, but has a
//! force of stress that does not shrink with its mass: left alone it would move on until the outermost row of
//! particles had no stress, while those of the next row bore all. So it obeys the law of the collider itself.
use rayon::prelude::*;

use crate::boundary::Bounds;
use crate::boundary::motion::Rate;
use crate::exact_sum::ExactSum;
use crate::grid::mask::{bits, block_nodes};
use crate::solver::state::Solver;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::phases::Phase;
use crate::solver::step::colliders::Touch;
use crate::solver::step::walls::obey;

/// Depth behind a surface, in cells, from which nodes obey its law.
const DEEP: f64 = 0.75;

/// A node behind the surface of a collider.
pub(super) struct Behind<const D: usize> {
    /// Number of the collider.
    collider: usize,
    /// Number of its row.
    node: usize,
    /// Whether this rank counts it.
    is_counted: bool,
    /// Its place, m.
    at: [f64; D],
    /// Outward unit normal of the collider.
    normal: [f64; D],
}

impl<const D: usize> Solver<D> {
    /// Not collective. The real nodes of a velocity field that have mass and are behind the surface of a
    /// collider that acts on particles, in the order of blocks, colliders and nodes.
    pub(super) fn nodes_behind(&mut self, field: usize) -> Vec<Behind<D>> {
        let (physics, states) = (&self.physics, &self.contacts.states);
        let (plan, fields) = (&self.grid.plan, &self.grid.fields[field].nodes);
        let acting = || {
            let all = physics.colliders.iter().zip(states).enumerate();
            all.filter(|(_, (collider, _))| collider.acts_on_particles())
        };
        self.phases.time(Phase::Nodes, || {
            let active = (0..plan.blocks.len()).into_par_iter().with_min_len(32);
            let found = active.filter(|&index| fields.active[index]).map(|index| {
                let block = &plan.blocks[index];
                let cell = plan.cell(block.level);
                let nodes = plan.nodes_box(block);
                let deep = -DEEP * cell;
                let mut behind = Vec::new();
                for (number, (collider, state)) in acting() {
                    if collider.distance_to_box(&nodes, &state.pose) > deep {
                        continue;
                    }
                    for bit in bits(block.real_nodes()) {
                        let node = index * block_nodes(D) + bit as usize;
                        if fields.rows[node].0[3] <= 0.0 {
                            continue;
                        }
                        let at = plan.node_place(block, bit as usize);
                        if collider.distance(&at, &state.pose) <= deep {
                            let normal = collider.normal(&at, &state.pose);
                            let is_counted = block.owned >> bit & 1 == 1;
                            behind.push(Behind { collider: number, node, is_counted, at, normal });
                        }
                    }
                }
                behind
            });
            found.collect::<Vec<_>>().into_iter().flatten().collect()
        })
    }

    /// Not collective. Has nodes of a velocity field behind surfaces obey the laws of their colliders. Adds
    /// their impulses.
    pub(super) fn hold_behind(
        &mut self,
        field: usize,
        behind: &[Behind<D>],
        rates: &[Rate<D>],
        sums: &mut [[ExactSum; SUMS]],
    ) {
        let (colliders, states) = (&self.physics.colliders, &self.contacts.states);
        for &Behind { collider, node, is_counted, at, normal } in behind {
            let row = &mut self.grid.fields[field].nodes.rows[node];
            let of = (&colliders[collider], &states[collider], &rates[collider]);
            if let Some(impulse) = obey(row, &at, of, &normal, Bounds::TOUCHING).filter(|_| is_counted) {
                Touch { collider, position: at, impulse }.book(colliders, states, sums);
            }
        }
    }
}
