//! Finds bodies that overlap before a particle is made.
use crate::geometry::{Aabb, Side};
use crate::job::problem::{Body, Problem};
use std::collections::VecDeque;

/// Boxes looked at for one pair of bodies. What is not found then is thin, and found when the
/// particles are made if it matters to them.
const BUDGET: usize = 20_000;

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
    (1..bodies.len())
        .filter_map(|second| {
            (0..second).find_map(|first| {
                let point = common_point(&bodies[first], &bodies[second], &problem.size(), slack)?;
                Some(Overlap { bodies: [first, second], point })
            })
        })
        .collect()
}

fn common_point<const D: usize>(a: &Body<D>, b: &Body<D>, size: &[f64; D], slack: f64) -> Option<[f64; D]> {
    let domain = Aabb::new([0.0; D], *size);
    let common = a.shape.bounds().intersection(&b.shape.bounds()).intersection(&domain);
    let mut queue = VecDeque::from([common]);
    for _ in 0..BUDGET {
        let cell = queue.pop_front()?;
        if (0..D).any(|axis| cell.upper[axis] - cell.lower[axis] <= slack) {
            continue;
        }
        if [a, b].iter().any(|body| body.shape.classify(&cell) == Side::Outside) {
            continue;
        }
        let centre = cell.centre();
        if [a, b].iter().all(|body| body.shape.distance(&centre) < -slack) {
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
