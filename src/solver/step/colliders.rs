//! Colliders in a step: their reactions and their motion.
use crate::boundary::motion::Rate;
use crate::boundary::rigid::{Push, Surroundings};
use crate::boundary::vector::cross;
use crate::boundary::{Collider, ColliderState};
use crate::exact_sum::ExactSum;
use crate::geometry::Aabb;
use crate::geometry::vector::in_space;
use crate::kernel::BLOCK;
use crate::solver::state::Solver;
use crate::solver::state::bookings::{ExactSums, Reaction, SUMS};
use crate::solver::state::phases::Phase;

/// Impulse of one node or particle on a collider.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct Touch<const D: usize> {
    pub collider: usize,
    pub position: [f64; D],
    pub impulse: [f64; D],
}

impl<const D: usize> Touch<D> {
    /// Adds impulse and angular impulse about the reference point to the sums of the collider.
    pub(in crate::solver) fn book(
        &self,
        colliders: &[Collider<D>],
        states: &[ColliderState<D>],
        sums: &mut [[ExactSum; SUMS]],
    ) {
        let centre = colliders[self.collider].centre(&states[self.collider].pose);
        let impulse = in_space(&self.impulse);
        let arm = in_space::<D>(&std::array::from_fn(|a| self.position[a] - centre[a]));
        let turn = cross(arm, impulse);
        for (sum, value) in sums[self.collider].iter_mut().zip(impulse.into_iter().chain(turn)) {
            sum.add(value);
        }
    }
}

impl<const D: usize> Solver<D> {
    /// Mean velocities of the colliders over the next step.
    pub(in crate::solver) fn collider_rates(&self, dt: f64) -> Vec<Rate<D>> {
        let gravity = self.physics.gravity.at(self.clock.time + 0.5 * dt);
        let all = self.physics.colliders.iter().zip(&self.contacts.states);
        all.map(|(collider, state)| collider.step_rate(state, &gravity, self.clock.time, dt)).collect()
    }

    /// Contact of free bodies with faces of the domain and other colliders: changes their mean velocities
    /// over the next step. Returns the impulses on each collider; the same on all ranks.
    pub(in crate::solver) fn meet_bodies(&self, rates: &mut [Rate<D>], dt: f64) -> Vec<Push> {
        let all = Surroundings {
            colliders: &self.physics.colliders,
            states: &self.contacts.states,
            features: &self.contacts.features,
            faces: &self.physics.faces,
            extent: self.grid.plan.extent(),
        };
        all.touch(rates, dt)
    }

    /// Sums of 0 for each collider.
    pub(in crate::solver) fn no_impulses(&self) -> Vec<[ExactSum; SUMS]> {
        vec![std::array::from_fn(|_| ExactSum::new()); self.physics.colliders.len()]
    }

    /// Collective. `V ← V + Δt g + J / M`, `X ← X + Δt V` over the step to the time `to` (s), with what nodes
    /// and other bodies gave to the colliders in it. One more reduction if any is free.
    pub(in crate::solver) fn move_colliders(
        &mut self,
        rates: &[Rate<D>],
        pushes: &[Push],
        step: Vec<[ExactSum; SUMS]>,
        to: f64,
        dt: f64,
    ) {
        for (sums, step) in self.contacts.sums.of.iter_mut().zip(&step) {
            sums.iter_mut().zip(step).for_each(|(sum, step)| sum.merge(step));
        }
        if self.comm.rank() == 0 {
            for (sums, push) in self.contacts.sums.of.iter_mut().zip(pushes) {
                let values = push.impulse.into_iter().chain(push.turn);
                sums.iter_mut().zip(values).for_each(|(sum, value)| sum.add(value));
            }
        }
        let gravity = self.physics.gravity.at(to - 0.5 * dt);
        let mut impulses = vec![[0.0; SUMS]; step.len()];
        if self.physics.colliders.iter().any(|collider| collider.free().is_some()) {
            let comm = &self.comm;
            let step = ExactSums { of: step, since: to };
            impulses = self.phases.time(Phase::Reduce, || step.totals(comm));
        }
        let all = self.physics.colliders.iter().zip(&mut self.contacts.states);
        for ((((collider, state), rate), impulse), push) in all.zip(rates).zip(impulses).zip(pushes) {
            let [x, y, z, a, b, c] = impulse;
            let linear = std::array::from_fn(|k| [x, y, z][k] + push.impulse[k]);
            let turn = std::array::from_fn(|k| [a, b, c][k] + push.turn[k]);
            *state = collider.advanced(state, rate, &gravity, [to, dt], linear, turn);
        }
        self.physics.deform_colliders(to);
    }

    /// Collective. Mean force and torque on each collider since the last row of the history, that is, the
    /// momentum given to it over the time since. Exact before it is rounded once.
    pub fn reactions(&self) -> Vec<Reaction> {
        let sums = &self.contacts.sums;
        let time = self.time_of_velocities();
        let mean = |impulse: f64| sums.mean(impulse, time);
        let all = sums.totals(&self.comm).into_iter();
        all.map(|[x, y, z, a, b, c]| Reaction { force: [x, y, z].map(mean), torque: [a, b, c].map(mean) })
            .collect()
    }

    /// Not collective. Resets the means of [`Solver::reactions`].
    pub fn forget_reactions(&mut self) {
        let time = self.time_of_velocities();
        self.contacts.sums.forget(SUMS, time);
    }

    /// Not collective. Bound on a step without material, in which free colliders move alone, s: none moves
    /// further than the Courant number times a cell of a root octant, also from rest. The same on all ranks.
    pub(super) fn free_bound(&self) -> f64 {
        let (physics, extent, time) = (&self.physics, self.grid.plan.extent(), self.clock.time);
        let way = physics.control.cfl * physics.root_edge / f64::from(BLOCK as u32);
        let gravity = physics.gravity.at(time).iter().map(|g| g * g).sum::<f64>().sqrt();
        let free = physics.colliders.iter().zip(&self.contacts.states);
        let free = free.filter(|(collider, _)| collider.is_present() && collider.free().is_some());
        free.fold(f64::INFINITY, |bound, (collider, state)| {
            bound.min(way / collider.greatest_speed(state, &extent, time)).min((way / gravity).sqrt())
        })
    }

    /// Bound on the next step from the colliders: none may cross more than the Courant number times a cell of
    /// a leaf with particles; a collider further away may also travel up to the nearest such leaf, s.
    pub(super) fn collider_bound(&self) -> f64 {
        let mut bound = f64::INFINITY;
        let (plan, time) = (&self.grid.plan, self.clock.time);
        let extent = plan.extent();
        for (collider, state) in self.physics.colliders.iter().zip(&self.contacts.states) {
            let speed = collider.greatest_speed(state, &extent, time);
            if speed == 0.0 {
                continue;
            }
            let filled = self.leaf_data.signal.iter().zip(self.forest.leaves()).enumerate();
            for (leaf, (_, octant)) in filled.filter(|(_, (signal, _))| **signal > 0.0) {
                let cell = plan.finest_cell(leaf);
                let edge = f64::from(BLOCK as u32) * plan.cell(octant.level);
                let aabb = Aabb::new(
                    octant.coord.map(|c| f64::from(c) * edge),
                    octant.coord.map(|c| f64::from(c + 1) * edge),
                );
                let way = collider.distance_to_box(&aabb, &state.pose).max(0.0);
                bound = bound.min(self.physics.control.cfl.mul_add(cell, way) / speed);
            }
        }
        bound
    }
}
