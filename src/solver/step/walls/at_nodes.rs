//! Nodes that colliders hold themselves, not at their feet.
//!
//! These are the nodes inside `sticky` colliders for solids that have come to the surface, those inside all
//! colliders for what yields, if a fluid moves with it or other surfaces have laws by area, and those behind
//! a surface that another collider covers or comes near to. Feet of both surfaces would be in one cell, and
//! if the colliders move against each other, no velocity of its corners obeys both.
use rayon::prelude::*;

use crate::boundary::motion::Rate;
use crate::boundary::{Bounds, Collider, ColliderState, Contact, Gap, gap};
use crate::exact_sum::ExactSum;
use crate::grid::mask::{bits, block_nodes};
use crate::kernel::{Coordinates, Row};
use crate::solver::state::Solver;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::inside::{Inside, Plane, SAME};
use crate::solver::state::phases::Phase;
use crate::solver::step::colliders::Touch;

/// Cosine of the angle between two surfaces above which they count as parallel.
const PARALLEL: f64 = 0.5;

/// Whether the surface of collider `number` that a node with cells of this edge (m) is behind faces that of
/// another within a cell, or is parallel to it inside the other.
pub(super) fn is_at_another<const D: usize>(
    colliders: &[Collider<D>],
    states: &[ColliderState<D>],
    number: usize,
    plane: &Plane<D>,
    cell: f64,
) -> bool {
    let mut others = colliders.iter().zip(states).enumerate();
    others.any(|(other, (collider, state))| {
        if other == number || !collider.acts_on_nodes() {
            return false;
        }
        let distance = collider.distance(&plane.foot, &state.pose);
        if distance >= cell {
            return false;
        }
        let normal = collider.normal(&plane.foot, &state.pose);
        let cosine = (0..D).fold(0.0, |sum, a| normal[a].mul_add(plane.normal[a], sum));
        cosine < -PARALLEL || (cosine > PARALLEL && distance < -SAME * cell)
    })
}

/// Demands of the surfaces of a `sticky` collider that the node of this bit at `x` (m), with cells of this
/// edge (m), is behind, if the material in its row of the sums has come to none of them; none too where no
/// surface is known.
fn open<const D: usize>(
    inside: &Inside<D>,
    bit: u32,
    x: &[f64; D],
    (sums, row): (&[Row], usize),
    cell: f64,
    of: Known,
) -> Vec<(Bounds, [f64; D])> {
    let planes = inside.planes.iter().filter(|plane| u32::from(plane.bit) == bit);
    let demands: Vec<_> = planes
        .map(|plane| {
            let slope = gap::slope(&sums[row].0, &plane.normal);
            let above = (0..D).fold(0.0, |sum, a| (x[a] - plane.foot[a]).mul_add(plane.normal[a], sum));
            let bend = of.coordinates.bend(plane.normal[0], cell, x[0]);
            let gap = gap::height(sums[row].0[3], slope, cell, bend).mul_add(cell, above);
            let full = gap::full_slope(of.coordinates.face_area::<D>(cell, x[0]), gap / cell);
            (Contact::Sticky.across(Gap::new(gap, slope, full), cell, of.over), plane.normal)
        })
        .collect();
    if demands.iter().any(|(bounds, _)| bounds.least == 0.0) { Vec::new() } else { demands }
}

impl<const D: usize> Solver<D> {
    /// Not collective. Applies the conditions of colliders, in their order, to the real nodes that they hold
    /// themselves, of the velocity field numbered `field`. Adds impulse and angular impulse on each from the
    /// nodes that this rank counts.
    pub(in crate::solver::step) fn hold_at_nodes(
        &mut self,
        field: usize,
        rates: &[Rate<D>],
        sums: &mut [[ExactSum; SUMS]],
    ) {
        let (physics, states) = (&self.physics, &self.contacts.states);
        let colliders = &physics.colliders;
        let on_nodes = || colliders.iter().filter(|collider| collider.acts_on_nodes());
        let at_feet = |collider: &Collider<D>| physics.acts_at_feet(field, collider);
        let is_any = on_nodes().count() > 1 || on_nodes().any(|collider| !at_feet(collider));
        let Some(lengths) = self.grid.walls.known_over.filter(|_| is_any) else { return };
        let of = Known {
            field,
            coordinates: physics.coordinates,
            over: lengths.drift,
            moves: physics.moves_over_gaps(field),
        };
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || {
            for touch in hold(grid, colliders, states, rates, of, at_feet) {
                touch.book(colliders, states, sums);
            }
        });
    }
}

