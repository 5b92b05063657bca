//! Finds bodies that overlap before a particle is made.
use crate::geometry::{Aabb, Side};
use crate::job::problem::{Body, Problem};
use std::collections::VecDeque;

/// Boxes looked at for one pair of bodies. What is not found then is thin, and found when the
/// particles are made if it matters to them.
const BUDGET: usize = 20_000;
/// Boxes looked at for all pairs, and pairs whose bounds are compared for each of them.
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
            if (0..D).any(|axis| common.upper[axis] - common.lower[axis] <= slack) {
                continue;
            }
            if let Some(point) = common_point([&bodies[first], &bodies[second]], common, slack, &mut boxes) {
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

/// A point in `common` that lies in both bodies; takes the boxes that it looks at off `budget`.
fn common_point<const D: usize>(
    pair: [&Body<D>; 2],
    common: Aabb<D>,
    slack: f64,
    budget: &mut usize,
) -> Option<[f64; D]> {
    let mut queue = VecDeque::from([common]);
    for _ in 0..BUDGET.min(*budget) {
        let cell = queue.pop_front()?;
        *budget -= 1;
        if (0..D).any(|axis| cell.upper[axis] - cell.lower[axis] <= slack) {
            continue;
        }
        if pair.iter().any(|body| body.shape.classify(&cell) == Side::Outside) {
            continue;
        }
        let centre = cell.centre();
        if pair.iter().all(|body| body.shape.distance(&centre) < -slack) {
            return Some(centre);
        }
        queue.extend((0..1_usize << D).map(|corner| {
            let upper = |axis: usize| corner >> axis & 1 == 1;
            Aabb::new(
                std::array::from_fn(|axis| if upper(axis) { centre[axis] } else { cell.lower[axis] }),
                std::array::from_fn(|axis| if upper(axis) { cell.upper[axis] } else { centre[axis] }),
            )
        }));
    }
    None
}
