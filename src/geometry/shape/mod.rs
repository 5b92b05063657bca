//! The shape type and its queries.
//!
//! | file | what it holds |
//! |---|---|
//! | this | the type; its distance, membership and bounds |
//! | `primitives`, `gradient` | distances of the primitives; the gradient of the distance |
//! | `classify`, `common_point` | on which side of a shape a box lies; a point that two shapes share |
//! | `thick`, `on_lattice` | whether a solid is thick everywhere; lattices of boxes that fill it |
use self::primitives::{
    box_distance, frustum_distance, half_space_distance, polygon_distance, sphere_distance,
};
use crate::geometry::vector::in_space;
use crate::geometry::{Aabb, Frustum, Mesh};

mod classify;
mod common_point;
mod gradient;
mod on_lattice;
pub(super) mod primitives;
mod thick;

pub use classify::Side;
pub use common_point::common_point;
pub use on_lattice::Faces;

/// A rotation about a point, from the shape's own frame to space: `x = R (y - pivot) + pivot`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement<const D: usize> {
    /// Orthogonal matrix R, row by row.
    pub rotation: [[f64; D]; D],
    /// The fixed point, m.
    pub pivot: [f64; D],
}

impl<const D: usize> Placement<D> {
    /// Where the point `x` of space lies in the shape's own frame.
    pub fn to_own(&self, x: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|i| {
            let turned: f64 = (0..D).map(|j| self.rotation[j][i] * (x[j] - self.pivot[j])).sum();
            turned + self.pivot[i]
        })
    }

    /// Where the point `y` of the shape's own frame lies in space.
    pub fn to_space(&self, y: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|i| {
            let turned: f64 = (0..D).map(|j| self.rotation[i][j] * (y[j] - self.pivot[j])).sum();
            turned + self.pivot[i]
        })
    }
}

/// A region of space.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape<const D: usize> {
    /// An axis-aligned box. It owns its lower faces only, so that adjacent boxes share no point.
    Box(Aabb<D>),
    /// A ball (a disc in 2D).
    Sphere {
        /// Centre, m.
        centre: [f64; D],
        /// Radius, m.
        radius: f64,
    },
    /// A cylinder, cone or truncated cone.
    Frustum(Frustum<D>),
    /// All points behind a plane: `(x - point) · normal < 0`.
    HalfSpace {
        /// A point of the plane, m.
        point: [f64; D],
        /// Outward unit normal.
        normal: [f64; D],
    },
    /// A simple polygon in the plane of the first two axes.
    Polygon(Vec<[f64; 2]>),
    /// A solid bounded by triangles; 3D only.
    Mesh(Mesh),
    /// A shape turned about a point.
    Rotated(Box<Shape<D>>, Placement<D>),
    /// Points of any of the parts.
    Union(Vec<Shape<D>>),
    /// Points of all the parts.
    Intersection(Vec<Shape<D>>),
    /// Points of the first shape that lie in none of the others.
    Difference(Box<Shape<D>>, Vec<Shape<D>>),
}

impl<const D: usize> Shape<D> {
    /// Whether a part of it has a curved surface: analytic shapes only.
    pub fn is_curved(&self) -> bool {
        match self {
            Self::Box(_) | Self::HalfSpace { .. } | Self::Polygon(_) | Self::Mesh(_) => false,
            Self::Sphere { .. } | Self::Frustum(_) => true,
            Self::Rotated(shape, _) => shape.is_curved(),
            Self::Union(parts) | Self::Intersection(parts) => parts.iter().any(Self::is_curved),
            Self::Difference(from, removed) => from.is_curved() || removed.iter().any(Self::is_curved),
        }
    }

    /// Signed distance to the surface, m, negative inside; a bound for booleans (see the module).
    pub fn distance(&self, x: &[f64; D]) -> f64 {
        match self {
            Self::Box(aabb) => box_distance(aabb, x),
            Self::Sphere { centre, radius } => sphere_distance(centre, *radius, x),
            Self::Frustum(frustum) => frustum_distance(frustum, x),
            Self::HalfSpace { point, normal } => half_space_distance(point, normal, x),
            Self::Polygon(points) => polygon_distance(points, [x[0], x[1]]),
            Self::Mesh(mesh) => mesh.distance(&in_space(x)),
            Self::Rotated(shape, placement) => shape.distance(&placement.to_own(x)),
            Self::Union(parts) => parts.iter().map(|s| s.distance(x)).fold(f64::INFINITY, f64::min),
            Self::Intersection(parts) => {
                parts.iter().map(|s| s.distance(x)).fold(f64::NEG_INFINITY, f64::max)
            }
            Self::Difference(from, removed) => {
                removed.iter().map(|s| -s.distance(x)).fold(from.distance(x), f64::max)
            }
        }
    }

