//! Space at nodes that colliders occupy.
use crate::boundary::{Collider, ColliderState};
use crate::grid::GridPlan;
use crate::grid::mask::{bits, block_nodes};
use crate::grid::plan::Block;
use crate::solver::state::grid::inside::is_still;
use crate::solver::state::grid::node_fill::OpenShares;

/// Refers the fill of the real nodes of a block to the space that colliders leave open at them. `still` has
/// the known open shares of colliders that never move.
pub(super) fn add_solids<const D: usize>(
    plan: &GridPlan<D>,
    block: &Block<D>,
    colliders: &[Collider<D>],
    states: &[ColliderState<D>],
    still: &mut Option<OpenShares>,
    values: &mut [f64],
) {
    let all = || colliders.iter().zip(states).filter(|(collider, _)| collider.is_present());
    let still = still.get_or_insert_with(|| {
        let mut open = OpenShares::default();
        all().filter(|(collider, _)| is_still(collider)).for_each(|of| cut(plan, block, of, &mut open));
        open
    });
    let moving = || all().filter(|(collider, _)| !is_still(collider));
    let mut own;
    let open = if moving().next().is_some() {
        own = still.clone();
        moving().for_each(|of| cut(plan, block, of, &mut own));
        &own
    } else {
        &*still
    };
    values
        .iter_mut()
        .zip(&open.0)
        .filter(|(value, _)| **value > 0.0)
        .for_each(|(value, open)| *value = fill_of_open::<D>(*value, *open));
}

/// Open share below which a node belongs to the inside of colliders. Those that act on particles leave as
/// much everywhere: contact keeps boxes outside, and to drive them off as well would compress the fluid.
const INSIDE: f64 = 0.005;

/// Excess over 1 of the fill of nodes inside colliders.
const EDGE: f64 = 0.5;

/// Excess of fill for each cell that a node lies deeper, beyond the first.
const RISE: f64 = 0.5;

/// Greatest excess by the material at a node with little open space, so that a particle among such nodes
/// follows the rise and not its own place between them.
const OWN: f64 = 0.25;

/// How full the open part of a basis function is, from how much of all of it the material fills.
///
/// Down to the share of an inner corner that lies on a node this is what a face of the domain there would
/// give. Were the space of colliders to count as full instead, the same excess of material would weigh less
/// at nodes of a wall than away from it, and shifts would drive fluid into walls. At nodes with less open
/// space the rest up to that share counts as full. Where none is open, the fill rises inwards from the
/// surface: a row of boxes that has sunk into a wall leaves no other node overfull, but must come out.
fn fill_of_open<const D: usize>(value: f64, open: f64) -> f64 {
    let (least, share) = (0.5f64.powi(D as i32), open.max(0.0));
    if share >= least {
        return value / share;
    }
    let inside = EDGE * (1.0 - share / INSIDE).max(0.0) - RISE * open.min(0.0);
    1.0 + ((value - share) / least).min(OWN) + inside
}

/// Subtracts the share inside a collider from the open shares of a block, which are all 1 if empty.
fn cut<const D: usize>(
    plan: &GridPlan<D>,
    block: &Block<D>,
    (collider, state): (&Collider<D>, &ColliderState<D>),
    open: &mut OpenShares,
) {
    let cell = plan.cell(block.level);
    if collider.distance_to_box(&plan.nodes_box(block), &state.pose) >= cell {
        return;
    }
    open.0.resize(block_nodes(D), 1.0);
    for bit in bits(block.real_nodes()) {
        let x = plan.node_place(block, bit as usize);
        let distance = collider.distance(&x, &state.pose);
        if distance < cell
            && (collider.acts_on_nodes() || is_thick(collider, state, &x, distance, THICK * cell))
        {
            let (known, own) = (&mut open.0[bit as usize], open_share(distance / cell));
            let own = if collider.acts_on_nodes() { own } else { own.max(INSIDE) };
            *known = if *known <= 0.0 || own <= 0.0 { known.min(own) } else { *known * own };
        }
    }
}

/// Depth below its surface, in cells, that a collider which acts on particles must have to count: behind
/// thinner walls and sheets there may be material too.
const THICK: f64 = 0.5;

/// Whether a collider is deeper than `depth` (m) below the point of its surface that is nearest to `x`, at
/// this distance.
fn is_thick<const D: usize>(
    collider: &Collider<D>,
    state: &ColliderState<D>,
    x: &[f64; D],
    distance: f64,
    depth: f64,
) -> bool {
    let normal = collider.normal(x, &state.pose);
    let below = std::array::from_fn(|a| (distance + depth).mul_add(-normal[a], x[a]));
    distance <= -depth || collider.distance(&below, &state.pose) < 0.0
}

/// Cells below the surface of a collider down to which depths count.
const DEEPEST: f64 = 4.0;

/// Share of a hat function that lies outside a plane surface, which is that of an axis. Its centre is so many
/// cells outside. Where nothing of it does, less than 0 by the cells between surface and hat.
fn open_share(distance: f64) -> f64 {
    if distance < -1.0 {
        return 1.0 + distance.max(-DEEPEST);
    }
    let beyond = (1.0 - distance.abs()).max(0.0);
    let less = 0.5 * beyond * beyond;
    if distance < 0.0 { less } else { 1.0 - less }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fills_the_open_part_is_full() {
        for open in [1.0, 0.5, 0.25, 0.1, 0.01] {
            approx::assert_relative_eq!(fill_of_open::<2>(open, open), 1.0);
            approx::assert_relative_eq!(fill_of_open::<3>(open, open), 1.0);
        }
        assert_eq!(fill_of_open::<2>(0.55, 0.5), 1.1);
        let deep = [0.0, -1.0, -2.0].map(|open| fill_of_open::<2>(0.01, open));
        assert_eq!(deep, [1.0 + 0.01 / 0.25 + EDGE, 1.04 + EDGE + RISE, 1.04 + EDGE + 2.0 * RISE]);
    }

    #[test]
    fn a_plane_cuts_a_hat() {
        for (distance, share) in
            [(2.0, 1.0), (1.0, 1.0), (0.5, 0.875), (0.0, 0.5), (-0.5, 0.125), (-1.5, -0.5)]
        {
            assert_eq!(open_share(distance), share);
        }
    }
}
