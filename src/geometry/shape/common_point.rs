//! Whether two shapes share a point.
use super::{Shape, Side};
use crate::geometry::Aabb;
use std::collections::VecDeque;

/// Boxes tested for one pair of shapes.
const BUDGET: usize = 20_000;

/// A point of the box `common` that lies deeper than `slack` (m) in both shapes. Subtracts the boxes that it
/// tests, at most twenty thousand, from `budget`; an overlap that it does not find is thin.
pub fn common_point<const D: usize>(
    pair: [&Shape<D>; 2],
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
        if pair.iter().any(|shape| shape.classify(&cell) == Side::Outside) {
            continue;
        }
        let centre = cell.centre();
        if pair.iter().all(|shape| shape.distance(&centre) < -slack) {
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
