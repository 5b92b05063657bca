//! Points of a collider that may touch something, in its place in the job.
use std::collections::BTreeMap;

use crate::boundary::Collider;
use crate::boundary::vector::{cross, dot, in_plane, length};
use crate::geometry::vector::in_space;
use crate::geometry::{Frustum, Mesh, Shape};

/// Parts of an edge of a box, of the height of a cylinder, and of the longest edge of the box around a
/// boolean.
const PARTS: usize = 8;
/// Cells along the longest edge of the box around a boolean, or a mesh of many vertices.
const CELLS: usize = 24;
/// Greatest number of vertices of a mesh of which all are used.
const MOST_VERTICES: usize = 1000;

/// A part of a surface that is nearest to another one at a point that can be found.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Feature<const D: usize> {
    /// A corner, or a point of a face.
    Point([f64; D]),
    /// A ball: its point in the direction of the other surface.
    Ball { centre: [f64; D], radius: f64 },
    /// The rim of a disc in space: its point in the direction of the other surface, and three more around.
    Rim { centre: [f64; 3], axis: [f64; 3], radius: f64 },
}

/// All of a collider.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features<const D: usize> {
    pub(super) all: Vec<Feature<D>>,
    /// Centre of a ball that holds them.
    pub(super) centre: [f64; 3],
    /// Its radius, m; infinite if the shape is unbounded.
    pub(super) radius: f64,
}

impl<const D: usize> Features<D> {
    /// Features of all colliders; none if no free body collides with others.
    pub fn of_all(colliders: &[Collider<D>]) -> Vec<Self> {
        let is_any =
            colliders.iter().any(|collider| collider.free().is_some_and(|free| free.meeting.is_some()));
        if is_any { colliders.iter().map(Self::of_collider).collect() } else { Vec::new() }
    }

    /// Features of a collider; none of a deforming one, whose contacts come from its distance alone.
    fn of_collider(collider: &Collider<D>) -> Self {
        match collider.deforming {
            Some(_) => Self { all: Vec::new(), centre: [0.0; 3], radius: f64::INFINITY },
            None => Self::of(&collider.shape),
        }
    }

    /// Features of a shape.
    pub fn of(shape: &Shape<D>) -> Self {
        let bounds = shape.bounds();
        let mut all = Vec::new();
        collect(shape, &|x| *x, &mut all);
        let is_bounded = bounds.lower.iter().chain(&bounds.upper).all(|c| c.is_finite());
        let radius = if is_bounded { bounds.half_diagonal() } else { f64::INFINITY };
        let centre = if is_bounded { in_space(&bounds.centre()) } else { [0.0; 3] };
        Self { all, centre, radius }
    }
}

/// Adds the features of a shape that is placed in space by `place`, a rotation about a point.
fn collect<const D: usize>(
    shape: &Shape<D>,
    place: &dyn Fn(&[f64; D]) -> [f64; D],
    all: &mut Vec<Feature<D>>,
) {
    match shape {
        Shape::Box(aabb) => {
            if aabb.lower.iter().chain(&aabb.upper).any(|c| !c.is_finite()) {
                return;
            }
            // Corners, and a lattice on the faces.
            let side = PARTS + 1;
            for index in 0..side.pow(D as u32) {
                let number: [usize; D] = std::array::from_fn(|a| index / side.pow(a as u32) % side);
                if number.iter().any(|&n| n == 0 || n == PARTS) {
                    let part = |a: usize| number[a] as f64 / PARTS as f64;
                    let x = std::array::from_fn(|a| {
                        part(a).mul_add(aabb.upper[a], (1.0 - part(a)) * aabb.lower[a])
                    });
                    all.push(Feature::Point(place(&x)));
                }
            }
        }
        Shape::Sphere { centre, radius } => {
            all.push(Feature::Ball { centre: place(centre), radius: *radius });
        }
        Shape::Frustum(frustum) => of_frustum(frustum, place, all),
        Shape::HalfSpace { .. } => {}
        Shape::Polygon(points) => {
            for (i, b) in points.iter().enumerate() {
                let a = points[(i + points.len() - 1) % points.len()];
                for part in 1..=PARTS {
                    let part = part as f64 / PARTS as f64;
                    let x = std::array::from_fn(|k| part.mul_add(b[k % 2], (1.0 - part) * a[k % 2]));
                    all.push(Feature::Point(place(&x)));
                }
            }
        }
        Shape::Mesh(mesh) => {
            all.extend(thinned(mesh).into_iter().map(|x| Feature::Point(place(&in_plane(&x)))));
        }
        Shape::Rotated(shape, placement) => collect(shape, &|x| place(&placement.to_space(x)), all),
        Shape::Union(parts) => parts.iter().for_each(|part| collect(part, place, all)),
        Shape::Intersection(_) | Shape::Difference(..) => on_surface(shape, place, all),
    }
}

