//! Unknowns of a load step: displacements of real nodes with material, and what holds them.
//!
//! Each rank has all nodes that its particles reach, and computes the same numbers for them as every other
//! rank; in sums each node counts once, on the rank that owns it. Tied nodes move with the corners of their
//! ties, `u_j = Σ P_r u_r`, and pass their forces to these with the same weights, as far as nothing holds
//! them.
use partition::MAX_LEVEL;
use partition::comm::Comm;

use super::held::{Along, Held, Holder, Wall, without};
use crate::boundary::Contact;
use crate::boundary::motion::Rate;
use crate::exact_sum::ExactSum;
use crate::grid::mask::{bits, block_nodes, node_of_bit};
use crate::grid::ties::Tied;
use crate::kernel::{BLOCK, Coordinates};
use crate::load::Kind;
use crate::quantity::in_job;
use crate::solver::physics::Physics;
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::inside::{Asked, Inside, dot};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// One vector for each node.
pub(super) type Nodal<const D: usize> = Vec<[f64; D]>;

/// Two such vectors.
type Pair<'a, const D: usize> = (&'a [[f64; D]], &'a [[f64; D]]);

/// Mass of a node, over that of the heaviest around, below which it moves with this one. Nodes at jumps of
/// the level that meet the surface have no other tie, and left free they take multigrid half as many
/// iterations more.
const SLIVER: f64 = 0.03;

/// The same for bodies of revolution, where nodes on the axis have little mass and are not loose: with the
/// share above a cavity in clay finds no equilibrium.
const SLIVER_OF_RINGS: f64 = 1e-4;
/// No unknown.
const NONE: u32 = u32::MAX;

/// The nodes of a load step.
pub(super) struct Unknowns<const D: usize> {
    /// Rows of the nodes.
    pub(super) nodes: Vec<u32>,
    /// Whether this rank counts them.
    pub(super) owned: Vec<bool>,
    /// Displacements along axes that nothing releases in the step.
    pub(super) fixed: Vec<[Option<Held>; D]>,
    /// Walls that hold more, those of a node one after the other.
    pub(super) walls: Vec<Wall<D>>,
    /// Prescribed displacements along axes, with those of walls.
    pub(super) held: Vec<[Option<Held>; D]>,
    /// Nodes with displacements that are prescribed along other directions, in the order of their numbers:
    /// unit vectors at right angles to each other and to what is held along axes.
    pub(super) turned: Vec<(usize, Vec<Along<D>>)>,
    /// Tied nodes with their corners, by number.
    ties: Vec<(usize, Vec<(usize, f64)>)>,
    /// Masses of the nodes, kg.
    pub(super) masses: Vec<f64>,
    /// Places of the nodes, m.
    pub(super) places: Vec<[f64; D]>,
    /// Edges of the cells at the nodes, m.
    pub(super) cells: Vec<f64>,
    /// Places, and edges of the cells, in edges of the finest cells of all.
    pub(super) lattice: Vec<([i64; D], i64)>,
}

impl<const D: usize> Unknowns<D> {
    /// No nodes.
    pub(super) fn empty() -> Self {
        Self {
            nodes: Vec::new(),
            owned: Vec::new(),
            fixed: Vec::new(),
            walls: Vec::new(),
            held: Vec::new(),
            turned: Vec::new(),
            ties: Vec::new(),
            masses: Vec::new(),
            places: Vec::new(),
            cells: Vec::new(),
            lattice: Vec::new(),
        }
    }

