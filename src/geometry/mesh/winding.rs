//! The generalised winding number of a surface around a point (Jacobson, Kavan and Sorkine-Hornung 2013).
//!
//! Solid angles of near triangles are exact (Van Oosterom and Strackee 1983); a distant group of triangles
//! counts by the first term of its expansion (Barill, Dickson, Schmidt, Levin and Jacobson 2018).

use crate::geometry::vector::{cross, dot};

/// Triangles of a group that is not divided.
const LEAST: usize = 8;

/// Distance from which a group counts as distant, in its radii.
const FAR: f64 = 3.0;

/// Triangles in a tree of groups.
pub(super) struct Winding {
    /// Corners, in the order of the groups.
    triangles: Vec<[[f64; 3]; 3]>,
    /// The root first; of those that are divided, the first half follows.
    groups: Vec<Group>,
}

struct Group {
    /// Its triangles.
    range: (usize, usize),
    /// The second half; 0 if it is not divided.
    second: usize,
    /// Mean of its triangles, weighted with their areas, m.
    centre: [f64; 3],
    /// Radius of the ball about the centre that contains it, m.
    radius: f64,
    /// Sum of the areas with their normals, m².
    area: [f64; 3],
}

impl Winding {
    pub(super) fn new(vertices: &[[f64; 3]], indices: &[[u32; 3]]) -> Self {
        let mut triangles: Vec<[[f64; 3]; 3]> =
            indices.iter().map(|corners| corners.map(|corner| vertices[corner as usize])).collect();
        let mut groups = Vec::new();
        let count = triangles.len();
        divide(&mut triangles, (0, count), &mut groups);
        Self { triangles, groups }
    }

    /// Whether the surface winds around a point, in either direction.
    pub(super) fn is_inside(&self, x: &[f64; 3]) -> bool {
        let mut angle = 0.0;
        let mut left = vec![0];
        while let Some(index) = left.pop() {
            let group = &self.groups[index];
            let way: [f64; 3] = std::array::from_fn(|a| group.centre[a] - x[a]);
            let distance = dot(way, way).sqrt();
            if distance > FAR * group.radius {
                angle += dot(way, group.area) / (distance * distance * distance);
            } else if group.second == 0 {
                let own = &self.triangles[group.range.0..group.range.1];
                angle += own.iter().map(|triangle| solid_angle(triangle, x)).sum::<f64>();
            } else {
                left.extend([group.second, index + 1]);
            }
        }
        angle.abs() > 2.0 * std::f64::consts::PI
    }
}

fn divide(all: &mut [[[f64; 3]; 3]], range: (usize, usize), groups: &mut Vec<Group>) {
    let triangles = &mut all[range.0..range.1];
    let middle = |triangle: &[[f64; 3]; 3]| -> [f64; 3] {
        std::array::from_fn(|a| (triangle[0][a] + triangle[1][a] + triangle[2][a]) / 3.0)
    };
    let (mut area, mut centre, mut weight) = ([0.0; 3], [0.0; 3], 0.0);
    let [mut lower, mut upper] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for triangle in triangles.iter() {
        let (normal, middle) = (scaled_normal(triangle), middle(triangle));
        let size = dot(normal, normal).sqrt();
        for a in 0..3 {
            area[a] += normal[a];
            centre[a] += size * middle[a];
            lower[a] = f64::min(lower[a], middle[a]);
            upper[a] = f64::max(upper[a], middle[a]);
        }
        weight += size;
    }
    let centre = centre.map(|c| c / if weight > 0.0 { weight } else { 1.0 });
    let corners = triangles.iter().flatten();
    let squares = corners.map(|x| {
        let way = std::array::from_fn(|a| x[a] - centre[a]);
        dot(way, way)
    });
    let radius = squares.fold(0.0, f64::max).sqrt();
    let own = groups.len();
    groups.push(Group { range, second: 0, centre, radius, area });
    if triangles.len() <= LEAST {
        return;
    }
    let longest =
        (0..3).max_by(|&a, &b| (upper[a] - lower[a]).total_cmp(&(upper[b] - lower[b]))).unwrap_or(0);
    // Stable, so that the order is that of the file where places are equal.
    triangles.sort_by(|a, b| middle(a)[longest].total_cmp(&middle(b)[longest]));
    let half = range.0 + triangles.len() / 2;
    divide(all, (range.0, half), groups);
    groups[own].second = groups.len();
    divide(all, (half, range.1), groups);
}

