//! The part of a mesh in a box, from the triangles in the box and those above one of its edges.
//!
//! By the divergence theorem the integral of f over the part is that of F n₁ over its surface, with
//! F = ∫ f dx from the lower side of the box on. F vanishes on that side, and n₁ on the sides across y and z.
//! There remain the surface of the mesh in the box and the upper side across x, on which the same turns an
//! integral over an area into one over the curves in which the mesh meets the side, and over the edge at the
//! upper y. There, the points at which the mesh meets the line of this edge say what lies inside.
//!
//! A coordinate on a side counts as below it, always: the box is what lies a little above its lower sides and
//! up to a little above its upper sides. So triangles that lie on sides need no care.
use crate::geometry::moments::Sums;
use crate::geometry::{Aabb, Mesh};

type Point = [f64; 3];

/// Adds the integrals over the part of a mesh in a box. The mesh must be closed.
pub(super) fn add_to<const D: usize>(sign: f64, mesh: &Mesh, cell: &Aabb<D>, sums: &mut Sums<D>) {
    let corner = |x: &[f64; D]| -> Point { std::array::from_fn(|a| x[a % D]) };
    let part = part(mesh, &Aabb::new(corner(&cell.lower), corner(&cell.upper)));
    let own = Sums {
        origin: cell.lower,
        volume: part.volume,
        first: std::array::from_fn(|i| part.first[i % 3]),
        second: std::array::from_fn(|i| std::array::from_fn(|j| part.second[i % 3][j % 3])),
    };
    let axes = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    sums.add(sign, &own, &axes);
}

/// Integrals about the lower corner.
fn part(mesh: &Mesh, cell: &Aabb<3>) -> Sums<3> {
    let Aabb { lower, upper } = *cell;
    let local = |x: &Point| -> Point { std::array::from_fn(|a| x[a] - lower[a]) };
    let [u, v, _] = local(&upper);
    let mut sums = Sums::new(lower);
    // 1, y, z, y², yz, z² over the upper side across x; 1, z, z² over its edge at the upper y.
    let (mut side, mut edge) = ([0.0; 6], [0.0; 3]);
    for triangle in mesh.triangles_in(cell) {
        add_surface(&triangle, cell, &mut sums);
        if let Some([from, to]) = section(&triangle, upper[0])
            && let Some(ends) =
                clipped(clipped(Some([from, to]), 1, lower[1], upper[1]), 2, lower[2], upper[2])
        {
            add_curve(ends.map(|x| local(&x)), &mut side);
        }
    }
    let line =
        Aabb::new([upper[0], upper[1], lower[2]], [upper[0], upper[1], mesh.bounds().upper[2].max(upper[2])]);
    for triangle in mesh.triangles_in(&line) {
        let Some([from, to]) = section(&triangle, upper[0]) else { continue };
        let (sign, point) = match (from[1] <= upper[1], to[1] <= upper[1]) {
            (true, false) => (-1.0, at(&from, &to, 1, upper[1])),
            (false, true) => (1.0, at(&to, &from, 1, upper[1])),
            _ => continue,
        };
        let z = point[2].clamp(lower[2], upper[2]) - lower[2];
        let powers = [z, z * z / 2.0, z * z * z / 3.0];
        (0..3).for_each(|k| edge[k] += sign * powers[k]);
    }
    let [one, z, zz] = edge;
    let of_edge = [v * one, v * v / 2.0 * one, v * z, v * v * v / 3.0 * one, v * v / 2.0 * z, v * zz];
    (0..6).for_each(|k| side[k] += of_edge[k]);
    let [one, y, z, yy, yz, zz] = side;
    let (uu, uuu) = (u * u / 2.0, u * u * u / 3.0);
    add(
        &mut sums,
        1.0,
        &[u * one, uu * one, u * y, u * z, uuu * one, uu * y, uu * z, u * yy, u * yz, u * zz],
    );
    sums
}

