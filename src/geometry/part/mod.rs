//! Volume, centre and second moments of the part of a shape in a box.
//!
//! The box is cut by the shape, one primitive after the other. What planes leave of it is a boundary, in
//! pieces whose order does not matter ([`Chain`]); integrals over it are sums over simplices. Balls, cones
//! and cylinders are surfaces of revolution ([`Round`]): in the plane they cut segments, in space slices.
//! Meshes are cut by the faces of the box. Unions and differences are sums with signs of intersections,
//! since `1(A ∪ B) = 1(A) + 1(B) - 1(A) 1(B)` and `1(A \ B) = 1(A) - 1(A) 1(B)`.
//!
//! All of this is exact to rounding where at most one round surface, or one mesh that is closed and not
//! turned, meets the box, together with any number of planes; of balls and cones in space, to 1e-12 of boxes
//! up to a third of their radius, and to 1e-10 of wider ones. Boxes that more of them meet are halved several
//! times, then all but the first round surface become the planes that touch them.
//!
//! | file | task |
//! |---|---|
//! | `chain` | boundaries, and what a plane leaves of them |
//! | `round` | what a ball, a cone or a cylinder leaves |
//! | `solid` | what a box leaves of a mesh |
use super::moments::Sums;
use super::vector::product;
use super::{Aabb, Frustum, Mesh, Moments, Shape, Side};
use chain::Chain;
use round::Round;

mod chain;
mod round;
mod solid;
#[cfg(test)]
mod tests;

/// Times that a box is halved if several curved surfaces meet it.
const fn depth(d: usize) -> u32 {
    if d == 2 { 6 } else { 2 }
}

/// A region, with the sign with which it counts.
#[derive(Clone)]
struct Piece<const D: usize> {
    sign: f64,
    /// The rest of the box after cuts by planes.
    chain: Chain<D>,
    /// Whether this is still the box itself.
    is_whole: bool,
    within: Within<D>,
}

/// Curved surface that bounds a region beside planes.
#[derive(Clone)]
enum Within<const D: usize> {
    Everything,
    Round(Round<D>),
    Mesh(Mesh),
}

/// The box whose part is sought.
struct Place<const D: usize> {
    /// Unless the frame is turned.
    cell: Option<Aabb<D>>,
    centre: [f64; D],
    /// Whether it is not to be halved any more.
    is_last: bool,
}

impl<const D: usize> Shape<D> {
    /// Volume, centre and second moments of the part of the shape in a box; `None` if it has no volume. Exact
    /// but for boxes that several curved surfaces meet (see the module).
    pub fn part_in(&self, cell: &Aabb<D>) -> Option<Moments<D>> {
        let mut sums = Sums::new(cell.centre());
        add_part(self, cell, depth(D), &mut sums);
        sums.moments()
    }
}

fn add_part<const D: usize>(shape: &Shape<D>, cell: &Aabb<D>, depth: u32, sums: &mut Sums<D>) {
    let place = Place { cell: Some(*cell), centre: cell.centre(), is_last: depth == 0 };
    let whole = Piece { sign: 1.0, chain: Chain::of_box(cell), is_whole: true, within: Within::Everything };
    match intersection(shape, vec![whole], &place) {
        Some(pieces) => pieces.iter().for_each(|piece| piece.add_to(cell, sums)),
        None if depth > 0 => cell.children().for_each(|child| add_part(shape, &child, depth - 1, sums)),
        None => {}
    }
}

