//! Nodes inside colliders.
use crate::boundary::Collider;
use rustc_hash::FxHashMap;

use crate::boundary::motion::{Motion, Pose};
use crate::geometry::Aabb;
use crate::grid::GridPlan;
use crate::grid::mask::bits;
use crate::grid::plan::Block;
use crate::kernel::BLOCK;

/// The nodes of one block that lie inside one collider.
#[derive(Clone, Debug, Default)]
pub(in crate::solver) struct Inside<const D: usize> {
    /// Their bits.
    pub nodes: u64,
    /// Outward unit normals there, in their order.
    pub normals: Vec<[f64; D]>,
}

/// Nodes inside colliders that never move, by block and collider: found once, on demand, since the distance
/// to a mesh or a terrain takes longer than all other work at a node.
pub(in crate::solver) type InsideStill<const D: usize> = Vec<Vec<Option<Inside<D>>>>;

/// Known nodes of blocks by place and real nodes, to carry them from one plan to the next.
pub(in crate::solver) struct KnownInside<const D: usize>(FxHashMap<Place<D>, Vec<Option<Inside<D>>>>);

/// Level and coordinate of a block, and its real nodes.
type Place<const D: usize> = (u8, [u32; D], u64);

fn place<const D: usize>(block: &Block<D>) -> Place<D> {
    (block.level, block.coord, block.real_nodes())
}

impl<const D: usize> KnownInside<D> {
    /// Known nodes of the blocks of a plan.
    pub(in crate::solver) fn of(plan: &GridPlan<D>, still: InsideStill<D>) -> Self {
        let known = plan.blocks.iter().zip(still).filter(|(_, still)| !still.is_empty());
        Self(known.map(|(block, still)| (place(block), still)).collect())
    }

    /// The known nodes that belong to the blocks of a plan.
    pub(in crate::solver) fn for_plan(mut self, plan: &GridPlan<D>) -> InsideStill<D> {
        if self.0.is_empty() {
            return Vec::new();
        }
        plan.blocks.iter().map(|block| self.0.remove(&place(block)).unwrap_or_default()).collect()
    }
}

impl<const D: usize> Inside<D> {
    /// Nodes inside among `nodes` of a block.
    pub(in crate::solver) fn find(
        plan: &GridPlan<D>,
        block: &Block<D>,
        nodes: u64,
        collider: &Collider<D>,
        pose: &Pose<D>,
    ) -> Self {
        let mut inside = Self::default();
        if collider.distance_to_box(&nodes_box(block, plan.cell(block.level)), pose) > 0.0 {
            return inside;
        }
        for bit in bits(nodes) {
            let x = plan.node_place(block, bit as usize);
            if collider.distance(&x, pose) <= 0.0 {
                inside.nodes |= 1 << bit;
                inside.normals.push(collider.normal(&x, pose));
            }
        }
        inside
    }
}

/// Whether a collider never moves while a grid is in use.
pub(in crate::solver) fn is_still<const D: usize>(collider: &Collider<D>) -> bool {
    matches!(collider.motion, Motion::Fixed) && collider.deforming.is_none()
}

/// The box that a block's nodes span.
fn nodes_box<const D: usize>(block: &Block<D>, cell: f64) -> Aabb<D> {
    let edge = BLOCK as u32;
    Aabb::new(
        block.coord.map(|c| f64::from(edge * c) * cell),
        block.coord.map(|c| f64::from(edge * c + edge - 1) * cell),
    )
}