/// Adds the integrals of 1, x, y, z, x², xy, xz, y², yz, z² with a weight.
fn add(sums: &mut Sums<3>, weight: f64, values: &[f64; 10]) {
    let [one, x, y, z, xx, xy, xz, yy, yz, zz] = values.map(|value| weight * value);
    sums.volume += one;
    let (first, second) = ([x, y, z], [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
    for i in 0..3 {
        sums.first[i] += first[i];
        (0..3).for_each(|j| sums.second[i][j] += second[i][j]);
    }
}

/// The part of a triangle in the box: a rule of third order over the fan of its polygon.
fn add_surface(triangle: &[Point; 3], cell: &Aabb<3>, sums: &mut Sums<3>) {
    let mut polygon = triangle.to_vec();
    for axis in 0..3 {
        polygon = beside(&polygon, axis, cell.upper[axis], true);
        polygon = beside(&polygon, axis, cell.lower[axis], false);
    }
    let local = |x: &Point| -> Point { std::array::from_fn(|a| x[a] - cell.lower[a]) };
    let Some(first) = polygon.first().map(local) else { return };
    for pair in polygon[1..].windows(2) {
        let [a, b, c] = [first, local(&pair[0]), local(&pair[1])];
        let area = 0.5 * ((b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]));
        if area == 0.0 {
            continue;
        }
        let mean = |points: &[Point]| -> Point {
            std::array::from_fn(|k| points.iter().map(|x| x[k]).sum::<f64>() / points.len() as f64)
        };
        for x in [a, b, c] {
            add(sums, area / 20.0, &inward(&x));
        }
        for ends in [[a, b], [b, c], [c, a]] {
            add(sums, area * 2.0 / 15.0, &inward(&mean(&ends)));
        }
        add(sums, area * 9.0 / 20.0, &inward(&mean(&[a, b, c])));
    }
}

/// Integrals of the monomials over x from the lower side to a point.
fn inward(&[x, y, z]: &Point) -> [f64; 10] {
    let (xx, xxx) = (x * x / 2.0, x * x * x / 3.0);
    [x, xx, x * y, x * z, xxx, xx * y, xx * z, x * y * y, x * y * z, x * z * z]
}

/// A piece of the curve in which the mesh meets the upper side across x, with the mesh to its left: the
/// integrals of the monomials over y, over it along z, by Simpson's rule, which is exact.
fn add_curve([from, to]: [Point; 2], side: &mut [f64; 6]) {
    let inward = |y: f64, z: f64| [y, y * y / 2.0, y * z, y * y * y / 3.0, y * y / 2.0 * z, y * z * z];
    let middle = inward(0.5 * (from[1] + to[1]), 0.5 * (from[2] + to[2]));
    let ends = [inward(from[1], from[2]), inward(to[1], to[2])];
    let length = (to[2] - from[2]) / 6.0;
    (0..6).for_each(|k| side[k] += length * (ends[0][k] + 4.0 * middle[k] + ends[1][k]));
}

/// The point at a coordinate between one that is not above it and one that is.
fn at(low: &Point, high: &Point, axis: usize, coordinate: f64) -> Point {
    let share = (coordinate - low[axis]) / (high[axis] - low[axis]);
    let mut point = std::array::from_fn(|a| share.mul_add(high[a] - low[a], low[a]));
    point[axis] = coordinate;
    point
}

/// The edge in which a triangle meets a plane across x, with the inside of the mesh to its left.
fn section(triangle: &[Point; 3], x: f64) -> Option<[Point; 2]> {
    let (mut from, mut to) = (None, None);
    for k in 0..3 {
        let (a, b) = (&triangle[k], &triangle[(k + 1) % 3]);
        match (a[0] <= x, b[0] <= x) {
            (true, false) => to = Some(at(a, b, 0, x)),
            (false, true) => from = Some(at(b, a, 0, x)),
            _ => {}
        }
    }
    Some([from?, to?])
}

/// The part of an edge between two coordinates along an axis.
fn clipped(edge: Option<[Point; 2]>, axis: usize, lower: f64, upper: f64) -> Option<[Point; 2]> {
    let [mut from, mut to] = edge?;
    for (bound, is_below) in [(upper, true), (lower, false)] {
        let (a, b) = (from, to);
        match ((a[axis] <= bound) == is_below, (b[axis] <= bound) == is_below) {
            (true, true) => {}
            (false, false) => return None,
            (is_in, _) => {
                let point = if a[axis] <= bound { at(&a, &b, axis, bound) } else { at(&b, &a, axis, bound) };
                *(if is_in { &mut to } else { &mut from }) = point;
            }
        }
    }
    Some([from, to])
}

/// The part of a polygon below or above a coordinate along an axis.
fn beside(polygon: &[Point], axis: usize, bound: f64, is_below: bool) -> Vec<Point> {
    let mut left = Vec::with_capacity(polygon.len() + 1);
    for (k, a) in polygon.iter().enumerate() {
        let b = &polygon[(k + 1) % polygon.len()];
        let [low, next] = [a, b].map(|x| x[axis] <= bound);
        if low == is_below {
            left.push(*a);
        }
        if low != next {
            left.push(if low { at(a, b, axis, bound) } else { at(b, a, axis, bound) });
        }
    }
    left
}