/// The normal with the length of the area, m².
fn scaled_normal([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    let [b, c]: [[f64; 3]; 2] = [b, c].map(|x| std::array::from_fn(|axis| x[axis] - a[axis]));
    cross(b, c).map(|component| 0.5 * component)
}

/// The solid angle under which a triangle is seen, positive from behind.
fn solid_angle(triangle: &[[f64; 3]; 3], x: &[f64; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| -> [f64; 3] { std::array::from_fn(|axis| corner[axis] - x[axis]) });
    let [la, lb, lc] = [a, b, c].map(|way| dot(way, way).sqrt());
    let above = dot(a, cross(b, c));
    let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    2.0 * libm::atan2(above, below)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ball, cube, points};
    use super::super::{Mesh, Triangles};

    /// Share of a raster in a box about the origin that is inside.
    fn volume(mesh: &Mesh, reach: f64) -> f64 {
        let n = 40;
        let at = |i: usize| reach * ((2 * i + 1) as f64 / n as f64 - 1.0);
        let all = (0..n * n * n).filter(|i| mesh.distance(&[at(i % n), at(i / n % n), at(i / n / n)]) < 0.0);
        all.count() as f64 * (2.0 * reach / n as f64).powi(3)
    }

    /// A closed ball has the same inside by winding number as by its normals.
    #[test]
    fn of_a_closed_surface_it_is_what_normals_say() {
        let (closed, wound) = (Mesh::new(ball(4)).unwrap(), Mesh::wound(ball(4)).unwrap());
        for x in points(1.2) {
            assert_eq!(closed.distance(&x), wound.distance(&x), "{x:?}");
        }
    }

    /// A ball without every fiftieth triangle, and with every seventh turned, has the ball's volume but for
    /// the holes.
    #[test]
    fn a_ball_with_holes_has_nearly_its_volume() {
        let mut torn = ball(4);
        let mut number = 0;
        torn.indices.retain_mut(|corners| {
            number += 1;
            if number % 7 == 0 {
                corners.swap(0, 1);
            }
            number % 50 != 0
        });
        assert!(Mesh::new(torn.clone()).is_err());
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        let mesh = Mesh::wound(torn.clone()).unwrap();
        let found = [mesh.volume(), volume(&mesh, 1.1)];
        assert!(found.iter().all(|v| (v / exact - 1.0).abs() < 0.015), "{found:?} {exact}");
    }

    /// A cube without its top is closed by a plane, and two cubes that overlap are their union.
    #[test]
    fn missing_sides_and_overlaps() {
        let mut open = cube();
        open.indices.retain(|corners| corners.iter().any(|&corner| corner < 4));
        assert_eq!(open.indices.len(), 10);
        let mesh = Mesh::wound(open).unwrap();
        assert!((mesh.volume() - 1.0).abs() < 1e-14);
        for x in points(0.6).map(|x| x.map(|c| c + 0.5)) {
            let exact = x.iter().fold(f64::NEG_INFINITY, |m: f64, c| m.max((c - 0.5).abs() - 0.5));
            assert_eq!(mesh.distance(&x) < 0.0, exact < 0.0, "{x:?}");
        }
        let (mut two, moved) = (cube(), cube());
        two.indices.extend(moved.indices.iter().map(|corners| corners.map(|corner| corner + 8)));
        two.vertices.extend(moved.vertices.iter().map(|x| x.map(|c| c + 0.5)));
        let union = Mesh::wound(two).unwrap();
        assert!(union.distance(&[0.75; 3]) < 0.0 && union.distance(&[0.25; 3]) < 0.0);
        assert!(union.distance(&[0.25, 0.25, 1.25]) > 0.0);
        let nothing = Triangles { vertices: cube().vertices, indices: vec![[0, 1, 2]] };
        assert!(Mesh::wound(nothing).is_err());
    }
}
