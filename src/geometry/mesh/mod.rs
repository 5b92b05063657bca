//! Closed triangle meshes as shapes.
//!
//! | file | task |
//! |---|---|
//! | `read` | OBJ, PLY and STL to triangles |
//! | `stl` | STL |
//! | `triangles` | the triangles of a file, or why it gives none |
//! | `polygon` | faces with more corners to triangles |
//! | `terrain/` | rasters of heights to triangles |
//! | `solid` | checks that triangles bound a solid |
//! | `crossing` | triangles that cross each other |
//! | `deforming` | surfaces through several meshes in time |
//! | `winding` | inside and outside by the generalised winding number |
//! | this | signed distance and normal |
//!
//! The nearest point of the surface comes from the tree of `parry3d`, and the side from its angle-weighted
//! normals (Baerentzen and Aanaes 2005), which is exact at edges and corners, or, for surfaces with gaps,
//! from the winding number. A raster of distances accelerates both: away from the surface a point takes the
//! bound of its cell in the raster, so that queries from afar do not search the tree.
use std::sync::{Arc, OnceLock};

use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

use super::Aabb;
use super::shape::primitives::box_distance;
use crate::checksum::fnv1a;

mod crossing;
mod deforming;
mod polygon;
mod read;
mod solid;
mod stl;
mod terrain;
mod triangles;
mod winding;

pub use deforming::{Deforming, Mismatch};
pub use read::{ply_columns, read};
pub use solid::NotSolid;
pub use terrain::{Placing, Raster as HeightRaster, Terrain};
pub use triangles::{ReadError, Triangles};

use solid::Merged;
use winding::Winding;

/// Cells of the raster along the longest edge of the bounding box.
const RASTER: usize = 48;

/// A solid bounded by triangles.
#[derive(Clone)]
pub struct Mesh(Arc<Inner>);

/// The triangles.
struct Surface {
    surface: TriMesh,
    inside: Inside,
}

/// Test by which a point is inside the surface or not.
enum Inside {
    /// The normals of a closed surface.
    Normals,
    /// The winding number.
    Winding(Winding),
    /// Nothing is inside of a sheet.
    Nothing,
}

/// Interpretation of a set of triangles.
#[derive(Clone, Copy, PartialEq)]
enum Filling {
    /// The solid that they close.
    Closed,
    /// As above, and known not to cross: no search for crossings.
    Terrain,
    /// The solid that they close, or a sheet.
    ClosedOrSheet,
    /// The solid that they wind around, closed or not.
    Winding,
}

struct Inner {
    surface: Surface,
    bounds: Aabb<3>,
    /// Made at its first use.
    raster: OnceLock<Raster>,
    /// Checksum of vertices and triangles.
    checksum: u64,
    volume: f64,
}

