//! Position of an axis-aligned box with respect to a shape.
use super::Shape;
use crate::geometry::{Aabb, Frustum};

/// The side of a shape's surface on which a box lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Every interior point of the box is in the shape.
    Inside,
    /// No interior point of the box is in the shape.
    Outside,
    /// Neither is certain.
    Crosses,
}

impl Side {
    fn of(inside: bool, outside: bool) -> Self {
        match (inside, outside) {
            (_, true) => Self::Outside,
            (true, false) => Self::Inside,
            (false, false) => Self::Crosses,
        }
    }
}

impl<const D: usize> Shape<D> {
    /// Classifies a box. `Inside` and `Outside` are certain; a box near the surface may get `Crosses`
    /// although it does not cross it. Exact for boxes, balls, half-spaces, upright cylinders, for the outside
    /// of their unions and for the inside of their intersections.
    pub fn classify(&self, cell: &Aabb<D>) -> Side {
        match self {
            Self::Box(aabb) => Side::of(
                (0..D).all(|a| aabb.lower[a] <= cell.lower[a] && cell.upper[a] <= aabb.upper[a]),
                (0..D).any(|a| cell.upper[a] <= aabb.lower[a] || aabb.upper[a] <= cell.lower[a]),
            ),
            Self::Sphere { centre, radius } => {
                let (near, far) = range_of_squares(cell, centre, |_| true);
                Side::of(far <= radius * radius, near >= radius * radius)
            }
            Self::HalfSpace { point, normal } => {
                let (low, high) = range_along(cell, point, normal);
                Side::of(high <= 0.0, low >= 0.0)
            }
            Self::Frustum(frustum) => match upright_axis(frustum) {
                Some(axis) if frustum.lower_radius == frustum.upper_radius => {
                    classify_upright(frustum, axis, cell)
                }
                _ => self.classify_by_distance(cell),
            },
            Self::Polygon(_) | Self::Mesh(_) | Self::Rotated(..) => self.classify_by_distance(cell),
            Self::Union(parts) => union(parts.iter().map(|s| s.classify(cell))),
            Self::Intersection(parts) => parts.iter().map(|s| s.classify(cell)).fold(Side::Inside, intersect),
            Self::Difference(from, removed) => match union(removed.iter().map(|s| s.classify(cell))) {
                Side::Inside => Side::Outside,
                Side::Outside => from.classify(cell),
                Side::Crosses => intersect(Side::Crosses, from.classify(cell)),
            },
        }
    }

    /// The distance is 1-Lipschitz, so the centre decides for the ball around it.
    fn classify_by_distance(&self, cell: &Aabb<D>) -> Side {
        // A polygon has no extent along a third axis; it exists only in 2D.
        let (distance, radius) = (self.distance(&cell.centre()), cell.half_diagonal());
        Side::of(distance <= -radius, distance >= radius)
    }
}

fn union(sides: impl Iterator<Item = Side>) -> Side {
    sides.fold(Side::Outside, |all, one| match (all, one) {
        (Side::Inside, _) | (_, Side::Inside) => Side::Inside,
        (Side::Outside, Side::Outside) => Side::Outside,
        _ => Side::Crosses,
    })
}

fn intersect(a: Side, b: Side) -> Side {
    match (a, b) {
        (Side::Outside, _) | (_, Side::Outside) => Side::Outside,
        (Side::Inside, Side::Inside) => Side::Inside,
        _ => Side::Crosses,
    }
}

/// Least and greatest squared distance of the box to `point`, over the axes that `counts` selects.
fn range_of_squares<const D: usize>(
    cell: &Aabb<D>,
    point: &[f64; D],
    counts: impl Fn(usize) -> bool,
) -> (f64, f64) {
    let (mut near, mut far) = (0.0, 0.0);
    for a in (0..D).filter(|&a| counts(a)) {
        let (below, above) = (cell.lower[a] - point[a], cell.upper[a] - point[a]);
        let gap = below.max(-above).max(0.0);
        near += gap * gap;
        let reach = below.abs().max(above.abs());
        far += reach * reach;
    }
    (near, far)
}

/// Least and greatest value of `(x - point) · direction` over the box.
fn range_along<const D: usize>(cell: &Aabb<D>, point: &[f64; D], direction: &[f64; D]) -> (f64, f64) {
    let (mut low, mut high) = (0.0, 0.0);
    for a in 0..D {
        let (p, q) = (direction[a] * (cell.lower[a] - point[a]), direction[a] * (cell.upper[a] - point[a]));
        low += p.min(q);
        high += p.max(q);
    }
    (low, high)
}

/// The coordinate axis that the frustum stands along, if it does.
fn upright_axis<const D: usize>(frustum: &Frustum<D>) -> Option<usize> {
    (0..D).find(|&a| frustum.axis[a].abs() == 1.0)
}

