//! Load steps: equilibrium at the end of each step, by Newton's method.
//!
//! In a quasi-static job all velocities are 0 between steps, and time orders loads and motions. A step finds
//! the displacements of nodes with which forces balance at its end (updated Lagrangian; Charlton, Coombs and
//! Augarde 2017); then particles take on what they gather from these, as in any step. A step in which the
//! iteration fails is done again with half its length.
//!
//! | file | what it holds |
//! |---|---|
//! | `held` | what holds a node, and what a wall lets go of |
//! | `unknowns` | nodes, what holds them, ties, products |
//! | `walls` | where they slide, stick or leave |
//! | `points` | stress and tangent of the particles |
//! | `multigrid/` | preconditioner |
//! | `newton` | the iteration |
//! | `strength` | the search for a factor of safety |
//! | this | a step |
mod held;
mod multigrid;
mod newton;
mod points;
mod strength;
mod unknowns;
mod walls;

use self::held::{Holder, Wall};
use self::newton::MOST_WAY;
use self::unknowns::{Nodal, Unknowns};
use super::step::colliders::Touch;
use crate::boundary::motion::Rate;
use crate::exact_sum::ExactSum;
use crate::kernel::Row;
use crate::leapfrog::Lengths;
use crate::load::{Kind, Load};
use crate::particle::chunk::{Chunk, Layout};
use crate::solver::migration::migrate::Moved;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::grid::inside::dot;
use crate::solver::state::{Effort, Solver, StepError};
use crate::solver::step::relax::stop;

/// Growth of steps that converge fast.
const GROWTH: f64 = 1.5;
/// Part of the greatest way of a node in a step for which the next step is made.
const NEARLY: f64 = 0.9;
/// Newton iterations up to which convergence is fast.
const FAST: u32 = 6;

/// Force of a load at a node: numbers of both, and the force, N.
type Pull<const D: usize> = (usize, usize, [f64; D]);

impl<const D: usize> Solver<D> {
    /// Collective. A load step from the present time of at most `dt`, s. Returns its length, and what has
    /// moved or why the step failed.
    pub(in crate::solver) fn load_step(&mut self, dt: f64) -> (f64, Result<Moved, StepError>) {
        let Some(settings) = self.physics.quasi_static else { return (dt, Ok(Moved::default())) };
        self.chunks.iter_mut().for_each(stop);
        let sorted = self.sort_into_bins();
        if self.comm.any(sorted.is_err()) {
            return (dt, sorted.map(|()| Moved::default()).map_err(Into::into));
        }
        let (mut dt, mut cuts) = (dt, 0);
        let hoops = columns(&self.chunks, Layout::<D>::STRESS + 2);
        loop {
            self.wet_particles(self.clock.time + dt);
            let masses = columns(&self.chunks, Layout::<D>::MASS);
            self.physics.weaken(self.clock.time + dt);
            let rates = self.collider_rates(dt);
            let (mut unknowns, outer, pulls) = self.outer_forces(&rates, dt);
            let found = self.balance_forces(&mut unknowns, &outer, dt, settings.tolerance);
            restore(&mut self.chunks, Layout::<D>::MASS, &masses);
            match found {
                Ok(balance) => {
                    let effort = Effort { cuts, ..balance.effort };
                    self.equilibrium.effort = effort;
                    let bound = if cuts > 0 { dt } else { self.equilibrium.next_load_step };
                    let is_fast = effort.newton <= FAST + balance.rounds;
                    let grown = if is_fast { GROWTH * bound } else { bound };
                    // Nodes of a longer step than the next may move too far.
                    let far = self.comm.max_f64(unknowns.greatest_way(&balance.way));
                    let allowed = if far > 0.0 { NEARLY * MOST_WAY / far * dt } else { f64::INFINITY };
                    self.equilibrium.next_load_step = match &self.physics.reduction {
                        Some(reduction) => reduction.next(bound, dt),
                        None => grown.min(allowed).min(settings.step),
                    };
                    let impulses = self.book(&unknowns, &balance.rest, &balance.way, &pulls, dt);
                    return (dt, self.follow(&unknowns, &balance.way, &rates, impulses, dt));
                }
                Err(effort) => {
                    cuts += 1;
                    dt *= 0.5;
                    if let Some(reduction) = &self.physics.reduction {
                        if reduction.is_bracket(2.0 * dt) {
                            self.equilibrium.next_load_step = dt;
                            self.physics.weaken(self.clock.time);
                            self.wet_particles(self.clock.time);
                            restore(&mut self.chunks, Layout::<D>::STRESS + 2, &hoops);
                            self.chunks.iter_mut().for_each(stop);
                            return (0.0, Ok(Moved::default()));
                        }
                    } else if dt < settings.least_step {
                        let Effort { newton, linear, residual, worst, .. } = effort;
                        let place = (0..D).map(|a| self.physics.origin[a] + worst[a]).collect();
                        let (to, dt) = (self.clock.time + 2.0 * dt, 2.0 * dt);
                        let [slides, sticks] = unknowns.slides().map(|has| self.comm.any(has));
                        let slides = slides && !sticks;
                        let failed = StepError::NoBalance { to, dt, newton, linear, residual, place, slides };
                        return (0.5 * dt, Err(failed));
                    }
                }
            }
        }
    }

