//! Closed triangle meshes as shapes.
//!
//! | file | what it does |
//! |---|---|
//! | `read` | STL, OBJ and PLY to triangles |
//! | `terrain` | rasters of heights to triangles |
//! | `solid` | checks that triangles bound a solid |
//! | this | signed distance and normal |
//!
//! The nearest point of the surface comes from the tree of `parry3d`, and the side from its angle-weighted normals (Baerentzen and Aanaes
//! 2005), which is exact at edges and corners. A raster of distances stands before it: away from the surface a point takes the bound that
//! its cell of the raster gives, so that what asks from afar does not search the tree.
use std::sync::Arc;

use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

use super::Aabb;
use super::primitives::box_distance;
use crate::checksum::fnv1a;

mod read;
mod solid;
mod terrain;

pub use read::{ReadError, Triangles, read};
pub use solid::NotSolid;
pub use terrain::Terrain;

/// Cells of the raster along the longest edge of the bounding box.
const RASTER: usize = 48;

/// A solid bounded by triangles.
#[derive(Clone)]
pub struct Mesh(Arc<Inner>);

/// The triangles.
struct Surface {
    surface: TriMesh,
    /// Not closed, so that nothing is inside.
    is_sheet: bool,
}

struct Inner {
    surface: Surface,
    bounds: Aabb<3>,
    raster: Raster,
    /// Checksum of vertices and triangles.
    checksum: u64,
    volume: f64,
}

/// Signed distances at the centres of the cells of a regular grid over the bounding box with a margin of a cell.
struct Raster {
    lower: [f64; 3],
    edge: f64,
    cells: [usize; 3],
    distances: Vec<f64>,
}

impl Mesh {
    /// The solid that triangles bound, m. Triangles that face inwards all together are turned.
    ///
    /// # Errors
    /// They bound none.
    pub fn new(triangles: Triangles) -> Result<Self, NotSolid> {
        Self::of(triangles, false)
    }

    /// The solid that triangles bound, or, where they are not closed, the sheet that they are: all its distances are positive.
    ///
    /// # Errors
    /// There is no triangle with an area, or a vertex is at no place.
    pub fn solid_or_sheet(triangles: Triangles) -> Result<Self, NotSolid> {
        Self::of(triangles, true)
    }