    /// Ties nodes that hardly any material reaches, and that have no tie so far, to the heaviest node around.
    /// Left free, they would move without end to relieve the little stress that they bear.
    fn tie_slivers(&mut self, coordinates: Coordinates) {
        let least = match coordinates {
            Coordinates::Cartesian => SLIVER,
            Coordinates::Axisymmetric => SLIVER_OF_RINGS,
        };
        let tied = self.tied();
        let places = self.lattice.iter().zip(0..).map(|(place, number)| (*place, number));
        let numbers: FxHashMap<([i64; D], i64), usize> = places.collect();
        let slivers = (0..self.nodes.len()).filter(|&node| !tied[node]).filter_map(|node| {
            let (place, edge) = self.lattice[node];
            let around = (0..3_usize.pow(D as u32)).filter_map(|offset| {
                let along = |a: usize| (offset / 3_usize.pow(a as u32) % 3) as i64 - 1;
                let beside = std::array::from_fn(|a| place[a] + edge * along(a));
                numbers.get(&(beside, edge)).copied().filter(|&other| !tied[other])
            });
            let heaviest =
                around.max_by(|&a, &b| self.masses[a].total_cmp(&self.masses[b]).then(b.cmp(&a)))?;
            (self.masses[node] < least * self.masses[heaviest]).then_some((node, heaviest))
        });
        let slivers: Vec<(usize, usize)> = slivers.collect();
        let mut leads: Vec<usize> = (0..self.nodes.len()).collect();
        slivers.iter().for_each(|&(node, heaviest)| leads[node] = heaviest);
        // Masses grow from lead to lead.
        self.ties.extend(slivers.iter().map(|&(node, mut lead)| {
            while leads[lead] != lead {
                lead = leads[lead];
            }
            (node, vec![(lead, 1.0)])
        }));
    }

    /// Tied nodes, by number, with the corners that they follow and the weights of these.
    pub(super) fn ties(&self) -> &[(usize, Vec<(usize, f64)>)] {
        &self.ties
    }

    /// Of a node itself, or the corners that it follows, with shares that bound a stiffness at it.
    pub(super) fn leaders(&self) -> impl Fn(usize) -> Vec<(usize, f64)> {
        let ties: FxHashMap<usize, &[(usize, f64)]> =
            self.ties.iter().map(|(node, corners)| (*node, corners.as_slice())).collect();
        move |node| match ties.get(&node) {
            None => vec![(node, 1.0)],
            Some(corners) => {
                let all: f64 = corners.iter().map(|(_, weight)| weight.abs()).sum();
                corners.iter().map(|&(corner, weight)| (corner, all * weight.abs())).collect()
            }
        }
    }

    /// Shares a force on tied nodes out to their corners.
    pub(super) fn gather_ties(&self, forces: &mut [[f64; D]]) {
        for (node, corners) in &self.ties {
            let held = self.along_turned(*node, &forces[*node]);
            for a in (0..D).filter(|&a| self.held[*node][a].is_none()) {
                let force = std::mem::replace(&mut forces[*node][a], held[a]) - held[a];
                for &(corner, weight) in corners {
                    forces[corner][a] = weight.mul_add(force, forces[corner][a]);
                }
            }
        }
    }

    /// Stiffness of tied nodes, N/m, goes to the corners; theirs is not used.
    pub(super) fn gather_stiffness(&self, stiffness: &mut [f64]) {
        for (node, corners) in &self.ties {
            for &(corner, weight) in corners {
                stiffness[corner] = (weight * weight).mul_add(stiffness[*node], stiffness[corner]);
            }
        }
    }

    /// Gives tied nodes the displacement of their ties.
    pub(super) fn spread_ties(&self, way: &mut [[f64; D]]) {
        for (node, corners) in &self.ties {
            let before = way[*node];
            for a in (0..D).filter(|&a| self.held[*node][a].is_none()) {
                let plane =
                    corners.iter().fold(0.0, |sum, &(corner, w)| f64::mul_add(w, way[corner][a], sum));
                way[*node][a] = plane;
            }
            if let Some(turned) = self.turned_at(*node) {
                for (along, _) in turned {
                    let off = dot(along, &before) - dot(along, &way[*node]);
                    (0..D).for_each(|a| way[*node][a] = off.mul_add(along[a], way[*node][a]));
                }
            }
        }
    }

    /// Conditions of a node that are not along axes.
    fn turned_at(&self, node: usize) -> Option<&[Along<D>]> {
        let found = self.turned.binary_search_by_key(&node, |(node, _)| *node).ok()?;
        Some(&self.turned[found].1)
    }

    /// The part of a vector at a node along these.
    pub(super) fn along_turned(&self, node: usize, vector: &[f64; D]) -> [f64; D] {
        let mut part = [0.0; D];
        for (along, _) in self.turned_at(node).into_iter().flatten() {
            let size = dot(along, vector);
            (0..D).for_each(|a| part[a] = size.mul_add(along[a], part[a]));
        }
        part
    }

