//! Impulses of contact at the nodes where bodies meet.
use rayon::prelude::*;

use super::normals::Smoothed;
use crate::boundary::BodyContacts;
use crate::boundary::bodies::{Meeting, Pair, PairLaw};
use crate::grid::mask::{bits, block_nodes};
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::Coordinates;
use crate::leapfrog::Lengths;
use crate::solver::state::Solver;
use crate::solver::state::grid::Solids;
use crate::solver::state::phases::Phase;

/// Sweeps over the pairs of a node where more than two bodies meet; one is exact for two.
const SWEEPS: usize = 8;

/// Least area of surface at a node whose pressure particles take, in faces of its cells. A surface that has
/// less is nearly a cell from the node, where the mass of one of the bodies, and with it the force, is small
/// but its error is not.
const LEAST_AREA: f64 = 0.25;

/// Results at the nodes of one block in a step.
#[derive(Default)]
struct Pressed<const D: usize> {
    /// New velocities, with the numbers of their nodes and fields.
    velocities: Vec<(usize, usize, [f64; D])>,
    /// Impulse and work at the nodes that this rank counts.
    booked: Vec<Booked<D>>,
    /// Normal forces, if particles carry the pressure of contact.
    forces: Vec<NormalForce>,
}

/// Normal force of other bodies on a body at a node.
pub(super) struct NormalForce {
    /// Number of the node.
    pub(super) node: usize,
    /// Number of the body's velocity field.
    pub(super) field: usize,
    /// Normal force, N; 0 where the body is near another and does not touch it.
    pub(super) force: f64,
    /// Area on which it acts, m² (in plane strain m).
    pub(super) area: f64,
}

/// Impulse and work of a pair of bodies, for the contact of the job to which it belongs.
struct Booked<const D: usize> {
    contact: u16,
    /// Impulse on the contact's first side, kg m/s.
    impulse: [f64; D],
    /// Work, J.
    work: f64,
}

/// A body at a node.
#[derive(Clone, Copy)]
struct Body<const D: usize> {
    field: usize,
    mass: f64,
    velocity: [f64; D],
    /// Normal force of the others, N, and the area on which it acts, m² (in plane strain m).
    pressed: [f64; 2],
}

/// Impulse and normal force between a pair of bodies at a node.
struct Exchange<const D: usize> {
    /// Impulse on the second body, kg m/s.
    impulse: [f64; D],
    /// Normal force, N, and the area on which it acts, m² (in plane strain m).
    pressed: [f64; 2],
}

impl<const D: usize> Solver<D> {
    /// Not collective. Applies the impulses of contact at the real nodes where fields meet, given block by
    /// block, and sums impulse and work over the nodes that this rank counts. Returns the normal forces at
    /// these nodes if particles carry their pressure.
    pub(super) fn press(
        &mut self,
        meets: &[u64],
        smoothed: Option<&Smoothed<D>>,
        lengths: Lengths,
    ) -> Vec<NormalForce> {
        let grid = &self.grid;
        let press = Press {
            plan: &grid.plan,
            fields: grid.all_fields().collect(),
            solids: &grid.solids,
            meets,
            smoothed,
            hats: &grid.hats,
            contacts: &self.physics.body_contacts,
            coordinates: self.physics.coordinates,
            finds_forces: self.physics.followed_columns().contact_pressure.is_some(),
            lengths,
        };
        let pressed: Vec<Pressed<D>> = self.phases.time(Phase::Nodes, || {
            let blocks = meets.par_iter().enumerate().filter(|(_, nodes)| **nodes != 0);
            blocks.map(|(block, nodes)| press.block(block, *nodes)).collect()
        });
        let mut all_forces = Vec::new();
        for Pressed { velocities, booked, forces } in pressed {
            all_forces.extend(forces);
            for (node, field, velocity) in velocities {
                self.grid.fields[field].nodes.rows[node].0[..D].copy_from_slice(&velocity);
            }
            for Booked { contact, impulse, work } in booked {
                let sums = &mut self.sums.bodies.of[usize::from(contact)];
                sums.iter_mut().zip(impulse).for_each(|(sum, value)| sum.add(value));
                sums[3].add(work);
            }
        }
        all_forces
    }
}

/// Input of contact between bodies at nodes.
struct Press<'a, const D: usize> {
    plan: &'a GridPlan<D>,
    /// Velocities and masses of each field.
    fields: Vec<&'a NodeFields<D>>,
    /// Volumes of each field and their gradients, where the law asks for them.
    solids: &'a [Solids<D>],
    /// Nodes where bodies meet, by block.
    meets: &'a [u64],
    /// Smoothed gradients there.
    smoothed: Option<&'a Smoothed<D>>,
    /// Volumes of the basis functions of real nodes, m³ (in plane strain m²).
    hats: &'a [f64],
    contacts: &'a BodyContacts,
    coordinates: Coordinates,
    /// Whether normal forces are needed.
    finds_forces: bool,
    lengths: Lengths,
}

