//! Gradients of signed distances: the outward normals of the surfaces.
use super::Shape;
use crate::geometry::vector::in_space;
use crate::geometry::{Aabb, Frustum};

impl<const D: usize> Shape<D> {
    /// Gradient of [`Shape::distance`]: a unit vector out of the shape, at every point of space. Where the
    /// distance has no gradient (equally near to two faces, at the centre of a ball) it is that of one of the
    /// nearest points.
    pub fn gradient(&self, x: &[f64; D]) -> [f64; D] {
        match self {
            Self::Box(aabb) => of_box(aabb, x),
            Self::Sphere { centre, .. } => {
                unit(std::array::from_fn(|a| x[a] - centre[a])).unwrap_or_else(last_axis)
            }
            Self::Frustum(frustum) => of_frustum(frustum, x),
            Self::HalfSpace { normal, .. } => *normal,
            Self::Polygon(points) => {
                let [gx, gy] = of_polygon(points, [x[0], x[1]], self.distance(x) < 0.0);
                std::array::from_fn(|a| [gx, gy, 0.0][a])
            }
            Self::Mesh(mesh) => {
                let normal = mesh.gradient(&in_space(x));
                std::array::from_fn(|a| normal[a])
            }
            Self::Rotated(shape, placement) => {
                let own = shape.gradient(&placement.to_own(x));
                std::array::from_fn(|i| {
                    (0..D).fold(0.0, |sum, j| placement.rotation[i][j].mul_add(own[j], sum))
                })
            }
            Self::Union(parts) => {
                first_best(parts, |part| -part.distance(x)).map_or_else(last_axis, |part| part.gradient(x))
            }
            Self::Intersection(parts) => {
                first_best(parts, |part| part.distance(x)).map_or_else(last_axis, |part| part.gradient(x))
            }
            Self::Difference(from, removed) => match first_best(removed, |part| -part.distance(x)) {
                Some(hole) if -hole.distance(x) > from.distance(x) => hole.gradient(x).map(|c| -c),
                _ => from.gradient(x),
            },
        }
    }
}

/// The first of the parts with the greatest value.
fn first_best<const D: usize>(parts: &[Shape<D>], value: impl Fn(&Shape<D>) -> f64) -> Option<&Shape<D>> {
    let mut best: Option<(&Shape<D>, f64)> = None;
    for part in parts {
        let value = value(part);
        if best.is_none_or(|(_, greatest)| value > greatest) {
            best = Some((part, value));
        }
    }
    best.map(|(part, _)| part)
}

fn last_axis<const D: usize>() -> [f64; D] {
    std::array::from_fn(|a| f64::from(u8::from(a + 1 == D)))
}

/// The vector over its length; `None` if it has none.
fn unit<const N: usize>(vector: [f64; N]) -> Option<[f64; N]> {
    let length = vector.iter().fold(0.0, |sum: f64, c| c.mul_add(*c, sum)).sqrt();
    (length > 0.0).then(|| vector.map(|c| c / length))
}

fn of_box<const D: usize>(aabb: &Aabb<D>, x: &[f64; D]) -> [f64; D] {
    // Per axis the greater of the two excesses, and the side it is of.
    let excess: [(f64, f64); D] = std::array::from_fn(|a| {
        let (below, above) = (aabb.lower[a] - x[a], x[a] - aabb.upper[a]);
        if below > above { (below, -1.0) } else { (above, 1.0) }
    });
    let outside = unit(excess.map(|(excess, side)| side * excess.max(0.0)));
    outside.unwrap_or_else(|| {
        let nearest = (1..D).fold(0, |best, a| if excess[a].0 > excess[best].0 { a } else { best });
        std::array::from_fn(|a| if a == nearest { excess[a].1 } else { 0.0 })
    })
}

fn of_frustum<const D: usize>(frustum: &Frustum<D>, x: &[f64; D]) -> [f64; D] {
    let Frustum { base, axis, height, lower_radius, upper_radius } = *frustum;
    let from_base: [f64; D] = std::array::from_fn(|a| x[a] - base[a]);
    let t = (0..D).fold(0.0, |sum, a| from_base[a].mul_add(axis[a], sum));
    let across: [f64; D] = std::array::from_fn(|a| (-t).mul_add(axis[a], from_base[a]));
    let r = across.iter().fold(0.0, |sum: f64, c| c.mul_add(*c, sum)).sqrt();
    let (foot, head) = ([lower_radius, 0.0], [upper_radius, height]);
    // Counter-clockwise around the profile; the axis is no surface.
    let profile = [([0.0, 0.0], foot), (foot, head), (head, [0.0, height])];
    let inside = Shape::Frustum(*frustum).distance(x) < 0.0;
    let [outward, along] = nearest_normal(profile.into_iter(), [r, t], inside);
    // On the axis all directions across it are equally near.
    let radial = unit(across).or_else(|| {
        let other = (0..D).fold(0, |best, a| if axis[a].abs() < axis[best].abs() { a } else { best });
        unit(std::array::from_fn(|a| f64::from(u8::from(a == other)) - axis[other] * axis[a]))
    });
    let radial = radial.unwrap_or([0.0; D]);
    std::array::from_fn(|a| outward.mul_add(radial[a], along * axis[a]))
}

