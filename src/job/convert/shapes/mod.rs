//! Shapes of the job file to geometry, with checks that they have a volume.
//!
//! | file | subject |
//! |---|---|
//! | `terrain` | terrain |
//! | `particles` | particles from a file |
mod particles;
mod terrain;

pub(super) use terrain::RASTERS;

use super::checks::{Checks, Space};
use crate::geometry::mesh::{self, NotSolid, Triangles};
use crate::geometry::written::{Shape as Written, Solid, Vector};
use crate::geometry::{Aabb, Frustum, Mesh, Placement, Shape, rotation};
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::text::{excerpt, written};

impl Checks<'_> {
    /// The shape in coordinates relative to the domain's lower corner.
    pub(in crate::job) fn shape<const D: usize>(
        &mut self,
        shape: &Written,
        space: &Space<D>,
        path: &Path,
    ) -> Option<Shape<D>> {
        match shape {
            Written::Box { min, max } => {
                let lower = self.point(min, space, &path.key("min"))?;
                let upper = self.point(max, space, &path.key("max"))?;
                let is_sheet = self.takes_sheets && (0..D).filter(|&a| lower[a] == upper[a]).count() == 1;
                let is_turned = |a: usize| lower[a] > upper[a] || (lower[a] == upper[a] && !is_sheet);
                if let Some(a) = (0..D).find(|&a| is_turned(a)) {
                    let (found, least) = (written(max.0[a]), written(min.0[a]));
                    let is_flat = lower[a] == upper[a];
                    let hint = if is_flat { self.sheet_hint(path) } else { "" };
                    let message = format!("found {found}; expected more than min[{a}] = {least}{hint}");
                    self.fault(&path.key("max").index(a), message);
                    return None;
                }
                Some(Shape::Box(Aabb::new(lower, upper)))
            }
            Written::Circle { centre, radius } => {
                self.only(2, D, "circle", "sphere", path)?;
                Some(Shape::Sphere {
                    centre: self.point(centre, space, &path.key("centre"))?,
                    radius: *radius,
                })
            }
            Written::Sphere { centre, radius } => {
                self.only(3, D, "sphere", "circle", path)?;
                Some(Shape::Sphere {
                    centre: self.point(centre, space, &path.key("centre"))?,
                    radius: *radius,
                })
            }
            Written::Cylinder { base, axis, height, radius } => {
                self.only(3, D, "cylinder", "box", path)?;
                Some(Shape::Frustum(Frustum {
                    base: self.point(base, space, &path.key("base"))?,
                    axis: self.axis(axis.as_ref(), &path.key("axis"))?,
                    height: *height,
                    lower_radius: *radius,
                    upper_radius: *radius,
                }))
            }
            Written::Cone { base, axis, height, radius, top_radius } => {
                self.only(3, D, "cone", "polygon", path)?;
                Some(Shape::Frustum(Frustum {
                    base: self.point(base, space, &path.key("base"))?,
                    axis: self.axis(axis.as_ref(), &path.key("axis"))?,
                    height: *height,
                    lower_radius: *radius,
                    upper_radius: *top_radius,
                }))
            }
            Written::HalfSpace { point, normal } => Some(Shape::HalfSpace {
                point: self.point(point, space, &path.key("point"))?,
                normal: self.direction(normal, &path.key("normal"))?,
            }),
            Written::Polygon { points } => {
                self.only(2, D, "polygon", "union of boxes", path)?;
                self.polygon(points, space, &path.key("points"))
            }
            Written::Mesh { file, .. } => {
                self.only(3, D, "mesh", "polygon", path)?;
                self.mesh(shape, file, space, [path, &path.key("file")]).map(Shape::Mesh)
            }
            Written::Terrain { .. } => {
                self.only(3, D, "terrain", "polygon", path)?;
                self.terrain(shape, space, path)
            }
            Written::Particles { .. } => {
                let message = "found \"particles\"; expected a shape with a surface: particles from a file are a body of their own";
                self.fault(&path.key("kind"), message.into());
                None
            }
            Written::Rotated { shape, centre, axis, angle } => {
                let inner = self.shape(shape, space, &path.key("shape"))?;
                let pivot = self.point(centre, space, &path.key("centre"))?;
                let axis = self.turning_axis::<D>(axis.as_ref(), &path.key("axis"))?;
                let rotation = rotation(axis, angle.to_radians());
                Some(Shape::Rotated(Box::new(inner), Placement { rotation, pivot }))
            }
            Written::Union { parts } => Some(Shape::Union(self.parts(parts, space, &path.key("parts"))?)),
            Written::Intersection { parts } => {
                Some(Shape::Intersection(self.parts(parts, space, &path.key("parts"))?))
            }
            Written::Difference { from, remove } => {
                let from = self.shape(from, space, &path.key("from"));
                let remove = self.parts(remove, space, &path.key("remove"));
                Some(Shape::Difference(Box::new(from?), remove?))
            }
        }
    }

    /// The mesh of a file, placed by the keys of a shape of kind `mesh`. `path` is that of the shape, `here`
    /// that of the file's name.
    pub(super) fn mesh<const D: usize>(
        &mut self,
        shape: &Written,
        file: &str,
        space: &Space<D>,
        [path, here]: [&Path; 2],
    ) -> Option<Mesh> {
        let Written::Mesh { scale, solid, origin, .. } = shape else { return None };
        let origin = self.origin_of_file(origin.as_ref(), space, path)?;
        let triangles = self.read(file, "a mesh in STL, OBJ or PLY", here, mesh::read)?;
        let make = match solid {
            Solid::Winding => Mesh::wound,
            Solid::Closed if self.takes_sheets => Mesh::solid_or_sheet,
            Solid::Closed => Mesh::new,
        };
        self.solid(triangles, *scale, &origin, make, file, here)
    }

    /// Place of the origin of a file, m from the lower corner of the domain.
    pub(super) fn origin_of_file<const D: usize>(
        &mut self,
        origin: Option<&Vector>,
        space: &Space<D>,
        path: &Path,
    ) -> Option<[f64; D]> {
        match origin {
            Some(origin) => self.point(origin, space, &path.key("origin")),
            None => Some(space.origin.map(|c| -c)),
        }
    }

    /// The solid of the triangles of a file with its origin at a point, m from the lower corner of the
    /// domain.
    pub(super) fn solid<const D: usize>(
        &mut self,
        mut triangles: Triangles,
        scale: f64,
        origin: &[f64; D],
        make: fn(Triangles) -> Result<Mesh, NotSolid>,
        file: &str,
        path: &Path,
    ) -> Option<Mesh> {
        for vertex in &mut triangles.vertices {
            *vertex = std::array::from_fn(|a| scale * vertex[a] + if a < D { origin[a] } else { 0.0 });
        }
        match make(triangles) {
            Ok(mesh) => {
                self.note_file(mesh.checksum());
                Some(mesh)
            }
            Err(error) => {
                let hint = if let NotSolid::Open { .. } = error { self.sheet_hint(path) } else { "" };
                self.fault(path, format!("\"{}\": {error}{hint}", excerpt(file, QUOTED)));
                None
            }
        }
    }

    /// Advice for a shape without a volume, if it is that of a collider.
    fn sheet_hint(&self, path: &Path) -> &'static str {
        let is_collider = path.to_string().starts_with("colliders") && !self.takes_sheets;
        if is_collider { "; with acts_on = \"particles\" a collider may be a sheet" } else { "" }
    }

    fn only(
        &mut self,
        needed: usize,
        dimension: usize,
        kind: &str,
        instead: &str,
        path: &Path,
    ) -> Option<()> {
        if needed != dimension {
            self.fault(
                &path.key("kind"),
                format!("found \"{kind}\"; expected a shape of a {dimension}D job, such as a {instead}"),
            );
            return None;
        }
        Some(())
    }

    pub(in crate::job) fn point<const D: usize>(
        &mut self,
        point: &Vector,
        space: &Space<D>,
        path: &Path,
    ) -> Option<[f64; D]> {
        let point: [f64; D] = self.vector(point, path)?;
        Some(std::array::from_fn(|a| point[a] - space.origin[a]))
    }

    fn parts<const D: usize>(
        &mut self,
        parts: &[Written],
        space: &Space<D>,
        path: &Path,
    ) -> Option<Vec<Shape<D>>> {
        if parts.is_empty() {
            self.fault(path, "found an empty array; expected at least one shape".into());
            return None;
        }
        let shapes: Vec<Option<Shape<D>>> =
            parts.iter().enumerate().map(|(i, part)| self.shape(part, space, &path.index(i))).collect();
        shapes.into_iter().collect()
    }

    pub(super) fn direction<const D: usize>(&mut self, direction: &Vector, path: &Path) -> Option<[f64; D]> {
        let direction: [f64; D] = self.vector(direction, path)?;
        // Lengths of any size: squares of components may be too small or too large for a number.
        let greatest = direction.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let scaled = direction.map(|c| c / greatest);
        let length = scaled.iter().map(|c| c * c).sum::<f64>().sqrt();
        if !length.is_finite() {
            self.fault(path, "found a vector of length 0; expected a direction".into());
            return None;
        }
        Some(scaled.map(|c| c / length))
    }

    fn axis<const D: usize>(&mut self, axis: Option<&Vector>, path: &Path) -> Option<[f64; D]> {
        match axis {
            Some(axis) => self.direction(axis, path),
            None => Some(std::array::from_fn(|a| if a == D - 1 { 1.0 } else { 0.0 })),
        }
    }

    /// The axis of a rotation; z, and nothing else, in 2D.
    pub(super) fn turning_axis<const D: usize>(
        &mut self,
        axis: Option<&Vector>,
        path: &Path,
    ) -> Option<[f64; 3]> {
        match axis {
            None => Some([0.0, 0.0, 1.0]),
            Some(_) if D == 2 => {
                self.fault(
                    path,
                    "found an axis; expected none in a 2D job, where shapes rotate about z".into(),
                );
                None
            }
            Some(axis) => self.direction(axis, path),
        }
    }

    fn polygon<const D: usize>(
        &mut self,
        points: &[Vector],
        space: &Space<D>,
        path: &Path,
    ) -> Option<Shape<D>> {
        let corners: Vec<Option<[f64; D]>> =
            points.iter().enumerate().map(|(i, point)| self.point(point, space, &path.index(i))).collect();
        let corners: Vec<[f64; 2]> =
            corners.into_iter().map(|corner| corner.map(|c| [c[0], c[1]])).collect::<Option<_>>()?;
        if corners.len() < 3 {
            self.fault(path, format!("found {} corners; expected at least 3", corners.len()));
            return None;
        }
        if let Some(i) = first_crossing(&corners) {
            let message =
                "found an edge from this point that intersects another edge; expected a simple polygon";
            self.fault(&path.index(i), message.into());
            return None;
        }
        Some(Shape::Polygon(corners))
    }
}