/// Has the velocity of the node at `x` (m) obey a collider at a surface with this normal, within the bounds
/// that the gap asks for. Returns the impulse on the collider, kg m/s, if there is any.
pub(in crate::solver::step) fn obey<const D: usize>(
    row: &mut Row,
    x: &[f64; D],
    (collider, state, rate): (&Collider<D>, &ColliderState<D>, &Rate<D>),
    normal: &[f64; D],
    bounds: Bounds,
) -> Option<[f64; D]> {
    let surface = collider.velocity_at(x, &state.pose, rate);
    let before: [f64; D] = std::array::from_fn(|a| row.0[a]);
    let free: [f64; D] = std::array::from_fn(|a| before[a] - surface[a]);
    let mut relative = free;
    collider.contact.apply_within(bounds, &mut relative, normal);
    if relative == free {
        return None;
    }
    (0..D).for_each(|a| row.0[a] = surface[a] + relative[a]);
    Some(std::array::from_fn(|a| row.0[3] * (before[a] - row.0[a])))
}

/// Use of the sums at the nodes of a velocity field.
#[derive(Clone, Copy)]
struct Known {
    /// Number of the field.
    field: usize,
    coordinates: Coordinates,
    /// Length of the step, s.
    over: f64,
    /// Whether its material moves over gaps.
    moves: bool,
}

/// Applies the conditions; returns impulses in the order of the nodes.
fn hold<const D: usize>(
    grid: &mut Grid<D>,
    colliders: &[Collider<D>],
    states: &[ColliderState<D>],
    rates: &[Rate<D>],
    of: Known,
    at_feet: impl Fn(&Collider<D>) -> bool + Sync,
) -> Vec<Touch<D>> {
    let Grid { fields, inside_still, inside_moving, plan, solids, .. } = grid;
    let nodes = &mut fields[of.field].nodes;
    let gaps = of.moves.then(|| solids[of.field].at_walls());
    let all = [&*inside_still, &*inside_moving];
    let blocks = nodes.rows.par_chunks_mut(block_nodes(D)).zip(&plan.blocks).zip(&nodes.active);
    let active = blocks.enumerate().with_min_len(32).filter(|(_, (_, active))| **active);
    let touched = active.map(|(index, ((rows, block), _))| {
        let mut touches = Vec::new();
        for (number, (collider, (state, rate))) in colliders.iter().zip(states.iter().zip(rates)).enumerate()
        {
            let inside = all.iter().find_map(|inside| inside.get(index)?.get(number)?.as_ref());
            let Some(inside) = inside else { continue };
            let cell = plan.cell(block.level);
            let mut hold = |bit: u32, normal: &[f64; D], bounds: Bounds| {
                let row = &mut rows[bit as usize];
                if row.0[3] <= 0.0 || block.real_nodes() >> bit & 1 == 0 {
                    return;
                }
                let x = plan.node_place(block, bit as usize);
                let given = obey(row, &x, (collider, state, rate), normal, bounds);
                if let Some(impulse) = given.filter(|_| block.owned >> bit & 1 == 1) {
                    touches.push(Touch { collider: number, position: x, impulse });
                }
            };
            if collider.contact == Contact::Sticky && !at_feet(collider) {
                for bit in bits(inside.nodes) {
                    let row = index * block_nodes(D) + bit as usize;
                    let x = || plan.node_place(block, bit as usize);
                    let demands = gaps.map(|sums| open(inside, bit, &x(), (sums, row), cell, of));
                    match demands.filter(|demands| !demands.is_empty()) {
                        Some(demands) => demands.iter().for_each(|(bounds, n)| hold(bit, n, *bounds)),
                        // All of the velocity is held, whatever the normal is.
                        None => hold(bit, &[0.0; D], Bounds::TOUCHING),
                    }
                }
                continue;
            }
            if !at_feet(collider) {
                let mut normals = inside.normals.iter();
                for bit in bits(inside.nodes) {
                    let deep = inside.buried >> bit & 1 == 1;
                    let known = if deep { None } else { normals.next() };
                    let x = || plan.node_place(block, bit as usize);
                    let normal = known.copied().unwrap_or_else(|| collider.normal(&x(), &state.pose));
                    hold(bit, &normal, Bounds::TOUCHING);
                }
                continue;
            }
            for plane in &inside.planes {
                if is_at_another(colliders, states, number, plane, cell) {
                    hold(plane.bit.into(), &plane.normal, Bounds::TOUCHING);
                }
            }
        }
        touches
    });
    touched.collect::<Vec<_>>().into_iter().flatten().collect()
}