fn classify_upright<const D: usize>(frustum: &Frustum<D>, axis: usize, cell: &Aabb<D>) -> Side {
    let (low, high) = range_along(cell, &frustum.base, &frustum.axis);
    let (near, far) = range_of_squares(cell, &frustum.base, |a| a != axis);
    let square = frustum.lower_radius * frustum.lower_radius;
    Side::of(
        low >= 0.0 && high <= frustum.height && far <= square,
        high <= 0.0 || low >= frustum.height || near >= square,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Placement;
    use proptest::prelude::*;

    fn shapes() -> Vec<Shape<3>> {
        let ball = Shape::Sphere { centre: [0.5, 0.4, 0.6], radius: 0.35 };
        let slab = Shape::Box(Aabb::new([0.2, 0.1, 0.3], [0.8, 0.9, 0.7]));
        let upright = Frustum {
            base: [0.5, 0.5, 0.1],
            axis: [0.0, 0.0, 1.0],
            height: 0.7,
            lower_radius: 0.3,
            upper_radius: 0.3,
        };
        let cone = Shape::Frustum(Frustum { upper_radius: 0.0, axis: [0.6, 0.0, 0.8], ..upright });
        let half = Shape::HalfSpace { point: [0.5, 0.5, 0.5], normal: [0.6, 0.0, 0.8] };
        let (s, c) = (0.5, 0.75_f64.sqrt());
        let turn = Placement { rotation: [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], pivot: [0.5; 3] };
        vec![
            ball.clone(),
            slab.clone(),
            Shape::Frustum(upright),
            cone.clone(),
            half.clone(),
            Shape::Rotated(Box::new(slab.clone()), turn),
            Shape::Union(vec![ball.clone(), cone.clone()]),
            Shape::Intersection(vec![ball.clone(), slab.clone(), half]),
            Shape::Difference(Box::new(slab), vec![ball, cone]),
        ]
    }

    proptest! {
        /// A side of which the classification is sure is that of every point of the box.
        #[test]
        fn classification_is_conservative(
            lower in prop::array::uniform3(-0.2_f64..1.0),
            edge in 0.01_f64..0.4,
            points in prop::collection::vec(prop::array::uniform3(0.001_f64..0.999), 30),
        ) {
            let cell = Aabb::new(lower, lower.map(|c| c + edge));
            for shape in shapes() {
                let side = shape.classify(&cell);
                for point in &points {
                    let x: [f64; 3] = std::array::from_fn(|a| lower[a] + edge * point[a]);
                    match side {
                        Side::Inside => prop_assert!(shape.contains(&x), "{shape:?} {x:?}"),
                        Side::Outside => prop_assert!(!shape.contains(&x), "{shape:?} {x:?}"),
                        Side::Crosses => {}
                    }
                }
            }
        }

        /// Distances have the sign of membership, are 1-Lipschitz, and the bounds contain every point of the
        /// shape.
        #[test]
        fn distances_and_bounds(
            x in prop::array::uniform3(-0.2_f64..1.2),
            y in prop::array::uniform3(-0.2_f64..1.2),
        ) {
            let way = (0..3).map(|a| (x[a] - y[a]).powi(2)).sum::<f64>().sqrt();
            for shape in shapes() {
                let (dx, dy) = (shape.distance(&x), shape.distance(&y));
                prop_assert!((dx - dy).abs() <= way + 1e-12, "{shape:?}");
                prop_assert!(dx.abs() < 1e-12 || shape.contains(&x) == (dx < 0.0), "{shape:?}");
                let bounds = shape.bounds();
                let slack = 1e-12;
                prop_assert!(!shape.contains(&x)
                    || (0..3).all(|a| bounds.lower[a] - slack <= x[a] && x[a] <= bounds.upper[a] + slack));
            }
        }
    }

    #[test]
    fn boxes_that_only_touch_are_outside() {
        let cell = Aabb::new([0.5, 0.0], [1.0, 0.5]);
        assert_eq!(Shape::Box(Aabb::new([0.0, 0.0], [0.5, 1.0])).classify(&cell), Side::Outside);
        assert_eq!(Shape::Box(Aabb::new([0.5, 0.0], [2.0, 0.5])).classify(&cell), Side::Inside);
        assert_eq!(Shape::Sphere { centre: [0.0, 0.25], radius: 0.5 }.classify(&cell), Side::Outside);
    }

    #[test]
    fn polygon_inside_and_distance() {
        let shape =
            Shape::<2>::Polygon(vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]);
        assert!(shape.contains(&[0.5, 1.5]) && !shape.contains(&[1.5, 1.5]));
        assert_eq!(shape.distance(&[1.5, 1.25]), 0.25);
        assert_eq!(shape.distance(&[0.5, 0.25]), -0.25);
        assert_eq!(shape.bounds(), Aabb::new([0.0, 0.0], [2.0, 2.0]));
    }
}
