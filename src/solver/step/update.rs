//! Momentum on the nodes: velocities, gravity and the conditions on domain faces.
use rayon::prelude::*;

use crate::boundary::FaceCondition;
use crate::grid::mask::block_nodes;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::Row;

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
        let real = block.value & !block.constrained;
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

/// Applies the conditions of the domain's faces to the real nodes on them, axis by axis.
pub fn apply_faces<const D: usize>(
    fields: &mut NodeFields<D>,
    plan: &GridPlan<D>,
    faces: &[[FaceCondition; 2]; D],
) {
    for &(node, on) in
        plan.face_nodes.iter().filter(|(node, _)| fields.active[*node as usize / block_nodes(D)])
    {
        let row = &mut fields.rows[node as usize].0;
        let mut velocity: [f64; D] = std::array::from_fn(|axis| row[axis]);
        for axis in 0..D {
            for (side, inward) in [1.0, -1.0].into_iter().enumerate() {
                if on >> (2 * axis + side) & 1 == 1 {
                    faces[axis][side].apply(&mut velocity, axis, inward);
                }
            }
        }
        row[..D].copy_from_slice(&velocity);
    }
}