impl<const D: usize> Press<'_, D> {
    /// Contact at these nodes of a block, where bodies meet.
    fn block(&self, block: usize, nodes: u64) -> Pressed<D> {
        let first = block * block_nodes(D);
        let mut pressed = Pressed::default();
        let mut bodies: Vec<Body<D>> = Vec::new();
        for bit in bits(nodes) {
            let node = first + bit as usize;
            let fields = self.fields.iter().enumerate().filter(|(_, fields)| fields.active[block]);
            let rows = fields.map(|(field, fields)| (field, fields.rows[node].0));
            bodies.clear();
            bodies.extend(rows.filter(|(_, row)| row[3] > 0.0).map(|(field, row)| Body {
                field,
                mass: row[3],
                velocity: std::array::from_fn(|a| row[a]),
                pressed: [0.0; 2],
            }));
            let is_counted = self.plan.blocks[block].owned >> bit & 1 == 1;
            if bodies.len() > 1 && self.node(node, &mut bodies, is_counted, &mut pressed.booked) {
                let new = bodies.iter().map(|body| (node, body.field, body.velocity));
                pressed.velocities.extend(new);
            }
            if self.finds_forces {
                let cell = self.plan.cell(self.plan.blocks[block].level);
                // The hat of a node on the axis has its mean at a third of a cell, and half the width.
                let x = self.plan.node_place(&self.plan.blocks[block], bit as usize)[0].max(cell / 6.0);
                let least = LEAST_AREA * self.coordinates.face_area::<D>(cell, x);
                let new = bodies.iter().filter(|body| body.pressed[1] >= least);
                pressed.forces.extend(new.map(|body| {
                    let [force, area] = body.pressed;
                    NormalForce { node, field: body.field, force, area }
                }));
            }
        }
        pressed
    }

    /// Applies the contact of bodies at a node, pair by pair. Adds impulse and work to the sums if the node
    /// is counted. Returns whether any velocity changes.
    fn node(
        &self,
        node: usize,
        bodies: &mut [Body<D>],
        is_counted: bool,
        booked: &mut Vec<Booked<D>>,
    ) -> bool {
        let mut is_pressed = false;
        for sweep in 0..if bodies.len() > 2 { SWEEPS } else { 1 } {
            for a in 0..bodies.len() {
                for b in a + 1..bodies.len() {
                    let pair = self.contacts.pair([bodies[a].field, bodies[b].field]);
                    let exchange = self.exchange(node, [bodies[a], bodies[b]], pair);
                    let Some(Exchange { impulse, pressed }) = exchange else { continue };
                    let [force, area] = pressed;
                    for body in [a, b] {
                        bodies[body].pressed[0] += force;
                        bodies[body].pressed[1] += if sweep == 0 { area } else { 0.0 };
                    }
                    if impulse == [0.0; D] {
                        continue;
                    }
                    for k in 0..D {
                        bodies[a].velocity[k] -= impulse[k] / bodies[a].mass;
                        bodies[b].velocity[k] += impulse[k] / bodies[b].mass;
                    }
                    is_pressed = true;
                    let Some(pair) = pair.filter(|_| is_counted) else { continue };
                    let after: [f64; D] =
                        std::array::from_fn(|k| bodies[b].velocity[k] - bodies[a].velocity[k]);
                    let work = (0..D).map(|k| impulse[k] * after[k]).sum();
                    let impulse = if pair.turned { impulse } else { impulse.map(|j| -j) };
                    booked.push(Booked { contact: pair.contact, impulse, work });
                }
            }
        }
        is_pressed
    }

    /// Impulse and normal force between two bodies at a node. `None` where no surface between them is known.
    fn exchange(&self, node: usize, bodies: [Body<D>; 2], pair: Option<&Pair>) -> Option<Exchange<D>> {
        let [first, second] = bodies;
        let relative = std::array::from_fn(|a| first.velocity[a] - second.velocity[a]);
        let masses = [first.mass, second.mass];
        let law = pair.map_or(PairLaw::Sticky, |pair| pair.law);
        let plan = self.plan;
        let cell = plan.cell(plan.blocks[node / block_nodes(D)].level);
        if law == PairLaw::Sticky {
            let anywhere = Meeting { normal: [0.0; D], gap: 0.0, area: 0.0 };
            let impulse = law.impulse(&relative, masses, &anywhere, cell, self.lengths);
            return Some(Exchange { impulse, pressed: [0.0; 2] });
        }
        let sums = bodies.map(|body| {
            let row = self.solids[body.field].field.nodes.rows[node].0;
            (std::array::from_fn(|a| row[a]), row[3])
        });
        let (block, bit) = (node / block_nodes(D), (node % block_nodes(D)) as u32);
        let fields = bodies.map(|body| body.field);
        let smooth = self.smoothed?.between(block, bit, self.meets[block], fields);
        let meeting = Meeting::new(sums, smooth, self.hats[node], cell, plan.faces_at(node))?;
        let impulse = law.impulse(&relative, masses, &meeting, cell, self.lengths);
        let along = (0..D).fold(0.0, |sum, a| impulse[a].mul_add(meeting.normal[a], sum));
        Some(Exchange { impulse, pressed: [along / self.lengths.kick, meeting.area] })
    }
}
