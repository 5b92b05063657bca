//! Space at nodes that colliders occupy.
use crate::boundary::{Collider, ColliderState};
use crate::geometry::Aabb;
use crate::grid::GridPlan;
use crate::grid::mask::{bits, block_nodes};
use crate::grid::plan::Block;
use crate::kernel::BLOCK;
use crate::solver::state::inside::is_still;
use crate::solver::state::node_fill::OpenShares;

/// Adds the shares of basis functions inside colliders to the fill of the real nodes of a block. `still` has
/// the known shares of colliders that never move.
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
        .for_each(|(value, open)| *value += 1.0 - open);
}

/// Subtracts the share inside a collider from the open shares of a block, which are all 1 if empty.
fn cut<const D: usize>(
    plan: &GridPlan<D>,
    block: &Block<D>,
    (collider, state): (&Collider<D>, &ColliderState<D>),
    open: &mut OpenShares,
) {
    let cell = plan.cell(block.level);
    let edge = BLOCK as u32;
    let nodes = Aabb::new(
        block.coord.map(|c| f64::from(edge * c) * cell),
        block.coord.map(|c| f64::from(edge * c + edge - 1) * cell),
    );
    if collider.distance_to_box(&nodes, &state.pose) >= cell {
        return;
    }
    open.0.resize(block_nodes(D), 1.0);
    for bit in bits(block.real_nodes()) {
        let x = plan.node_place(block, bit as usize);
        let distance = collider.distance(&x, &state.pose);
        if distance < cell
            && (collider.acts_on_nodes() || is_thick(collider, state, &x, distance, THICK * cell))
        {
            open.0[bit as usize] *= open_share(distance / cell);
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

/// Share of a hat function that lies outside a plane surface, which is that of an axis. Its centre is so many
/// cells outside.
fn open_share(distance: f64) -> f64 {
    let beyond = (1.0 - distance.abs()).max(0.0);
    let less = 0.5 * beyond * beyond;
    if distance < 0.0 { less } else { 1.0 - less }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_cuts_a_hat() {
        for (distance, share) in
            [(2.0, 1.0), (1.0, 1.0), (0.5, 0.875), (0.0, 0.5), (-0.5, 0.125), (-1.5, 0.0)]
        {
            assert_eq!(open_share(distance), share);
        }
    }
}