    /// Collective over neighbours. Unknowns of a step, and the forces of loads and gravity at its end; also
    /// accelerations by loads at nodes, for their sums: load, node and force.
    fn outer_forces(&mut self, rates: &[Rate<D>], dt: f64) -> (Unknowns<D>, Nodal<D>, Vec<Pull<D>>) {
        // The force over 1 s at the end of the step is an impulse.
        let at_end = Lengths { kick: 1.0, drift: 2.0f64.mul_add(dt, 1.0) };
        self.chunks.iter_mut().for_each(forget_stress);
        let mut given = Vec::new();
        self.push_particles(at_end, &mut given);
        let fields = Unknowns::empty();
        let _ = self.forces(&fields, &given, |_, _| ());
        let unknowns = self.unknowns(rates, dt);
        let gravity = self.physics.gravity.at(self.clock.time + dt);
        let loads = self.physics.loads.iter().enumerate();
        let active: Vec<(usize, &Load<D>)> = loads
            .filter(|(_, load)| {
                let is_force = matches!(load.kind, Kind::BodyForce(_)) && !load.acts_on_particles(false);
                is_force && load.is_active(self.clock.time)
            })
            .collect();
        let mut pulls = Vec::new();
        let mut outer = Vec::with_capacity(unknowns.nodes.len());
        for (number, (&node, x)) in unknowns.nodes.iter().zip(&unknowns.places).enumerate() {
            let Row(row) = self.grid.fields[0].nodes.rows[node as usize];
            let mut force: [f64; D] = std::array::from_fn(|a| row[3].mul_add(gravity[a], row[a]));
            for &(load, at) in active.iter().filter(|(_, load)| load.reaches(x)) {
                let mut acceleration = [0.0; D];
                at.apply(&mut acceleration, x, self.clock.time, at_end);
                let pull = acceleration.map(|a| row[3] * a);
                (0..D).for_each(|a| force[a] += pull[a]);
                pulls.push((load, number, pull));
            }
            outer.push(force);
        }
        (unknowns, outer, pulls)
    }