/// The first edge that intersects an edge other than its neighbours, or has no length or folds back.
fn first_crossing(corners: &[[f64; 2]]) -> Option<usize> {
    let n = corners.len();
    let turn =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let within = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (0..2).all(|k| a[k].min(b[k]) <= c[k] && c[k] <= a[k].max(b[k]))
    };
    let meet = |a, b, c, d| {
        let (s, t, u, v) = (turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b));
        (s * t < 0.0 && u * v < 0.0)
            || (s == 0.0 && within(a, b, c))
            || (t == 0.0 && within(a, b, d))
            || (u == 0.0 && within(c, d, a))
            || (v == 0.0 && within(c, d, b))
    };
    let edge = |i: usize| (corners[i], corners[(i + 1) % n]);
    let folds = |i: usize| {
        let ((a, b), next) = (edge(i), corners[(i + 2) % n]);
        turn(a, b, next) == 0.0 && (next[0] - b[0]) * (b[0] - a[0]) + (next[1] - b[1]) * (b[1] - a[1]) <= 0.0
    };
    // Sorted along x: an edge can only intersect those that begin before it ends.
    let reach = |i: usize| {
        let (a, b) = edge(i);
        (a[0].min(b[0]), a[0].max(b[0]))
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| reach(i).0.total_cmp(&reach(j).0).then(i.cmp(&j)));
    let mut first = (0..n).find(|&i| folds(i));
    for (place, &i) in order.iter().enumerate() {
        let ((a, b), end) = (edge(i), reach(i).1);
        for &j in order[place + 1..].iter().take_while(|&&j| reach(j).0 <= end) {
            let apart = (j + 1) % n != i && (i + 1) % n != j;
            let lower = i.min(j);
            if apart && first.is_none_or(|first| lower < first) {
                let (c, d) = edge(j);
                if meet(a, b, c, d) {
                    first = Some(lower);
                }
            }
        }
    }
    first
}
