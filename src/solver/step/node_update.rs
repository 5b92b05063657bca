//! Velocities of nodes: forces, conditions on domain faces, and interpolation from real to constrained nodes.
use rayon::prelude::*;

use crate::boundary::absorbing::AbsorbingFaces;
use crate::boundary::motion::Rate;
use crate::boundary::{Bounds, Contact, Gap, gap};
use crate::exact_sum::ExactSum;
use crate::grid::mask::block_nodes;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::{Coordinates, Row};
use crate::leapfrog::Lengths;
use crate::quantity::in_job;
use crate::solver::physics::Physics;
use crate::solver::sorting::box_widths::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::state::grid::walls::Walls;
use crate::solver::state::grid::{Grid, Solids};
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. `v_j = p_j / m_j + Δt g` on real nodes with the kick Δt, then loads, ties
    /// of surface nodes, contact between bodies, the conditions of domain faces and those of colliders, with
    /// those of faces again in each sweep, so that nothing is driven out of the domain. Returns impulse and
    /// angular impulse on each collider from nodes and particles of this rank, and whether all particles in
    /// contact have bins. With no length it shows the velocities between two steps: bodies and particles are
    /// not held, and nothing is booked.
    pub(in crate::solver) fn update_node_velocities(
        &mut self,
        lengths: Lengths,
        rates: &[Rate<D>],
    ) -> (Vec<[ExactSum; SUMS]>, Result<(), BinMissing>) {
        // With mass scaling the weight of particles is in their momentum.
        let gravity = match self.physics.has_scaled_masses() {
            false => self.physics.gravity.at(lengths.middle_of_kick(self.clock.time)),
            true => [0.0; D],
        };
        let is_step = lengths.drift > 0.0;
        let occupied = self.occupied();
        let mut pushes = Vec::new();
        for field in 0..self.grid.fields.len() {
            let Grid { plan, fields, .. } = &mut self.grid;
            let nodes = &mut fields[field].nodes;
            self.phases.time(Phase::Nodes, || update_velocity(nodes, plan, gravity, lengths.kick));
            pushes.push(self.apply_loads(field, lengths));
            self.tie_surface(field, &occupied);
        }
        let meets = self.meeting_nodes(is_step);
        let mut held = self.find_surfaces(&meets, lengths);
        self.press_bodies(&meets, held.is_ok(), lengths);
        let mut impulses = self.no_impulses();
        for (field, pushes) in pushes.iter().enumerate() {
            self.hold_at_nodes(field, rates, &mut impulses);
            self.apply_faces(field, lengths, is_step);
            self.hold_at_feet(field, rates, &mut impulses);
            if is_step && self.has_contact_at_particles() {
                let of_field = self.hold_particles(field, lengths, rates, &mut impulses);
                held = held.and(of_field);
            }
            if is_step {
                self.book_loads(field, pushes);
            }
        }
        if is_step {
            self.note_motion();
        }
        (impulses, held)
    }

    /// Not collective. Applies the conditions of the faces of the domain to the nodes on them, for the
    /// velocity field numbered `field`. In a step, it also sums the impulses on the faces from the nodes that
    /// this rank counts, if these are needed. Faces that absorb waves take the impulse of the kick.
    pub(super) fn apply_faces(&mut self, field: usize, lengths: Lengths, is_step: bool) {
        let Physics { faces, absorbing, origin, .. } = &self.physics;
        let middle = lengths.middle_of_kick(self.clock.time);
        let Grid { plan, fields, walls, solids, .. } = &mut self.grid;
        let VelocityField { nodes, increments, .. } = &mut fields[field];
        let gaps = self.physics.gaps(walls, solids, field);
        let (contacts, absorbing, start) = (faces, Some(absorbing), &increments.start[..]);
        let faces = Faces { contacts, gaps, absorbing, start, origin: *origin, middle, kick: lengths.kick };
        let on = (&mut nodes.rows[..], &nodes.active[..]);
        let sums = &mut self.sums.faces.of;
        self.phases.time(Phase::Nodes, || {
            if sums.is_empty() || !is_step {
                return apply_faces(on, plan, &faces, |_, _, _| ());
            }
            apply_faces(on, plan, &faces, |face, node, impulse: [f64; D]| {
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
        let time = self.time_of_velocities();
        let mean = |impulse: f64| self.sums.faces.mean(impulse, time);
        self.sums.faces.totals(&self.comm).into_iter().map(|impulse| impulse.map(mean)).collect()
    }

    /// Not collective. `v_j = Σ c v_i` on constrained nodes from their parents; with FLIP and XPIC the
    /// increments alike.
    pub(in crate::solver) fn prolong_velocities(&mut self) {
        for field in 0..self.grid.fields.len() {
            self.form_increments(field);
            self.prolong(field);
        }
    }

    /// Not collective. Interpolates the rows of constrained nodes of a velocity field from those of real
    /// nodes.
    pub(in crate::solver) fn prolong(&mut self, field: usize) {
        self.grid.fields[field].prolong(&self.grid.plan, &mut self.phases);
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
    /// Where the material is; without it all touches.
    pub gaps: Option<Gaps<'a>>,
    /// The medium beyond those that absorb waves.
    pub absorbing: Option<&'a AbsorbingFaces<D>>,
    /// Velocities of nodes at the start of the step, m/s, where any face absorbs.
    pub start: &'a [Row],
    /// Lower corner of the domain in the job's coordinates, m.
    pub origin: [f64; D],
    /// Middle of the time over which forces act, s.
    pub middle: f64,
    /// Its length, s.
    pub kick: f64,
}

/// Where the material at the nodes of surfaces is.
#[derive(Clone, Copy)]
pub struct Gaps<'a> {
    /// `Σ V ∇w` and `Σ V w`, by node.
    pub sums: &'a [Row],
    /// Length of the step in which it may come to the surface, s.
    pub over: f64,
    /// Whether it touches the surface wherever it is.
    pub touches: bool,
    /// Coordinates of the domain.
    pub coordinates: Coordinates,
}

impl<const D: usize> Physics<D> {
    /// Where the material of a velocity field is, if it is known.
    pub(super) fn gaps<'a>(&self, walls: &Walls, solids: &'a [Solids<D>], field: usize) -> Option<Gaps<'a>> {
        let touches = !self.moves_over_gaps(field);
        let over =
            walls.known_over.map(|lengths| lengths.drift).filter(|_| !touches || self.has_walls_by_area())?;
        Some(Gaps { sums: solids[field].at_walls(), over, touches, coordinates: self.coordinates })
    }
}

impl Gaps<'_> {
    /// Bounds on the velocity of a node at `x` (m) on a face with this normal into the domain, of cells of
    /// this edge, m. `cohesion` is the velocity that cohesion over an area of 1 m² (in plane strain 1 m)
    /// takes away at most, m/s; `drag` is the way of the surface in the step by a velocity of 1 m/s, times
    /// the coefficient of drag, s.
    fn bounds<const D: usize>(
        &self,
        (node, x): (usize, &[f64; D]),
        normal: &[f64; D],
        cell: f64,
        [cohesion, drag]: [f64; 2],
        law: Contact,
    ) -> Bounds {
        let row = self.sums[node].0;
        let slope = gap::slope(&row, normal);
        let bend = self.coordinates.bend(normal[0], cell, x[0]);
        let gap = cell * gap::height(row[3], slope, cell, bend);
        // At a face the slope is the area that the material has of it.
        let area = if self.touches || gap <= gap::STICKS * cell { slope.max(0.0) } else { 0.0 };
        let (sticking, drag) = (cohesion * area, if row[3] > 0.0 { drag * area / row[3] } else { 0.0 });
        let bounds = if self.touches {
            Bounds::TOUCHING
        } else {
            let full = gap::full_slope(self.coordinates.face_area::<D>(cell, x[0]), gap / cell);
            law.across(Gap::new(gap, slope, full), cell, self.over)
        };
        Bounds { sticking, drag, ..bounds }
    }
}