    /// Not collective. Adds the impulses of the step to the sums of loads, colliders and faces. Returns those
    /// on the colliders.
    fn book(
        &mut self,
        unknowns: &Unknowns<D>,
        rest: &Nodal<D>,
        way: &Nodal<D>,
        pulls: &[Pull<D>],
        dt: f64,
    ) -> Vec<[ExactSum; SUMS]> {
        let mut impulses = self.no_impulses();
        for &(load, number, force) in pulls.iter().filter(|(_, number, _)| unknowns.owned[*number]) {
            let sums = &mut self.sums.loads.of[load];
            for a in 0..D {
                sums[a].add(dt * force[a]);
                sums[3].add(force[a] * way[number][a]);
            }
        }
        let mut book = |by: Holder, number: usize, on_holder: [f64; D]| match by {
            Holder::Grip(load) => {
                let sums = &mut self.sums.loads.of[load];
                for a in 0..D {
                    sums[a].add(-on_holder[a]);
                    sums[3].add(-on_holder[a] / dt * way[number][a]);
                }
            }
            Holder::Collider(collider) => {
                let position = unknowns.places[number];
                let touch = Touch { collider, position, impulse: on_holder };
                touch.book(&self.physics.colliders, &self.contacts.states, &mut impulses);
            }
            Holder::Face(face) => {
                if let Some(sums) = self.sums.faces.of.get_mut(face) {
                    sums.iter_mut().zip(on_holder).for_each(|(sum, value)| sum.add(value));
                }
            }
        };
        // The node gets the opposite of the force that is left.
        for (number, held) in unknowns.held.iter().enumerate().filter(|(number, _)| unknowns.owned[*number]) {
            let mut last = None;
            for held in held.iter().flatten().filter(|held| last.replace(held.by) != Some(held.by)) {
                let is_by = |a: usize| unknowns.held[number][a].is_some_and(|other| other.by == held.by);
                let on_holder = std::array::from_fn(|a| if is_by(a) { dt * rest[number][a] } else { 0.0 });
                book(held.by, number, on_holder);
            }
        }
        for (number, turned) in unknowns.turned.iter().filter(|(number, _)| unknowns.owned[*number]) {
            for (along, held) in turned {
                let force = dt * dot(along, &rest[*number]);
                book(held.by, *number, along.map(|along| force * along));
            }
        }
        let rubs = |wall: &&Wall<D>| unknowns.owned[wall.node] && wall.rubs();
        for wall in unknowns.walls.iter().filter(rubs) {
            book(wall.by, wall.node, wall.shear(&way[wall.node]).map(|force| -dt * force));
        }
        impulses
    }

    /// Collective over neighbours. Particles take on the displacements of the nodes.
    fn follow(
        &mut self,
        unknowns: &Unknowns<D>,
        way: &Nodal<D>,
        rates: &[Rate<D>],
        impulses: Vec<[ExactSum; SUMS]>,
        dt: f64,
    ) -> Result<Moved, StepError> {
        let to = self.clock.time + dt;
        let rows = &mut self.grid.fields[0].nodes.rows;
        for ((&node, &mass), way) in unknowns.nodes.iter().zip(&unknowns.masses).zip(way) {
            let mut row = [0.0, 0.0, 0.0, mass];
            (0..D).for_each(|a| row[a] = way[a] / dt);
            rows[node as usize] = Row(row);
        }
        self.prolong(0);
        let departed = self.nodes_to_particles(rates, to, dt);
        self.book_pushes(Lengths { kick: dt, drift: dt });
        self.chunks.iter_mut().for_each(stop);
        let moved = self.migrate_particles(departed);
        self.wet_particles(to);
        self.chunks.iter_mut().for_each(stop);
        let pushes = vec![Default::default(); rates.len()];
        self.move_colliders(rates, &pushes, impulses, to, dt);
        Ok(moved?)
    }
}

/// The values of a column of all particles, by leaf.
fn columns<const D: usize>(chunks: &[Chunk<D>], column: usize) -> Vec<Vec<f64>> {
    chunks.iter().map(|chunk| chunk.column(column).into_iter().copied().collect()).collect()
}

/// Gives particles the values of a column back.
fn restore<const D: usize>(chunks: &mut [Chunk<D>], column: usize, values: &[Vec<f64>]) {
    for (chunk, values) in chunks.iter_mut().zip(values) {
        for (value, &own) in chunk.column_mut(column).into_iter().zip(values) {
            *value = own;
        }
    }
}

/// Sets what forces on nodes come from to 0; a step computes it anew from the elastic state.
fn forget_stress<const D: usize>(chunk: &mut Chunk<D>) {
    let first = Layout::<D>::AFFINE;
    (first..first + D * D).for_each(|column| chunk.column_mut(column).fill(0.0));
    chunk.column_mut(Layout::<D>::STRESS + 2).fill(0.0);
}
