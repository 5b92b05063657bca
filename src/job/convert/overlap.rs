//! Finds bodies that overlap before a particle is made.
use crate::geometry::{Aabb, common_point};
use crate::job::Problem;

/// Boxes tested for all pairs (an overlap that is not found then is thin, and found when particles are made
/// if it matters to them), and pairs whose bounds are compared for each of them.
const TOTAL: usize = 1_000_000;
const BOUNDS_PER_BOX: usize = 20;

/// Two bodies that share a point.
pub(super) struct Overlap<const D: usize> {
    /// Indices of the bodies, the lower one first.
    pub bodies: [usize; 2],
    /// A point of both, relative to the domain's lower corner, m.
    pub point: [f64; D],
}

/// At most one overlap for each body, with the first body that it overlaps.
pub(in crate::job) fn find<const D: usize>(problem: &Problem<D>) -> Vec<Overlap<D>> {
    let bodies = &problem.bodies;
    // Bodies that touch may overlap by roundings; the lattice of particles does not see those.
    let slack = 1e-3 * problem.cell_edge(problem.finest_level());
    let domain = Aabb::new([0.0; D], problem.size());
    let bounds: Vec<Aabb<D>> = bodies.iter().map(|body| body.shape.bounds().intersection(&domain)).collect();
    let (mut boxes, mut pairs) = (TOTAL, TOTAL * BOUNDS_PER_BOX);
    let mut found = Vec::new();
    for second in 1..bodies.len() {
        for first in 0..second.min(pairs) {
            let common = bounds[first].intersection(&bounds[second]);
            if (0..D).any(|axis| common.upper[axis] - common.lower[axis] <= slack)
                || !problem.come_together(first, second)
            {
                continue;
            }
            if let Some(point) =
                common_point([&bodies[first].shape, &bodies[second].shape], common, slack, &mut boxes)
            {
                found.push(Overlap { bodies: [first, second], point });
                break;
            }
        }
        pairs -= second.min(pairs);
        if boxes == 0 || pairs == 0 {
            break;
        }
    }
    found
}