    fn of(triangles: Triangles, may_be_sheet: bool) -> Result<Self, NotSolid> {
        let Triangles { vertices, mut indices } = solid::merged(triangles)?;
        let volume = match solid::check(&vertices, &indices) {
            Ok(volume) => Some(volume),
            Err(NotSolid::Open { .. } | NotSolid::Turned(_) | NotSolid::Flat(_)) if may_be_sheet => None,
            Err(other) => return Err(other),
        };
        if volume.is_some_and(|volume| volume < 0.0) {
            indices.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let bounds = vertices.iter().fold(Aabb::EMPTY, |hull, x| hull.hull(&Aabb::new(*x, *x)));
        let words = vertices.iter().flatten().map(|x| x.to_bits());
        let words = words.chain(indices.iter().flatten().map(|&index| u64::from(index)));
        let checksum = fnv1a(words);
        let vertices = vertices.iter().map(|x| Vector::new(x[0], x[1], x[2])).collect();
        let flags = if volume.is_some() { TriMeshFlags::ORIENTED } else { TriMeshFlags::empty() };
        let surface = TriMesh::with_flags(vertices, indices, flags)
            .map_err(|error| NotSolid::Refused(error.to_string()))?;
        let surface = Surface { surface, is_sheet: volume.is_none() };
        let raster = Raster::new(&surface, &bounds);
        Ok(Self(Arc::new(Inner { surface, bounds, raster, checksum, volume: volume.unwrap_or(0.0).abs() })))
    }

    /// Its bounding box, m.
    pub fn bounds(&self) -> Aabb<3> {
        self.0.bounds
    }

    /// Its volume, m³; 0 of a sheet.
    pub fn volume(&self) -> f64 {
        self.0.volume
    }

    /// Checksum of its vertices and triangles.
    pub fn checksum(&self) -> u64 {
        self.0.checksum
    }

    /// Signed distance of a point to the surface, m, negative inside: exact within some cells of the raster from the surface, elsewhere a
    /// bound, not larger in magnitude and with the right sign.
    pub fn distance(&self, x: &[f64; 3]) -> f64 {
        if let Some(bound) = self.0.raster.bound(x) {
            return bound;
        }
        let outside = box_distance(&self.0.bounds, x);
        if outside > self.0.raster.edge {
            return outside;
        }
        nearest(&self.0.surface, x).0
    }

    /// Unit vector out of the solid: the gradient of the exact distance.
    pub fn gradient(&self, x: &[f64; 3]) -> [f64; 3] {
        let (distance, point) = nearest(&self.0.surface, x);
        let way: [f64; 3] = std::array::from_fn(|a| (x[a] - point[a]) * distance.signum());
        let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
        // On the surface the way has no direction.
        if length > 1e-12 * self.0.raster.edge {
            return way.map(|c| c / length);
        }
        self.face_normal(x)
    }

    /// Normal of the triangle nearest to a point.
    fn face_normal(&self, x: &[f64; 3]) -> [f64; 3] {
        let projection = self.0.surface.surface.project_local_point(Vector::new(x[0], x[1], x[2]), false);
        let normal = self.0.surface.surface.triangle(projection.subshape).scaled_normal();
        let length = (normal.x * normal.x + normal.y * normal.y + normal.z * normal.z).sqrt();
        if length > 0.0 { [normal.x / length, normal.y / length, normal.z / length] } else { [0.0, 0.0, 1.0] }
    }
}

/// Signed distance and the nearest point of the surface.
fn nearest(surface: &Surface, x: &[f64; 3]) -> (f64, [f64; 3]) {
    let Surface { surface, is_sheet } = surface;
    let projection = surface.project_local_point(Vector::new(x[0], x[1], x[2]), false);
    let point = [projection.point.x, projection.point.y, projection.point.z];
    let distance = (0..3).map(|a| (x[a] - point[a]) * (x[a] - point[a])).sum::<f64>().sqrt();
    (if projection.is_inside && !is_sheet { -distance } else { distance }, point)
}

impl Raster {
    fn new(surface: &Surface, bounds: &Aabb<3>) -> Self {
        let size: [f64; 3] = std::array::from_fn(|a| bounds.upper[a] - bounds.lower[a]);
        let edge = size.iter().fold(0.0, |longest: f64, s| longest.max(*s)) / RASTER as f64;
        let lower = bounds.lower.map(|x| x - edge);
        let cells = size.map(|s| (s / edge).ceil() as usize + 2);
        let mut raster = Self { lower, edge, cells, distances: Vec::new() };
        raster.distances =
            (0..cells.iter().product()).map(|cell| nearest(surface, &raster.centre(cell)).0).collect();
        raster
    }

    fn centre(&self, cell: usize) -> [f64; 3] {
        let [nx, ny, _] = self.cells;
        let place = [cell % nx, cell / nx % ny, cell / (nx * ny)];
        std::array::from_fn(|a| self.lower[a] + (place[a] as f64 + 0.5) * self.edge)
    }

    /// Bound on the distance of a point in the raster that is away from the surface.
    fn bound(&self, x: &[f64; 3]) -> Option<f64> {
        let place: [f64; 3] = std::array::from_fn(|a| ((x[a] - self.lower[a]) / self.edge).floor());
        if (0..3).any(|a| !(place[a] >= 0.0 && place[a] < self.cells[a] as f64)) {
            return None;
        }
        let [i, j, k] = place.map(|c| c as usize);
        let cell = i + self.cells[0] * (j + self.cells[1] * k);
        let (distance, centre) = (self.distances[cell], self.centre(cell));
        let way = (0..3).map(|a| (x[a] - centre[a]).powi(2)).sum::<f64>().sqrt();
        // Rounding of the distances that are compared is far below this margin.
        let left = distance.abs() - way;
        (left > 2.0 * self.edge).then_some(left * distance.signum())
    }
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        self.0.checksum == other.0.checksum
    }
}

