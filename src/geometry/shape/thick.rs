//! Whether a solid is thick everywhere.
use super::{Shape, Side};
use crate::geometry::Aabb;

/// Most boxes that are tested.
const MOST: usize = 500_000;

/// Depths below the surface that are tested, as shares of the depth asked for.
const SHARES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

impl<const D: usize> Shape<D> {
    /// Whether all points down to this depth (m) below any point of the surface lie inside, as far as boxes
    /// of the edge `cell` (m) see it; of unbounded shapes in the box `domain`. False where that takes too
    /// long.
    pub fn is_thick(&self, domain: &Aabb<D>, depth: f64, cell: f64) -> bool {
        let bounds = self.bounds();
        let is_bounded = bounds.lower.iter().chain(&bounds.upper).all(|c| c.is_finite());
        // The surface lies in parts that reach beyond it, and on no face of one.
        let bounds = if is_bounded { bounds } else { bounds.intersection(&domain.grown(depth)) };
        let [below, above] = [0.41, 0.57].map(|share| share * cell);
        let mut boxes = vec![Aabb::new(bounds.lower.map(|c| c - below), bounds.upper.map(|c| c + above))];
        for _ in 0..MOST {
            let Some(part) = boxes.pop() else { return true };
            if self.classify(&part) != Side::Crosses {
                continue;
            }
            if (0..D).any(|a| part.upper[a] - part.lower[a] > cell) {
                boxes.extend(part.children());
            } else if !self.is_thick_below(&part, depth) {
                return false;
            }
        }
        false
    }

    /// The same at the surface in a small box, if it passes there.
    fn is_thick_below(&self, part: &Aabb<D>, depth: f64) -> bool {
        let (x, reach) = (part.centre(), part.half_diagonal());
        let distance = self.distance(&x);
        if distance.abs() > reach {
            return true;
        }
        let normal = self.gradient(&x);
        SHARES.iter().all(|share| {
            let way = share.mul_add(depth, distance);
            let below = std::array::from_fn(|a| (-way).mul_add(normal[a], x[a]));
            // Parts of a union that touch have a distance of 0 where they do.
            self.distance(&below) <= 1e-9 * depth
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(x: [f64; 2], y: [f64; 2]) -> Shape<2> {
        Shape::Box(Aabb::new([x[0], y[0]], [x[1], y[1]]))
    }

    /// A tank 1 m wide, with walls and a floor of this thickness, m.
    fn cup(thickness: f64) -> Shape<2> {
        let around = part([-thickness, 1.0 + thickness], [-thickness, 0.8]);
        Shape::Difference(Box::new(around), vec![part([0.0, 1.0], [0.0, 0.9])])
    }

    #[test]
    fn walls_are_as_thick_as_they_are() {
        let domain = Aabb::new([-1.0; 2], [2.0; 2]);
        let is_thick = |shape: &Shape<2>| shape.is_thick(&domain, 0.0625, 0.03125);
        assert!(is_thick(&cup(0.1)) && is_thick(&cup(0.07)));
        // Its bounding box is large.
        assert!(!is_thick(&cup(0.05)));
        let union = |low: f64| {
            let floor = part([-0.1, 1.1], [low, 0.0]);
            Shape::Union(vec![floor, part([-0.1, 0.0], [0.0, 0.8]), part([1.0, 1.1], [0.0, 0.8])])
        };
        assert!(is_thick(&union(-0.1)) && !is_thick(&union(-0.03)));
        let ball = |radius: f64| Shape::Sphere { centre: [0.5; 2], radius };
        assert!(is_thick(&ball(0.2)) && !is_thick(&ball(0.025)));
        let ground = Shape::HalfSpace { point: [0.0, 0.3], normal: [0.6, 0.8] };
        assert!(is_thick(&ground));
        // A sheet has no inside.
        assert!(!is_thick(&part([0.5, 0.5], [0.0, 0.5])));
    }
}
