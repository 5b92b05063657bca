//! Velocities of nodes: forces, conditions on domain faces, and interpolation from real to constrained nodes.
use rayon::prelude::*;

use crate::boundary::Contact;
use crate::boundary::absorbing::AbsorbingFaces;
use crate::boundary::motion::Rate;
use crate::exact_sum::ExactSum;
use crate::grid::mask::block_nodes;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::Row;
use crate::quantity::in_job;
use crate::solver::physics::Physics;
use crate::solver::sorting::bins::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Collective over neighbours where colliders act on particles or bodies are in contact. `v_j = p_j / m_j + Δt g` on real nodes, then loads,
    /// ties of surface nodes, contact between bodies, the conditions of colliders in their order, and those of domain faces, which come last so that nothing is driven
    /// out of the domain. Returns impulse and
    /// angular impulse on each collider from nodes and particles of this rank, and whether all particles in contact have bins. With a `dt` of
    /// 0 it shows the velocities between two steps: bodies and particles are not held, and nothing is booked.
    pub(in crate::solver) fn update_node_velocities(
        &mut self,
        dt: f64,
        rates: &[Rate<D>],
    ) -> (Vec<[ExactSum; SUMS]>, Result<(), BinMissing>) {
        // With mass scaling the weight of particles is in their momentum.
        let gravity = match self.physics.has_scaled_masses() {
            false => self.physics.gravity.at(self.clock.time + 0.5 * dt),
            true => [0.0; D],
        };
        let is_step = dt > 0.0;
        let mut pushes = Vec::new();
        self.for_each_field(|solver, field| {
            let grid = &mut solver.grid;
            solver.phases.time(Phase::Nodes, || update_velocity(&mut grid.fields, &grid.plan, gravity, dt));
            pushes.push(solver.apply_loads(dt));
            solver.tie_surface(field);
        });
        let mut held = self.press_bodies(dt);
        let mut impulses = self.no_impulses();
        self.for_each_field(|solver, field| {
            solver.collide(rates, &mut impulses);
            solver.apply_faces(dt, is_step);
            if is_step && solver.has_contact_at_particles() {
                let of_field = solver.hold_particles(field, dt, rates, &mut impulses);
                held = held.and(of_field);
            }
            if is_step {
                solver.book_loads(&pushes[field]);
            }
        });
        if is_step {
            self.note_motion();
        }
        (impulses, held)
    }

    /// Not collective. Applies the conditions of the faces of the domain to the nodes on them. In a step, it
    /// also sums the impulses on the faces from the nodes that this rank counts, if these are needed.
    pub(super) fn apply_faces(&mut self, dt: f64, is_step: bool) {
        let Physics { faces, absorbing, origin, .. } = &self.physics;
        let (grid, middle) = (&mut self.grid, self.clock.time + 0.5 * dt);
        let start = &grid.increments.start[..];
        let faces = Faces { contacts: faces, absorbing: Some(absorbing), start, origin: *origin, middle, dt };
        let (plan, sums) = (&grid.plan, &mut self.face_sums.of);
        self.phases.time(Phase::Nodes, || {
            if sums.is_empty() || !is_step {
                return apply_faces(&mut grid.fields, plan, &faces, |_, _, _| ());
            }
            apply_faces(&mut grid.fields, plan, &faces, |face, node, impulse: [f64; D]| {
                let (block, bit) = (node / block_nodes(D), node % block_nodes(D));
                if plan.blocks[block].owned >> bit & 1 == 1 {
                    sums[face].iter_mut().zip(impulse).for_each(|(sum, value)| sum.add(value));
                }
            });
        });
    }

    /// Collective. Mean force on each face of the domain since the last row of the history, N: lower and
    /// upper along each axis; empty if not needed.
    pub fn face_forces(&self) -> Vec<[f64; 3]> {
        let mean = |impulse: f64| self.face_sums.mean(impulse, self.clock.time);
        self.face_sums.totals(&self.comm).into_iter().map(|impulse| impulse.map(mean)).collect()
    }

    /// Not collective. `v_j = Σ c v_i` on constrained nodes from their parents; with FLIP and XPIC the
    /// increments alike.
    pub(in crate::solver) fn prolong_velocities(&mut self) {
        self.for_each_field(|solver, _| {
            solver.form_increments();
            solver.prolong();
        });
    }

    /// Not collective. Interpolates the rows of constrained nodes from those of real nodes.
    pub(in crate::solver) fn prolong(&mut self) {
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || grid.fields.prolong(&grid.plan, &grid.arenas));
    }
}