impl<'a, const D: usize> Faces<'a, D> {
    /// Contacts alone, for velocities that no step has changed.
    pub fn without_absorption(contacts: &'a [[Contact; 2]; D], gaps: Option<Gaps<'a>>) -> Self {
        Self { contacts, gaps, absorbing: None, start: &[], origin: [0.0; D], middle: 0.0, kick: 0.0 }
    }
}

/// Applies the conditions of the domain's faces to the rows of the real nodes on them in active blocks, axis
/// by axis. `note` receives face, node and the impulse of the node on the face, kg m/s.
pub fn apply_faces<const D: usize>(
    (rows, active): (&mut [Row], &[bool]),
    plan: &GridPlan<D>,
    faces: &Faces<'_, D>,
    mut note: impl FnMut(usize, usize, [f64; D]),
) {
    for &(node, on) in plan.face_nodes.iter().filter(|(node, _)| active[*node as usize / block_nodes(D)]) {
        let row = &mut rows[node as usize].0;
        let mut velocity: [f64; D] = std::array::from_fn(|axis| row[axis]);
        for axis in 0..D {
            for (side, inward) in [1.0, -1.0].into_iter().enumerate() {
                if on >> (2 * axis + side) & 1 == 1 {
                    let normal = std::array::from_fn(|a| if a == axis { inward } else { 0.0 });
                    let before = velocity;
                    let block = &plan.blocks[node as usize / block_nodes(D)];
                    let cell = plan.cell(block.level);
                    let x = plan.node_place(block, node as usize % block_nodes(D));
                    match faces.absorbing.and_then(|absorbing| absorbing[axis][side].as_ref()) {
                        Some(face) => {
                            let pressure = face.pressure.at(in_job(&faces.origin, &x), faces.middle);
                            let start = faces.start.get(node as usize).map_or([0.0; 4], |row| row.0);
                            face.apply(
                                &mut velocity,
                                &std::array::from_fn(|a| start[a]),
                                (axis, inward),
                                pressure,
                                faces.kick,
                                cell,
                            );
                        }
                        None => {
                            let law = faces.contacts[axis][side];
                            let cohesion =
                                if row[3] > 0.0 { law.cohesion() * faces.kick / row[3] } else { 0.0 };
                            let gaps = faces.gaps.filter(|_| law.has_gap());
                            let by_area = [cohesion, law.drag() * faces.kick];
                            let at = (node as usize, &x);
                            let bounds = gaps.map(|gaps| gaps.bounds(at, &normal, cell, by_area, law));
                            law.apply_within(bounds.unwrap_or(Bounds::TOUCHING), &mut velocity, &normal);
                        }
                    }
                    let impulse = std::array::from_fn(|a| row[3] * (before[a] - velocity[a]));
                    note(2 * axis + side, node as usize, impulse);
                }
            }
        }
        row[..D].copy_from_slice(&velocity);
    }
}