    /// True when the point belongs to the shape.
    ///
    /// Boxes own their lower faces, other primitives no surface point; the removed and the remaining part of
    /// a difference never share a point nor leave one out.
    pub fn contains(&self, x: &[f64; D]) -> bool {
        match self {
            Self::Box(aabb) => aabb.contains(x),
            Self::Rotated(shape, placement) => shape.contains(&placement.to_own(x)),
            Self::Union(parts) => parts.iter().any(|s| s.contains(x)),
            Self::Intersection(parts) => parts.iter().all(|s| s.contains(x)),
            Self::Difference(from, removed) => from.contains(x) && !removed.iter().any(|s| s.contains(x)),
            Self::Sphere { .. }
            | Self::Frustum(_)
            | Self::HalfSpace { .. }
            | Self::Polygon(_)
            | Self::Mesh(_) => self.distance(x) < 0.0,
        }
    }

    /// A box that holds the shape: the smallest one for unrotated primitives and unions of them.
    pub fn bounds(&self) -> Aabb<D> {
        match self {
            Self::Box(aabb) => *aabb,
            Self::Sphere { centre, radius } => {
                Aabb::new(centre.map(|c| c - radius), centre.map(|c| c + radius))
            }
            Self::Frustum(frustum) => frustum.bounds(),
            Self::HalfSpace { point, normal } => half_space_bounds(point, normal),
            Self::Polygon(points) => points.iter().fold(Aabb::EMPTY, |hull, p| {
                let mut one = Aabb::EVERYWHERE;
                one.lower[..2].copy_from_slice(p);
                one.upper[..2].copy_from_slice(p);
                hull.hull(&one)
            }),
            Self::Mesh(mesh) => {
                let bounds = mesh.bounds();
                Aabb::new(std::array::from_fn(|a| bounds.lower[a]), std::array::from_fn(|a| bounds.upper[a]))
            }
            Self::Rotated(shape, placement) => rotated_bounds(&shape.bounds(), placement),
            Self::Union(parts) => parts.iter().fold(Aabb::EMPTY, |hull, s| hull.hull(&s.bounds())),
            Self::Intersection(parts) => {
                parts.iter().fold(Aabb::EVERYWHERE, |common, s| common.intersection(&s.bounds()))
            }
            Self::Difference(from, _) => from.bounds(),
        }
    }
}

impl<const D: usize> Frustum<D> {
    fn bounds(&self) -> Aabb<D> {
        let disc = |t: f64, radius: f64| {
            let centre: [f64; D] = std::array::from_fn(|a| self.base[a] + t * self.axis[a]);
            let extent = self.axis.map(|c| radius * (1.0 - c * c).max(0.0).sqrt());
            Aabb::new(
                std::array::from_fn(|a| centre[a] - extent[a]),
                std::array::from_fn(|a| centre[a] + extent[a]),
            )
        };
        disc(0.0, self.lower_radius).hull(&disc(self.height, self.upper_radius))
    }
}

/// A half-space is bounded only across a plane that is normal to an axis.
fn half_space_bounds<const D: usize>(point: &[f64; D], normal: &[f64; D]) -> Aabb<D> {
    let mut bounds = Aabb::EVERYWHERE;
    for a in 0..D {
        if normal[a] == 1.0 {
            bounds.upper[a] = point[a];
        } else if normal[a] == -1.0 {
            bounds.lower[a] = point[a];
        }
    }
    bounds
}

fn rotated_bounds<const D: usize>(own: &Aabb<D>, placement: &Placement<D>) -> Aabb<D> {
    if own.lower.iter().chain(&own.upper).any(|c| !c.is_finite()) {
        return if own.is_empty() { Aabb::EMPTY } else { Aabb::EVERYWHERE };
    }
    (0..1_usize << D).fold(Aabb::EMPTY, |hull, corner| {
        let y = std::array::from_fn(|a| if corner >> a & 1 == 0 { own.lower[a] } else { own.upper[a] });
        let x = placement.to_space(&y);
        hull.hull(&Aabb::new(x, x))
    })
}