    /// Sets to 0 what is held, and tied nodes.
    pub(super) fn mask(&self, values: &mut [[f64; D]]) {
        for (value, held) in values.iter_mut().zip(&self.held) {
            (0..D).filter(|&a| held[a].is_some()).for_each(|a| value[a] = 0.0);
        }
        for (node, turned) in &self.turned {
            values[*node] = turned.iter().fold(values[*node], |value, (along, _)| without(&value, along));
        }
        self.ties.iter().for_each(|(node, _)| values[*node] = [0.0; D]);
    }

    /// Greatest displacement along an axis of any node of this rank, in cells.
    pub(super) fn greatest_way(&self, way: &[[f64; D]]) -> f64 {
        let owned = way.iter().zip(&self.cells).zip(&self.owned).filter(|(_, owned)| **owned);
        let along = owned.flat_map(|((way, cell), _)| way.iter().map(move |way| way.abs() / cell));
        along.fold(0.0, f64::max)
    }

    /// Collective. Place of the greatest of these forces, m; of equal ones the least coordinates.
    pub(super) fn worst(&self, comm: &Comm, forces: &[[f64; D]]) -> [f64; 3] {
        let square = |force: &[f64; D]| force.iter().map(|f| f * f).sum::<f64>();
        let greatest = comm.max_f64(forces.iter().map(square).fold(0.0, f64::max));
        let all = self.places.iter().zip(forces);
        let mut worst: Vec<&[f64; D]> =
            all.filter(|(_, force)| square(force) == greatest).map(|(x, _)| x).collect();
        let mut place = [0.0; 3];
        for a in 0..D {
            place[a] = comm.min_f64(worst.iter().map(|x| x[a]).fold(f64::INFINITY, f64::min));
            worst.retain(|x| x[a] == place[a]);
        }
        place
    }

    /// Whether each node is tied.
    pub(super) fn tied(&self) -> Vec<bool> {
        let mut tied = vec![false; self.nodes.len()];
        self.ties.iter().for_each(|(node, _)| tied[*node] = true);
        tied
    }

