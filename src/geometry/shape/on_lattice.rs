//! Lattices of boxes that fill a shape.
use super::Shape;
use crate::geometry::Aabb;

/// Distance of a face to a plane of the lattice up to which it lies on it, in edges of its boxes.
const ON_PLANE: f64 = 1e-6;

/// Where the faces of shapes lie along each axis, m.
#[derive(Clone, Debug)]
pub struct Faces<const D: usize>([Vec<f64>; D]);

impl<const D: usize> Default for Faces<D> {
    fn default() -> Self {
        Self(std::array::from_fn(|_| Vec::new()))
    }
}

impl<const D: usize> Faces<D> {
    /// Lower corner of a box of a lattice with this edge whose boxes fill the shapes, m: that of the domain
    /// if they may lie there, else less than a box below it. `None` if no lattice does.
    pub fn lattice(&self, edge: f64) -> Option<[f64; D]> {
        let mut origin = [0.0; D];
        for (origin, places) in origin.iter_mut().zip(&self.0) {
            let Some(first) = places.first().map(|place| place / edge) else { continue };
            let off = |place: f64| (place - place.round()).abs();
            let part = if off(first) <= ON_PLANE { 0.0 } else { first - first.ceil() };
            if places.iter().any(|place| off(place / edge - part) > ON_PLANE) {
                return None;
            }
            *origin = part * edge;
        }
        Some(origin)
    }
}

impl<const D: usize> Shape<D> {
    /// Adds where the faces of the shape lie in a domain, with those of the domain that cut it. False if a
    /// part of its surface may be curved or inclined to the axes, as that of any mesh.
    pub fn add_faces(&self, domain: &Aabb<D>, faces: &mut Faces<D>) -> bool {
        let mut add =
            |axis: usize, place: f64| faces.0[axis].push(place.clamp(domain.lower[axis], domain.upper[axis]));
        match self {
            Self::Box(aabb) => {
                (0..D)
                    .for_each(|a| [aabb.lower[a], aabb.upper[a]].into_iter().for_each(|place| add(a, place)));
                true
            }
            Self::HalfSpace { point, normal } => {
                let axis = (0..D).find(|&a| normal[a].abs() == 1.0);
                axis.inspect(|&axis| add(axis, point[axis])).is_some()
            }
            Self::Polygon(points) => points.iter().zip(points.iter().cycle().skip(1)).all(|(from, to)| {
                let axis = (0..2).find(|&a| from[a] == to[a]);
                axis.inspect(|&axis| add(axis, from[axis])).is_some()
            }),
            Self::Sphere { .. } | Self::Frustum(_) | Self::Mesh(_) | Self::Rotated(..) => false,
            Self::Union(parts) | Self::Intersection(parts) => {
                parts.iter().all(|part| part.add_faces(domain, faces))
            }
            Self::Difference(from, removed) => {
                std::iter::once(&**from).chain(removed).all(|part| part.add_faces(domain, faces))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(x: [f64; 2], y: [f64; 2]) -> Shape<2> {
        Shape::Box(Aabb::new([x[0], y[0]], [x[1], y[1]]))
    }

    /// The lattice of boxes of a quarter that fills a shape in a square of 4, in boxes.
    fn lattice(shape: &Shape<2>) -> Option<[f64; 2]> {
        let mut faces = Faces::default();
        let is_along_axes = shape.add_faces(&Aabb::new([0.0; 2], [4.0; 2]), &mut faces);
        let origin = is_along_axes.then(|| faces.lattice(0.25)).flatten();
        origin.map(|origin| origin.map(|c| (c / 0.25 * 1e3).round() / 1e3))
    }

    #[test]
    fn shapes_have_the_lattice_whose_boxes_fill_them() {
        let here = Some([0.0; 2]);
        assert_eq!(lattice(&block([0.5, 1.25], [0.0, 3.0])), here);
        assert_eq!(lattice(&block([0.5, 1.25], [0.1, 3.1])), Some([0.0, -0.6]));
        assert_eq!(lattice(&block([0.5, 1.3], [0.0, 3.0])), None, "no whole number of boxes");
        assert_eq!(lattice(&block([-0.1, 1.25], [0.0, 4.3])), here, "the domain ends it");
        assert_eq!(lattice(&block([-0.1, 1.3], [0.0, 4.3])), None);
        assert_eq!(lattice(&Shape::Sphere { centre: [1.0, 1.0], radius: 0.5 }), None);
        let step = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 0.5], [1.0, 0.5], [1.0, 1.0], [0.0, 1.0]];
        let moved = step.iter().map(|&[x, y]| [x + 0.05, y]).collect();
        let stretched = step.iter().map(|&[x, y]| [x, 1.1 * y]).collect();
        assert_eq!(lattice(&Shape::Polygon(step)), here);
        assert_eq!(lattice(&Shape::Polygon(moved)), Some([-0.8, 0.0]));
        assert_eq!(lattice(&Shape::Polygon(stretched)), None);
        assert_eq!(lattice(&Shape::Polygon(vec![[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])), None, "a slope");
        let drilled = |x: f64| {
            Shape::Difference(Box::new(block([0.5, 3.5], [0.0, 3.0])), vec![block([x, 2.0], [1.0, 2.0])])
        };
        assert_eq!(lattice(&drilled(1.0)), here);
        assert_eq!(lattice(&drilled(1.1)), None);
    }
}
