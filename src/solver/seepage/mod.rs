//! Steady seepage: heads of the water at the nodes of the ground, and about its particles.
//!
//! Darcy's flow `-k ∇h` conserves its volume. Each cell with material conducts as its permeability, and the
//! interpolation in it is that of the tree: constrained nodes take the heads of their parents and hand their
//! flows to these. Rings conduct over their circumference. Nothing is gathered; a solution takes an exchange
//! of sums and three small reductions for each step of conjugate gradients. Particles carry the head about
//! them as a linear function, with which they move, split and go to other ranks, until heads are found anew.
//!
//! | file | what it holds |
//! |---|---|
//! | `ground` | permeabilities of cells; edges that conduct |
//! | `nodes` | sums and values at nodes, on all ranks |
//! | `heads` | heads at nodes; free surface |
mod ground;
mod heads;
mod nodes;

use rayon::prelude::*;

use self::ground::Ground;
use self::heads::{Heads, Held};
use self::nodes::Nodes;
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::parts::Sums;
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Collective. Finds the heads of the water that seeps at the present time, and gives them to the
    /// particles. Returns the number of nodes where each head is held; nothing where no water seeps.
    pub fn find_heads(&mut self) -> Vec<u64> {
        let Self { comm, physics, chunks, clock, contacts, grid, phases, sums, .. } = self;
        let Sums { flow, unsettled_heads, .. } = sums;
        let (Some(seepage), Some((load, water))) = (&physics.seepage, physics.water_at(clock.time)) else {
            return Vec::new();
        };
        let column = physics.followed_columns().head.unwrap_or(0);
        let (carried, count) = (physics.carried_columns(), seepage.heads.len());
        let held = Held { seepage, origin: &physics.origin, time: clock.time - load.start, up: water.up };
        let colliders = physics.colliders.iter().zip(&contacts.states);
        let covers: Vec<_> = colliders.filter(|(collider, _)| collider.is_present()).collect();
        let is_covered =
            |x: &[f64; D]| covers.iter().any(|(collider, state)| collider.distance(x, &state.pose) <= 0.0);
        phases.time(Phase::Nodes, || {
            let Grid { plan, exchange, .. } = grid;
            let mut ground = Ground::of(plan, seepage, chunks, physics.coordinates);
            let mut nodes = Nodes::new(comm, plan, exchange, &ground);
            let mut heads = Heads::new(&mut nodes, &ground, &held, is_covered);
            let all = heads.held(comm, count);
            let is_found = heads.find(&mut nodes, &mut ground);
            *unsettled_heads += u64::from(!is_found);
            let inflows = heads.inflows(&mut nodes, &ground, count);
            flow.of = inflows.into_iter().map(|sum| [sum]).collect();
            nodes.set(&heads.nodes, &heads.values);
            let about = nodes.at_particles(&ground, chunks);
            chunks.par_iter_mut().for_each(|chunk| chunk.carry(carried));
            for (leaf, values) in ground.leaves.iter().zip(about) {
                let chunk = &mut chunks[leaf.leaf];
                for (p, value) in values.into_iter().enumerate() {
                    (0..=D).for_each(|i| chunk.carried_mut(column + i)[p] = value[i]);
                }
            }
            all
        })
    }

    /// Not collective. Whether heads are due before a step: at multiples of the time between solutions,
    /// counted from the start of the water.
    pub(super) fn heads_are_due(&self) -> bool {
        let (Some(seepage), Some((load, _))) =
            (&self.physics.seepage, self.physics.water_at(self.clock.time))
        else {
            return false;
        };
        let passed = |time: f64| ((time - load.start) / seepage.every).floor();
        self.clock.step > 0 && passed(self.clock.time) > passed(self.clock.time - self.clock.dt)
    }
}