    /// Collective. Products of vectors over the nodes of all ranks, exact before they are rounded.
    pub(super) fn products<const N: usize>(&self, comm: &Comm, pairs: [Pair<'_, D>; N]) -> [f64; N] {
        let mut sums = pairs.map(|(a, b)| {
            let mut sum = ExactSum::new();
            for ((a, b), _) in a.iter().zip(b).zip(&self.owned).filter(|(_, owned)| **owned) {
                a.iter().zip(b).for_each(|(a, b)| sum.add(a * b));
            }
            sum
        });
        ExactSum::sum_over_ranks(comm, &mut sums);
        sums.map(|sum| sum.to_f64())
    }
}

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. The unknowns of a step of length `dt` (s): real nodes whose rows have
    /// mass.
    pub(super) fn unknowns(&mut self, rates: &[Rate<D>], dt: f64) -> Unknowns<D> {
        self.fill_cells(0);
        let (Grid { plan, fields, ties, .. }, physics) = (&mut self.grid, &self.physics);
        let (fields, nodes) = (&fields[0].nodes, block_nodes(D));
        let rows = &fields.rows;
        let mut unknowns = Unknowns::empty();
        let mut numbers = vec![NONE; rows.len()];
        let middle = 0.5f64.mul_add(dt, self.clock.time);
        let colliders = physics.colliders.iter().zip(&self.contacts.states).zip(rates).enumerate();
        let colliders: Vec<_> =
            colliders.filter(|(_, ((collider, _), _))| collider.acts_on_nodes()).collect();
        let active = plan.blocks.iter().enumerate().filter(|(index, _)| fields.active[*index]);
        for (index, block) in active {
            let filled = fields.with_mass(index, block.real_nodes(), 0.0);
            let inside: Vec<u64> = colliders
                .iter()
                .map(|(_, ((collider, state), _))| {
                    Inside::find(plan, block, filled, (collider, &state.pose), &[], Asked::NODES).nodes
                })
                .collect();
            for bit in bits(filled) {
                let node = index * nodes + bit as usize;
                let x = plan.node_place(block, bit as usize);
                let mut held = [None; D];
                physics.grip(&x, [self.clock.time, middle, dt], &mut held);
                for ((number, ((collider, state), rate)), inside) in colliders.iter().zip(&inside) {
                    if inside >> bit & 1 == 1 {
                        let way = collider.velocity_at(&x, &state.pose, rate).map(|v| dt * v);
                        let by = Holder::Collider(*number);
                        match law_of(collider.contact) {
                            None => held = way.map(|way| Some(Held { by, way })),
                            Some(law) => {
                                let normal = collider.normal(&x, &state.pose);
                                let at = (unknowns.nodes.len(), by);
                                unknowns.walls.push(Wall::new(at, normal, way, law));
                            }
                        }
                    }
                }
                physics.hold_at_faces(plan.faces_at(node), &mut held);
                for face in (0..2 * D).filter(|face| plan.faces_at(node) >> face & 1 == 1) {
                    let contact = physics.faces[face / 2][face % 2];
                    if let (Contact::Separating { .. }, Some(law)) = (contact, law_of(contact)) {
                        let inward = if face % 2 == 0 { 1.0 } else { -1.0 };
                        let normal = std::array::from_fn(|a| if a == face / 2 { inward } else { 0.0 });
                        let at = (unknowns.nodes.len(), Holder::Face(face));
                        unknowns.walls.push(Wall::new(at, normal, [0.0; D], law));
                    }
                }
                numbers[node] = unknowns.nodes.len() as u32;
                unknowns.nodes.push(node as u32);
                unknowns.owned.push(block.owned >> bit & 1 == 1);
                unknowns.fixed.push(held);
                unknowns.masses.push(rows[node].0[3]);
                unknowns.places.push(x);
                unknowns.cells.push(plan.cell(block.level));
                let edge = 1_i64 << (MAX_LEVEL - block.level);
                let corner = node_of_bit::<D>(bit);
                let along = |a: usize| i64::from(block.coord[a]) * BLOCK as i64 + i64::from(corner[a]);
                unknowns.lattice.push((std::array::from_fn(|a| edge * along(a)), edge));
            }
        }
        unknowns.hold_at_walls();
        if let Some(ties) = ties {
            let tied: Tied = ties.search(plan, fields, |_, _| 0);
            let number = |node: usize| numbers[node] as usize;
            let all = tied.iter().map(|(node, corners)| {
                (number(node), corners.iter().map(|c| (number(c.node), c.weight)).collect())
            });
            unknowns.ties = all.collect();
        }
        unknowns.tie_slivers(physics.coordinates);
        unknowns
    }
}

/// Friction of a surface, and whether material may leave it; none where it sticks.
fn law_of(contact: Contact) -> Option<(f64, bool)> {
    match contact {
        Contact::Separating { friction, .. } => Some((friction, true)),
        Contact::Slip | Contact::Symmetric => Some((0.0, false)),
        Contact::Sticky | Contact::Outflow | Contact::Absorbing => None,
    }
}

impl<const D: usize> Physics<D> {
    /// Displacements that loads prescribe at a place (m) in a step with this start, middle and length, s.
    fn grip(&self, x: &[f64; D], [start, middle, dt]: [f64; 3], held: &mut [Option<Held>; D]) {
        for (number, load) in self.loads.iter().enumerate() {
            let Kind::Velocity(prescribed) = &load.kind else { continue };
            if !load.is_active(start) || !load.reaches(x) {
                continue;
            }
            for (held, value) in held.iter_mut().zip(prescribed) {
                if let Some(value) = value {
                    let velocity = value.at(in_job(&load.origin, x), middle - load.start);
                    *held = Some(Held { by: Holder::Grip(number), way: dt * velocity });
                }
            }
        }
    }

    /// Displacements that the faces at a node prescribe, given the bits of the faces.
    fn hold_at_faces(&self, on: u8, held: &mut [Option<Held>; D]) {
        for (axis, side) in (0..D).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let face = 2 * axis + side;
            if on >> face & 1 == 0 {
                continue;
            }
            let hold = Some(Held { by: Holder::Face(face), way: 0.0 });
            match self.faces[axis][side] {
                Contact::Sticky => *held = [hold; D],
                Contact::Slip | Contact::Symmetric => held[axis] = hold,
                Contact::Separating { .. } | Contact::Outflow | Contact::Absorbing => {}
            }
        }
    }
}