fn of_polygon(points: &[[f64; 2]], q: [f64; 2], inside: bool) -> [f64; 2] {
    let n = points.len();
    let edges = || (0..n).map(|i| (points[i], points[(i + 1) % n]));
    let area: f64 = edges().map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum();
    if area >= 0.0 {
        nearest_normal(edges(), q, inside)
    } else {
        nearest_normal(edges().map(|(a, b)| (b, a)), q, inside)
    }
}

/// Gradient of the distance to the nearest of the edges, which run counter-clockwise around the inside.
/// Beside an edge it is the edge's normal, whose rounding does not grow near the surface; around a corner the
/// direction away from it.
fn nearest_normal(edges: impl Iterator<Item = ([f64; 2], [f64; 2])>, q: [f64; 2], inside: bool) -> [f64; 2] {
    let mut best = (f64::INFINITY, [0.0, 1.0]);
    for (a, b) in edges {
        let along = [b[0] - a[0], b[1] - a[1]];
        let Some(direction) = unit(along) else { continue };
        let square = along[0] * along[0] + along[1] * along[1];
        let fraction = ((q[0] - a[0]) * along[0] + (q[1] - a[1]) * along[1]) / square;
        let clamped = fraction.clamp(0.0, 1.0);
        let way = [q[0] - (a[0] + clamped * along[0]), q[1] - (a[1] + clamped * along[1])];
        let distance = way[0] * way[0] + way[1] * way[1];
        if distance < best.0 {
            let normal = [direction[1], -direction[0]];
            let sign = if inside { -1.0 } else { 1.0 };
            let gradient = if fraction == clamped {
                normal
            } else {
                unit(way).map_or(normal, |way| way.map(|c| sign * c))
            };
            best = (distance, gradient);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Placement, rotation};
    use proptest::prelude::*;

    fn shapes() -> Vec<Shape<3>> {
        let ball = Shape::Sphere { centre: [0.5, 0.4, 0.6], radius: 0.35 };
        let slab = Shape::Box(Aabb::new([0.2, 0.1, 0.3], [0.8, 0.9, 0.7]));
        let cone = Shape::Frustum(Frustum {
            base: [0.5, 0.5, 0.1],
            axis: [0.6, 0.0, 0.8],
            height: 0.7,
            lower_radius: 0.3,
            upper_radius: 0.1,
        });
        let half = Shape::HalfSpace { point: [0.5, 0.5, 0.5], normal: [0.6, 0.0, 0.8] };
        let turn = Placement { rotation: rotation([0.0, 0.6, 0.8], 0.7), pivot: [0.5; 3] };
        vec![
            ball.clone(),
            slab.clone(),
            cone.clone(),
            half.clone(),
            Shape::Rotated(Box::new(cone.clone()), turn),
            Shape::Union(vec![ball.clone(), cone.clone()]),
            Shape::Intersection(vec![ball.clone(), slab.clone(), half]),
            Shape::Difference(Box::new(slab), vec![ball, cone]),
        ]
    }

    /// A unit vector along which the distance grows at the rate 1.
    fn check<const D: usize>(shape: &Shape<D>, x: [f64; D]) -> Result<(), TestCaseError> {
        const STEP: f64 = 1e-7;
        let gradient = shape.gradient(&x);
        let length = gradient.iter().map(|c| c * c).sum::<f64>();
        prop_assert!((length - 1.0).abs() < 1e-12, "{shape:?} {x:?} {gradient:?}");
        let at = |t: f64| shape.distance(&std::array::from_fn(|a| t.mul_add(gradient[a], x[a])));
        // Near a discontinuity of the gradient one of the two sides has another nearest face.
        let (ahead, behind) = ((at(STEP) - at(0.0)) / STEP, (at(0.0) - at(-STEP)) / STEP);
        prop_assert!(ahead.max(behind) > 1.0 - 1e-6, "{shape:?} {x:?} {gradient:?} {ahead} {behind}");
        Ok(())
    }

    proptest! {
        #[test]
        fn gradients_are_of_the_distance(x in prop::array::uniform3(-0.2_f64..1.2)) {
            for shape in shapes() {
                check(&shape, x)?;
            }
        }

        #[test]
        fn gradients_of_polygons(x in prop::array::uniform2(-0.5_f64..2.5), backwards: bool) {
            let mut corners = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
            if backwards {
                corners.reverse();
            }
            check(&Shape::<2>::Polygon(corners), x)?;
        }
    }

    #[test]
    fn on_the_surface_normals_are_those_of_faces() {
        let slab = Shape::Box(Aabb::new([0.0, 0.0], [1.0, 1.0]));
        assert_eq!(slab.gradient(&[0.5, 1.0]), [0.0, 1.0]);
        assert_eq!(slab.gradient(&[0.0, 0.5]), [-1.0, 0.0]);
        let triangle = Shape::<2>::Polygon(vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
        assert_eq!(triangle.gradient(&[0.5, 0.0]), [0.0, -1.0]);
    }
}