/// Vertices of a mesh; if there are many, those farthest from its middle in each cell of a lattice.
fn thinned(mesh: &Mesh) -> Vec<[f64; 3]> {
    let vertices: Vec<[f64; 3]> = mesh.vertices().collect();
    if vertices.len() <= MOST_VERTICES {
        return vertices;
    }
    let bounds = mesh.bounds();
    let middle = bounds.centre();
    let longest = (0..3).map(|a| bounds.upper[a] - bounds.lower[a]).fold(0.0, f64::max);
    let cell = longest / CELLS as f64;
    let far = |x: &[f64; 3]| length(&std::array::from_fn::<f64, 3, _>(|a| x[a] - middle[a]));
    let mut cells = BTreeMap::new();
    for x in vertices {
        let key: [i64; 3] = std::array::from_fn(|a| ((x[a] - bounds.lower[a]) / cell).floor() as i64);
        let kept = cells.entry(key).or_insert(x);
        if far(&x) > far(kept) {
            *kept = x;
        }
    }
    cells.into_values().collect()
}

fn of_frustum<const D: usize>(
    frustum: &Frustum<D>,
    place: &dyn Fn(&[f64; D]) -> [f64; D],
    all: &mut Vec<Feature<D>>,
) {
    let Frustum { base, axis, height, lower_radius, upper_radius } = frustum;
    let at = |t: f64| -> [f64; D] { std::array::from_fn(|a| (t * height).mul_add(axis[a], base[a])) };
    let (low, high) = (in_space(&place(&at(0.0))), in_space(&place(&at(1.0))));
    for part in 0..=PARTS {
        let t = part as f64 / PARTS as f64;
        let radius = t.mul_add(upper_radius - lower_radius, *lower_radius);
        if D == 2 {
            // Perpendicular to the axis.
            let x = at(t);
            let across: [f64; D] = std::array::from_fn(|a| if a == 0 { -axis[1] } else { axis[0] });
            for sign in [-radius, radius] {
                let point = std::array::from_fn(|a| sign.mul_add(across[a], x[a]));
                all.push(Feature::Point(place(&point)));
            }
            continue;
        }
        let centre = in_space(&place(&at(t)));
        let way: [f64; 3] = std::array::from_fn(|a| high[a] - low[a]);
        let long = length(&way);
        all.push(Feature::Rim { centre, axis: way.map(|c| c / long), radius });
    }
}

/// Points of the surface of a boolean next to the centres of cells.
fn on_surface<const D: usize>(
    shape: &Shape<D>,
    place: &dyn Fn(&[f64; D]) -> [f64; D],
    all: &mut Vec<Feature<D>>,
) {
    let bounds = shape.bounds();
    if bounds.lower.iter().chain(&bounds.upper).any(|c| !c.is_finite()) {
        return;
    }
    let longest = (0..D).map(|a| bounds.upper[a] - bounds.lower[a]).fold(0.0, f64::max);
    let cell = longest / CELLS as f64;
    let side = CELLS + 1;
    for index in 0..side.pow(D as u32) {
        let number: [usize; D] = std::array::from_fn(|a| index / side.pow(a as u32) % side);
        let mut x: [f64; D] = std::array::from_fn(|a| (number[a] as f64).mul_add(cell, bounds.lower[a]));
        if shape.distance(&x).abs() > cell {
            continue;
        }
        for _ in 0..4 {
            let (distance, normal) = (shape.distance(&x), shape.gradient(&x));
            x = std::array::from_fn(|a| (-distance).mul_add(normal[a], x[a]));
        }
        if shape.distance(&x).abs() < 1e-3 * cell {
            all.push(Feature::Point(place(&x)));
        }
    }
}

/// Calls `take` with the points of a rim that are deepest in the direction `-normal`: the deepest first.
pub(super) fn points_of_rim(
    centre: &[f64; 3],
    axis: &[f64; 3],
    radius: f64,
    normal: &[f64; 3],
) -> [[f64; 3]; 4] {
    let along = dot(normal, axis);
    let mut way: [f64; 3] = std::array::from_fn(|a| along.mul_add(axis[a], -normal[a]));
    if length(&way) < 1e-9 {
        let least = (0..3).fold(0, |best, a| if axis[a].abs() < axis[best].abs() { a } else { best });
        way = cross(*axis, std::array::from_fn(|a| if a == least { 1.0 } else { 0.0 }));
    }
    let long = length(&way);
    let way = way.map(|c| c / long);
    let across = cross(*axis, way);
    let point =
        |c: f64, s: f64| std::array::from_fn(|a| radius.mul_add(c.mul_add(way[a], s * across[a]), centre[a]));
    [point(1.0, 0.0), point(0.0, 1.0), point(0.0, -1.0), point(-1.0, 0.0)]
}