impl std::fmt::Debug for Mesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Mesh({:016x})", self.0.checksum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 1 about the origin by subdivision of an octahedron.
    pub(super) fn ball(depth: u32) -> Triangles {
        let mut vertices: Vec<[f64; 3]> = Vec::new();
        let mut indices = Vec::new();
        let n = 1_usize << depth;
        let signs = [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]];
        let signs = signs.into_iter().chain(signs.map(|s| s.map(|c: f64| -c)));
        for sign in signs {
            let point = |i: usize, j: usize| {
                let p = [i as f64, j as f64, (n - i - j) as f64].map(|c| c / n as f64);
                let length = p.iter().map(|c| c * c).sum::<f64>().sqrt();
                std::array::from_fn(|a| sign[a] * p[a] / length)
            };
            let turns = sign[0] * sign[1] * sign[2] < 0.0;
            let mut push = |a: [f64; 3], b, c| {
                let first = vertices.len() as u32;
                vertices.extend([a, b, c]);
                indices.push(if turns {
                    [first, first + 2, first + 1]
                } else {
                    [first, first + 1, first + 2]
                });
            };
            for i in 0..n {
                for j in 0..n - i {
                    push(point(i, j), point(i + 1, j), point(i, j + 1));
                    if i + j + 2 <= n {
                        push(point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
                    }
                }
            }
        }
        Triangles { vertices, indices }
    }

    pub(super) fn cube() -> Triangles {
        let vertices = (0..8).map(|c| [f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2)]).collect();
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let indices = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Triangles { vertices, indices }
    }

    /// Points of a box about a solid, in no order.
    fn points(reach: f64) -> impl Iterator<Item = [f64; 3]> {
        let part = |i: u32, root: f64| (f64::from(i) * root).fract() * 2.0 - 1.0;
        (1..4000).map(move |i| {
            [part(i, 0.754_877_666), part(i, 0.569_840_291), part(i, 0.819_172_513)].map(|c| reach * c)
        })
    }

    /// The distance of a cube is exact near its surface, edges and corners included, and a bound with the right sign elsewhere; the
    /// normal is the gradient.
    #[test]
    fn a_cube_is_a_box() {
        let mesh = Mesh::new(cube()).unwrap();
        assert!((mesh.volume() - 1.0).abs() < 1e-15);
        let exact = super::super::Shape::Box(Aabb::new([0.0; 3], [1.0; 3]));
        let near = 2.0 / RASTER as f64;
        for x in points(1.2).map(|x| x.map(|c| c + 0.5)) {
            let (found, expected) = (mesh.distance(&x), exact.distance(&x));
            assert!(
                found * expected >= 0.0 && found.abs() <= expected.abs() + 1e-15,
                "{x:?}: {found} {expected}"
            );
            if expected.abs() < near {
                assert!((found - expected).abs() < 1e-14, "{x:?}: {found} {expected}");
                let (normal, exact) = (mesh.gradient(&x), exact.gradient(&x));
                let cos: f64 = (0..3).map(|a| normal[a] * exact[a]).sum();
                // Along the planes that halve its edges there are two.
                assert!(cos > 1.0 - 1e-9 || expected < 0.0, "{x:?}: {normal:?} {exact:?}");
            }
        }
        assert_eq!(mesh.gradient(&[0.25, 0.5, 1.0]), [0.0, 0.0, 1.0]);
    }

    /// A ball of 8,192 triangles: as far off as its facets are, 2e-4 of the radius squared over the square of their edge.
    #[test]
    fn a_fine_ball_is_nearly_a_ball() {
        let mesh = Mesh::new(ball(5)).unwrap();
        let sagitta = 2.0 * (1.0 / 32.0_f64).powi(2);
        for x in points(1.3) {
            let expected = x.iter().map(|c| c * c).sum::<f64>().sqrt() - 1.0;
            let found = mesh.distance(&x);
            assert!(found.abs() <= expected.abs() + sagitta, "{x:?}: {found} {expected}");
            assert!(found * expected > 0.0 || expected.abs() < sagitta, "{x:?}: {found} {expected}");
            if expected.abs() < 0.04 {
                assert!((found - expected).abs() < sagitta, "{x:?}: {found} {expected}");
            }
        }
    }

    /// Turned inside out it is the same solid.
    #[test]
    fn facing_inwards_is_turned() {
        let mut inwards = cube();
        inwards.indices.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        let mesh = Mesh::new(inwards).unwrap();
        assert!(mesh.distance(&[0.5; 3]) < 0.0 && mesh.distance(&[1.5; 3]) > 0.0);
    }
}