/// Signed distances at the centres of the cells of a regular grid over the bounding box with a margin of one
/// cell.
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
        Self::of(triangles, Filling::Closed)
    }

    /// The solid below a terrain: as [`Mesh::new`], without the search for crossings, which a surface of
    /// heights cannot have.
    ///
    /// # Errors
    /// A height is not finite.
    pub fn terrain(triangles: Triangles) -> Result<Self, NotSolid> {
        Self::of(triangles, Filling::Terrain)
    }

    /// The solid that triangles bound, or, where they are not closed, a sheet, all of whose distances are
    /// positive.
    ///
    /// # Errors
    /// There is no triangle with an area, or a vertex is not finite.
    pub fn solid_or_sheet(triangles: Triangles) -> Result<Self, NotSolid> {
        Self::of(triangles, Filling::ClosedOrSheet)
    }

    /// The solid that triangles wind around: they may leave holes, cross each other and face both ways. Holes
    /// are closed by cones over their rims, and the inside follows from the winding number.
    ///
    /// # Errors
    /// There is no triangle with an area, a vertex is not finite, or nothing is inside.
    pub fn wound(triangles: Triangles) -> Result<Self, NotSolid> {
        Self::of(triangles, Filling::Winding)
    }

    fn of(triangles: Triangles, filling: Filling) -> Result<Self, NotSolid> {
        let mut merged = solid::merged(triangles)?;
        match filling {
            Filling::Winding => {
                merged = merged.welded();
                merged.leave_out_doubled();
            }
            Filling::Closed => merged.check_doubled()?,
            Filling::ClosedOrSheet => merged.leave_out_doubled(),
            Filling::Terrain => {}
        }
        let mut checked = merged.check();
        if matches!(
            (filling, &checked),
            (Filling::Closed | Filling::ClosedOrSheet, Err(NotSolid::Open { .. }))
        ) {
            // Gaps between nearly equal vertices may be the only reason that it is not closed.
            let welded = merged.welded();
            let closed = welded.check();
            if closed.is_ok() {
                (merged, checked) = (welded, closed);
            }
        }
        let words = merged.vertices.iter().flatten().map(|x| x.to_bits());
        let words = words.chain(merged.indices.iter().flatten().map(|&index| u64::from(index)));
        let checksum = fnv1a(words.chain((filling == Filling::Winding).then_some(1)));
        if filling == Filling::Winding {
            checked = merged.capped();
        }
        let volume = match checked {
            Ok(volume) => Some(volume),
            Err(NotSolid::Open { .. } | NotSolid::Turned(_) | NotSolid::Flat(_))
                if filling == Filling::ClosedOrSheet =>
            {
                None
            }
            Err(other) => return Err(other),
        };
        let Merged { vertices, mut indices, numbers } = merged;
        if volume.is_some_and(|volume| volume < 0.0) {
            indices.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let bounds = Aabb::of_points(vertices.iter().copied());
        let inside = match (filling, volume) {
            (Filling::Winding, _) => Inside::Winding(Winding::new(&vertices, &indices)),
            (_, Some(_)) => Inside::Normals,
            (_, None) => Inside::Nothing,
        };
        let places: Vec<Vector> = vertices.iter().map(|x| Vector::new(x[0], x[1], x[2])).collect();
        let flags = match inside {
            Inside::Normals => TriMeshFlags::ORIENTED,
            Inside::Winding(_) | Inside::Nothing => TriMeshFlags::empty(),
        };
        let surface = TriMesh::with_flags(places, indices.clone(), flags)
            .map_err(|error| NotSolid::Refused(error.to_string()))?;
        if matches!(inside, Inside::Normals) && filling != Filling::Terrain {
            crossing::check(&vertices, &indices, &numbers, surface.bvh())?;
        }
        let surface = Surface { surface, inside };
        let raster = OnceLock::new();
        Ok(Self(Arc::new(Inner { surface, bounds, raster, checksum, volume: volume.unwrap_or(0.0).abs() })))
    }

    /// The surface with its vertices elsewhere (m), for a while: without a raster, and without a test whether
    /// it crosses itself.
    pub(super) fn moved(&self, vertices: Vec<[f64; 3]>) -> Self {
        let bounds = Aabb::of_points(vertices.iter().copied());
        let indices = self.0.surface.surface.indices().to_vec();
        let (inside, flags) = match self.0.surface.inside {
            Inside::Normals => (Inside::Normals, TriMeshFlags::ORIENTED),
            Inside::Winding(_) => (Inside::Winding(Winding::new(&vertices, &indices)), TriMeshFlags::empty()),
            Inside::Nothing => (Inside::Nothing, TriMeshFlags::empty()),
        };
        let places = vertices.iter().map(|x| Vector::new(x[0], x[1], x[2])).collect();
        // The same triangles were accepted at the first mesh.
        let Ok(surface) = TriMesh::with_flags(places, indices, flags) else { return self.clone() };
        let (surface, raster) = (Surface { surface, inside }, OnceLock::from(Raster::none(&bounds)));
        Self(Arc::new(Inner { surface, bounds, raster, checksum: self.0.checksum, volume: self.0.volume }))
    }

    /// Corners of the triangle nearest to a point, and their shares in its nearest point.
    fn nearest_triangle(&self, x: &[f64; 3]) -> ([u32; 3], [f64; 3]) {
        let surface = &self.0.surface.surface;
        let projection = surface.project_local_point(Vector::new(x[0], x[1], x[2]), false);
        let corners = surface.indices()[projection.subshape as usize];
        let [a, b, c] = corners.map(|corner| surface.vertices()[corner as usize]);
        let (u, v, w) = (b - a, c - a, projection.point - a);
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let (wu, wv) = (w.dot(u), w.dot(v));
        let area = uu * vv - uv * uv;
        if area <= 0.0 {
            return (corners, [1.0, 0.0, 0.0]);
        }
        let (second, third) = ((vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area);
        (corners, [1.0 - second - third, second, third])
    }

    fn raster(&self) -> &Raster {
        self.0.raster.get_or_init(|| Raster::new(&self.0.surface, &self.0.bounds))
    }

    /// Its bounding box, m.
    pub fn bounds(&self) -> Aabb<3> {
        self.0.bounds
    }

    /// Its volume, m³; 0 of a sheet.
    pub fn volume(&self) -> f64 {
        self.0.volume
    }

    /// Corners of its triangles, m, those of holes that are closed included.
    pub fn triangles(&self) -> impl Iterator<Item = [[f64; 3]; 3]> {
        let surface = &self.0.surface.surface;
        let place = |index: u32| surface.vertices()[index as usize];
        surface
            .indices()
            .iter()
            .map(move |corners| corners.map(|index| [place(index).x, place(index).y, place(index).z]))
    }

    /// Whether its triangles close it, so that all face outwards.
    pub(super) fn is_closed(&self) -> bool {
        matches!(self.0.surface.inside, Inside::Normals)
    }

    /// Corners of its triangles that may meet a box, m.
    pub(super) fn triangles_in(&self, cell: &Aabb<3>) -> impl Iterator<Item = [[f64; 3]; 3]> {
        let surface = &self.0.surface.surface;
        let near = cell.grown(1e-9 * Raster::edge(&self.0.bounds));
        let [lower, upper] = [near.lower, near.upper].map(|x| Vector::new(x[0], x[1], x[2]));
        let near = parry3d_f64::bounding_volume::Aabb::new(lower, upper);
        let mut found: Vec<u32> = surface.bvh().intersect_aabb(&near).collect();
        // The same order in all boxes.
        found.sort_unstable();
        let corners = surface.vertices();
        found.into_iter().map(move |triangle| {
            surface.indices()[triangle as usize].map(|corner| {
                let x = &corners[corner as usize];
                [x.x, x.y, x.z]
            })
        })
    }

    /// Its vertices, m.
    pub fn vertices(&self) -> impl Iterator<Item = [f64; 3]> {
        self.0.surface.surface.vertices().iter().map(|x| [x.x, x.y, x.z])
    }

    /// Checksum of its vertices and triangles.
    pub fn checksum(&self) -> u64 {
        self.0.checksum
    }

    /// Signed distance of a point to the surface, m, negative inside: exact within some cells of the raster
    /// from the surface, elsewhere a bound, not larger in magnitude and with the right sign.
    pub fn distance(&self, x: &[f64; 3]) -> f64 {
        if let Some(bound) = self.raster().bound(x) {
            return bound;
        }
        let outside = box_distance(&self.0.bounds, x);
        if outside > self.raster().edge {
            return outside;
        }
        nearest(&self.0.surface, x).0
    }

    /// Unit vector out of the solid: the gradient of the exact distance.
    pub fn gradient(&self, x: &[f64; 3]) -> [f64; 3] {
        let (distance, point) = nearest(&self.0.surface, x);
        let way: [f64; 3] = std::array::from_fn(|a| (x[a] - point[a]) * distance.signum());
        let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
        // On the surface the difference has no direction.
        if length > 1e-12 * self.raster().edge {
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
    let projection = surface.surface.project_local_point(Vector::new(x[0], x[1], x[2]), false);
    let point = [projection.point.x, projection.point.y, projection.point.z];
    let distance = (0..3).map(|a| (x[a] - point[a]) * (x[a] - point[a])).sum::<f64>().sqrt();
    let is_inside = match &surface.inside {
        Inside::Normals => projection.is_inside,
        Inside::Winding(winding) => winding.is_inside(x),
        Inside::Nothing => false,
    };
    (if is_inside { -distance } else { distance }, point)
}

impl Raster {
    fn new(surface: &Surface, bounds: &Aabb<3>) -> Self {
        let size: [f64; 3] = std::array::from_fn(|a| bounds.upper[a] - bounds.lower[a]);
        let edge = Self::edge(bounds);
        let lower = bounds.lower.map(|x| x - edge);
        let cells = size.map(|s| (s / edge).ceil() as usize + 2);
        let mut raster = Self { lower, edge, cells, distances: Vec::new() };
        let all = 0..cells.iter().product::<usize>();
        raster.distances = all.map(|cell| nearest(surface, &raster.centre(cell)).0).collect();
        raster
    }

    /// A raster without cells.
    fn none(bounds: &Aabb<3>) -> Self {
        Self { lower: bounds.lower, edge: Self::edge(bounds), cells: [0; 3], distances: Vec::new() }
    }

    fn edge(bounds: &Aabb<3>) -> f64 {
        (0..3).map(|a| bounds.upper[a] - bounds.lower[a]).fold(0.0, f64::max) / RASTER as f64
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
        // The rounding error of the compared distances is far below this margin.
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
pub(super) mod tests;