/// The parts of regions in a shape; `None` where the box must be halved for them.
fn intersection<const D: usize>(
    shape: &Shape<D>,
    mut pieces: Vec<Piece<D>>,
    place: &Place<D>,
) -> Option<Vec<Piece<D>>> {
    match place.cell.as_ref().map(|cell| shape.classify(cell)) {
        Some(Side::Outside) => return Some(Vec::new()),
        Some(Side::Inside) => return Some(pieces),
        Some(Side::Crosses) | None => {}
    }
    match shape {
        Shape::Box(aabb) => {
            for a in 0..D {
                let unit = std::array::from_fn(|b| if a == b { 1.0 } else { 0.0 });
                clip(&mut pieces, &unit, aabb.upper[a])?;
                clip(&mut pieces, &unit.map(|c: f64| -c), -aabb.lower[a])?;
            }
            Some(pieces)
        }
        Shape::HalfSpace { point, normal } => {
            clip(&mut pieces, normal, product(normal, point))?;
            Some(pieces)
        }
        Shape::Sphere { centre, radius } => within(shape, pieces, place, Round::ball(*centre, *radius)),
        Shape::Frustum(frustum) => {
            let Frustum { base, axis, height, .. } = frustum;
            let foot = product(axis, base);
            clip(&mut pieces, axis, foot + height)?;
            clip(&mut pieces, &axis.map(|c| -c), -foot)?;
            if D == 2 {
                for side in slants(frustum) {
                    clip(&mut pieces, &side.0, side.1)?;
                }
                return Some(pieces);
            }
            within(shape, pieces, place, Round::cone(frustum))
        }
        Shape::Polygon(points) => in_polygon(points, &pieces, place),
        Shape::Mesh(mesh) => {
            let is_exact = !place.is_last && mesh.is_closed() && pieces.iter().all(|piece| piece.is_bare());
            if is_exact {
                pieces.iter_mut().for_each(|piece| piece.within = Within::Mesh(mesh.clone()));
                return Some(pieces);
            }
            place.is_last.then(|| at_tangent(shape, pieces, place)).flatten()
        }
        Shape::Rotated(shape, placement) => {
            let own = Place { cell: None, centre: placement.to_own(&place.centre), ..*place };
            let r = &placement.rotation;
            let to_own = |x: &[f64; D]| placement.to_own(x);
            let turned_back = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
            let pieces = pieces.into_iter().map(|piece| piece.moved(&to_own, &turned_back));
            let pieces = intersection(shape, pieces.collect::<Option<_>>()?, &own)?;
            let to_space = |x: &[f64; D]| placement.to_space(x);
            pieces.into_iter().map(|piece| piece.moved(&to_space, r)).collect()
        }
        Shape::Union(parts) => {
            let (mut all, mut left) = (Vec::new(), pieces);
            for part in parts {
                let common = intersection(part, left.clone(), place)?;
                left.extend(negative(&common));
                all.extend(common);
            }
            Some(all)
        }
        Shape::Intersection(parts) => {
            parts.iter().try_fold(pieces, |pieces, part| intersection(part, pieces, place))
        }
        Shape::Difference(from, removed) => {
            removed.iter().try_fold(intersection(from, pieces, place)?, |mut left, part| {
                let common = intersection(part, left.clone(), place)?;
                left.extend(negative(&common));
                Some(left)
            })
        }
    }
}

fn negative<const D: usize>(pieces: &[Piece<D>]) -> impl Iterator<Item = Piece<D>> {
    pieces.iter().map(|piece| Piece { sign: -piece.sign, ..piece.clone() })
}

/// Cuts regions by the half-space `n · x <= offset`.
fn clip<const D: usize>(pieces: &mut Vec<Piece<D>>, normal: &[f64; D], offset: f64) -> Option<()> {
    for piece in pieces.iter_mut() {
        let is_cut = piece.chain.clip(normal, offset);
        piece.is_whole &= !is_cut;
        if is_cut && matches!(piece.within, Within::Mesh(_)) {
            return None;
        }
    }
    pieces.retain(|piece| !piece.chain.is_empty());
    Some(())
}

/// Parts of regions within a round surface.
fn within<const D: usize>(
    shape: &Shape<D>,
    mut pieces: Vec<Piece<D>>,
    place: &Place<D>,
    round: Round<D>,
) -> Option<Vec<Piece<D>>> {
    let is_free = |piece: &Piece<D>| match &piece.within {
        Within::Everything => true,
        Within::Round(other) => *other == round,
        Within::Mesh(_) => false,
    };
    if pieces.iter().all(is_free) {
        pieces.iter_mut().for_each(|piece| piece.within = Within::Round(round.clone()));
        return Some(pieces);
    }
    place.is_last.then(|| at_tangent(shape, pieces, place)).flatten()
}