/// Turns sums of momentum and mass on real nodes into velocities at the end of the step,
/// `v = p / m + dt g`, where `p` holds the impulse of stress already.
pub fn update_velocity<const D: usize>(
    fields: &mut NodeFields<D>,
    plan: &GridPlan<D>,
    gravity: [f64; D],
    dt: f64,
) {
    let nodes = block_nodes(D);
    let blocks = fields.rows.par_chunks_mut(nodes).zip(&plan.blocks).zip(&fields.active);
    blocks.with_min_len(32).filter(|(_, active)| **active).for_each(|((rows, block), _)| {
        let real = block.real_nodes();
        for (bit, row) in rows.iter_mut().enumerate() {
            let [.., mass] = row.0;
            if real >> bit & 1 == 0 || mass <= 0.0 {
                *row = Row([0.0; 4]);
                continue;
            }
            for axis in 0..D {
                row.0[axis] = dt.mul_add(gravity[axis], row.0[axis] / mass);
            }
        }
    });
}

/// Conditions on the faces of the domain in a step.
pub struct Faces<'a, const D: usize> {
    /// Contact at each.
    pub contacts: &'a [[Contact; 2]; D],
    /// What is beyond those that absorb waves.
    pub absorbing: Option<&'a AbsorbingFaces<D>>,
    /// Velocities of nodes at the start of the step, m/s, where any face absorbs.
    pub start: &'a [Row],
    /// Lower corner of the domain in the job's coordinates, m.
    pub origin: [f64; D],
    /// Middle of the step, s.
    pub middle: f64,
    /// Its length, s.
    pub dt: f64,
}

impl<'a, const D: usize> Faces<'a, D> {
    /// Contacts alone, for velocities that no step has changed.
    pub fn without_absorption(contacts: &'a [[Contact; 2]; D]) -> Self {
        Self { contacts, absorbing: None, start: &[], origin: [0.0; D], middle: 0.0, dt: 0.0 }
    }
}

/// Applies the conditions of the domain's faces to the real nodes on them, axis by axis. `note` receives
/// face, node and the impulse of the node on the face, kg m/s.
pub fn apply_faces<const D: usize>(
    fields: &mut NodeFields<D>,
    plan: &GridPlan<D>,
    faces: &Faces<'_, D>,
    mut note: impl FnMut(usize, usize, [f64; D]),
) {
    for &(node, on) in
        plan.face_nodes.iter().filter(|(node, _)| fields.active[*node as usize / block_nodes(D)])
    {
        let row = &mut fields.rows[node as usize].0;
        let mut velocity: [f64; D] = std::array::from_fn(|axis| row[axis]);
        for axis in 0..D {
            for (side, inward) in [1.0, -1.0].into_iter().enumerate() {
                if on >> (2 * axis + side) & 1 == 1 {
                    let normal = std::array::from_fn(|a| if a == axis { inward } else { 0.0 });
                    let before = velocity;
                    match faces.absorbing.and_then(|absorbing| absorbing[axis][side].as_ref()) {
                        Some(face) => {
                            let block = &plan.blocks[node as usize / block_nodes(D)];
                            let x = plan.node_place(block, node as usize % block_nodes(D));
                            let pressure = face.pressure.at(in_job(&faces.origin, &x), faces.middle);
                            let start = faces.start.get(node as usize).map_or([0.0; 4], |row| row.0);
                            face.apply(
                                &mut velocity,
                                &std::array::from_fn(|a| start[a]),
                                (axis, inward),
                                pressure,
                                faces.dt,
                                plan.cell(block.level),
                            );
                        }
                        None => faces.contacts[axis][side].apply(&mut velocity, &normal),
                    }
                    let impulse = std::array::from_fn(|a| row[3] * (before[a] - velocity[a]));
                    note(2 * axis + side, node as usize, impulse);
                }
            }
        }
        row[..D].copy_from_slice(&velocity);
    }
}
