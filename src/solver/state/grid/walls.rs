//! Nodes near surfaces that hold material back: faces of the domain, and colliders that act on nodes.
use rayon::prelude::*;

use super::inside::{Asked, Inside, InsideStill, is_still};
use crate::boundary::motion::Pose;
use crate::boundary::{Collider, Contact};
use crate::grid::GridPlan;
use crate::grid::mask::{arena_overlap, block_nodes, offset, offset_count};
use crate::grid::plan::NO_BLOCK;
use crate::grid::plan::needed_nodes::nodes_in_domain;
use crate::leapfrog::Lengths;

/// Where material may be held back on the nodes of one plan.
pub(in crate::solver) struct Walls {
    /// Of faces and of colliders that never move; `None` until it is asked for.
    pub still: Option<StillWalls>,
    /// Whether particles of any rank may be in reach of a surface in the next step.
    pub is_near: bool,
    /// Lengths of the step over which gaps are known, if they are known in this one.
    pub known_over: Option<Lengths>,
}

impl Default for Walls {
    fn default() -> Self {
        Self { still: None, is_near: true, known_over: None }
    }
}

/// Nodes near surfaces that never move.
pub(in crate::solver) struct StillWalls {
    /// These nodes and the constrained ones that hand sums to them, by block.
    pub nodes: Vec<u64>,
    /// By own leaf, whether the arenas of its bins hold any of them, or any node inside a collider.
    pub leaves: Vec<bool>,
}

impl StillWalls {
    /// Of a plan with these faces and colliders, of whose nodes `asked_of` says what is asked; finds what
    /// `known` lacks.
    pub(in crate::solver) fn find<const D: usize>(
        plan: &GridPlan<D>,
        faces: &[[Contact; 2]; D],
        colliders: &[Collider<D>],
        poses: &[Pose<D>],
        asked_of: impl Fn(&Collider<D>) -> Asked + Sync,
        known: &mut InsideStill<D>,
    ) -> Self {
        let mut nodes = vec![0; plan.blocks.len()];
        for &(node, on) in &plan.face_nodes {
            let mut sides = (0..2 * D).filter(|side| on >> side & 1 == 1);
            if sides.any(|side| faces[side / 2][side % 2].has_gap()) {
                nodes[node as usize / block_nodes(D)] |= 1 << (node as usize % block_nodes(D));
            }
        }
        known.resize_with(plan.blocks.len(), Vec::new);
        let mut all_inside = vec![0; plan.blocks.len()];
        let acts = |collider: &Collider<D>| collider.acts_on_nodes() && is_still(collider);
        let beside: Vec<_> = colliders.iter().zip(poses).filter(|(collider, _)| acts(collider)).collect();
        if !beside.is_empty() {
            let blocks = nodes.par_iter_mut().zip(&mut all_inside).zip(&plan.blocks).zip(known);
            blocks.with_min_len(32).for_each(|(((nodes, all_inside), block), known)| {
                known.resize_with(colliders.len(), || None);
                for ((collider, pose), known) in colliders.iter().zip(poses).zip(known) {
                    if acts(collider) {
                        let all = nodes_in_domain(&plan.tree, block.level, block.coord);
                        let find =
                            || Inside::find(plan, block, all, (collider, pose), &beside, asked_of(collider));
                        let inside = known.get_or_insert_with(find);
                        *nodes |= inside.near & block.real_nodes();
                        *all_inside |= inside.nodes;
                    }
                }
            });
        }
        let nodes = with_children(plan, &nodes);
        all_inside.iter_mut().zip(&nodes).for_each(|(all, nodes)| *all |= nodes);
        let leaves = leaves_in_reach(plan, &all_inside);
        Self { nodes, leaves }
    }
}

/// By own leaf, whether the arenas of its bins hold any of these nodes, which are given block by block.
fn leaves_in_reach<const D: usize>(plan: &GridPlan<D>, nodes: &[u64]) -> Vec<bool> {
    let overlaps: Vec<u64> = (0..offset_count(D)).map(|index| arena_overlap(offset::<D>(index))).collect();
    let mut leaves = vec![false; plan.leaf_start.len() - 1];
    for bin in &plan.bins {
        let mut around = bin.around.iter().zip(&overlaps).filter(|(block, _)| **block != NO_BLOCK);
        leaves[bin.leaf as usize] |= around.any(|(&block, overlap)| nodes[block as usize] & overlap != 0);
    }
    leaves
}

/// These nodes, and the constrained nodes of blocks that may hand sums to any of them.
pub(in crate::solver) fn with_children<const D: usize>(plan: &GridPlan<D>, nodes: &[u64]) -> Vec<u64> {
    let mut all = nodes.to_vec();
    for fine in plan.links.iter().flat_map(|links| &links.fine) {
        let parents = fine.parents.iter().filter_map(|&parent| all.get(parent as usize));
        if parents.into_iter().any(|&nodes| nodes != 0) {
            all[fine.block as usize] |= plan.blocks[fine.block as usize].constrained;
        }
    }
    all
}