/// Parts of regions behind the plane that touches a shape near the middle of the box.
fn at_tangent<const D: usize>(
    shape: &Shape<D>,
    mut pieces: Vec<Piece<D>>,
    place: &Place<D>,
) -> Option<Vec<Piece<D>>> {
    let normal = shape.gradient(&place.centre);
    clip(&mut pieces, &normal, product(&normal, &place.centre) - shape.distance(&place.centre))?;
    Some(pieces)
}

/// Normals and offsets of the two slants of a trapezium.
fn slants<const D: usize>(frustum: &Frustum<D>) -> [([f64; D], f64); 2] {
    let Frustum { base, axis, height, lower_radius, upper_radius } = frustum;
    [-1.0, 1.0].map(|side| {
        // Across the axis, on either side; along it by the slope.
        let slope = (lower_radius - upper_radius) / height;
        let normal = std::array::from_fn(|a| {
            let across = if a == 0 { -axis[1 % D] } else { axis[0] };
            f64::mul_add(slope, axis[a], side * across)
        });
        (normal, product(&normal, base) + lower_radius)
    })
}

/// Parts of regions in a polygon: the sum over the triangles between its first corner and its edges, with
/// the signs of their areas.
fn in_polygon<const D: usize>(
    points: &[[f64; 2]],
    pieces: &[Piece<D>],
    place: &Place<D>,
) -> Option<Vec<Piece<D>>> {
    let [first, rest @ ..] = points else { return Some(Vec::new()) };
    let twice = |a: &[f64; 2], b: &[f64; 2]| {
        (a[0] - first[0]) * (b[1] - first[1]) - (a[1] - first[1]) * (b[0] - first[0])
    };
    let all: f64 = rest.windows(2).map(|edge| twice(&edge[0], &edge[1])).sum();
    let mut found = Vec::new();
    for edge in rest.windows(2) {
        let area = twice(&edge[0], &edge[1]);
        let mut corners = [*first, edge[0], edge[1]];
        let is_away = |cell: &Aabb<D>| {
            (0..2).any(|a| {
                corners.iter().all(|x| x[a] <= cell.lower[a]) || corners.iter().all(|x| x[a] >= cell.upper[a])
            })
        };
        if area == 0.0 || place.cell.as_ref().is_some_and(is_away) {
            continue;
        }
        if area < 0.0 {
            corners.swap(1, 2);
        }
        let mut own = pieces.to_vec();
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let normal = std::array::from_fn(|i| match i {
                0 => b[1] - a[1],
                1 => a[0] - b[0],
                _ => 0.0,
            });
            clip(&mut own, &normal, normal[0] * a[0] + normal[1] * a[1])?;
        }
        let sign = area.signum() * all.signum();
        own.iter_mut().for_each(|piece| piece.sign *= sign);
        found.extend(own);
    }
    Some(found)
}

impl<const D: usize> Piece<D> {
    /// Whether nothing has been cut off the box.
    fn is_bare(&self) -> bool {
        self.is_whole && matches!(self.within, Within::Everything)
    }

    /// The region in another frame; `None` of a mesh.
    fn moved(self, to: &impl Fn(&[f64; D]) -> [f64; D], rotation: &[[f64; D]; D]) -> Option<Self> {
        let within = match self.within {
            Within::Everything => Within::Everything,
            Within::Round(round) => Within::Round(round.moved(to, rotation)),
            Within::Mesh(_) => return None,
        };
        Some(Self { sign: self.sign, chain: self.chain.moved(to), is_whole: false, within })
    }

    fn add_to(&self, cell: &Aabb<D>, sums: &mut Sums<D>) {
        match &self.within {
            Within::Everything => self.chain.add_to(self.sign, sums),
            Within::Round(round) => round.add_to(self.sign, &self.chain, sums),
            Within::Mesh(mesh) => solid::add_to(self.sign, mesh, cell, sums),
        }
    }
}
