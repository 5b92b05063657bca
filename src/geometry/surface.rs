//! Pieces of the surface of a region in a box: their area vectors, which point out of the region.
//!
//! Where the surface lies on faces of the box, each such face gives a piece. The surface inside the box is
//! one more piece: the part of the region in the box has a closed surface, the sum of whose area vectors is
//! 0, so that the piece is minus the sum over the faces of the box of their parts in the region. Both need no
//! more than membership along lines. Where planes meet in the box at a sharp edge or corner, that sum and
//! their normals give the area of each, unless one of them is too small there to be found. So faces along the
//! axes have their exact area in the plane, others and those in space but for the boxes that edges cross, and
//! curved ones to the second order of the edge of the box.
use nalgebra::{Matrix3, Vector3};

use super::Aabb;

/// A piece of surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch<const D: usize> {
    /// Outward normal times area, m² (in the plane m).
    pub area: [f64; D],
    /// About its centre, m.
    pub centre: [f64; D],
    /// Whether it lies on a face of the box.
    pub is_on_face: bool,
}

/// The region whose surface [`patches`] finds, as functions of a point.
pub struct Region<'a, const D: usize> {
    /// Whether a point is in the region.
    pub inside: &'a (dyn Fn(&[f64; D]) -> bool + Sync),
    /// Whether a point just outside may be beside a surface that counts.
    pub free: &'a (dyn Fn(&[f64; D]) -> bool + Sync),
    /// Whether a point of the surface counts.
    pub counts: &'a (dyn Fn(&[f64; D]) -> bool + Sync),
    /// The point of the surface next to a point.
    pub project: &'a (dyn Fn(&[f64; D]) -> [f64; D] + Sync),
    /// Outward normal of the surface next to a point.
    pub normal: &'a (dyn Fn(&[f64; D]) -> [f64; D] + Sync),
}

/// Distance from a face at which membership is tested, as a share of the edge of the box.
const BESIDE: f64 = 1e-7;
/// Parts of a line that are tested one by one.
const PARTS: usize = 4;
/// Areas below this share of a face do not count: they come from tests beside faces.
const LEAST: f64 = 1e-6;
/// Cosine of the angle between the normals of two planes from which on they meet at a sharp edge; that of one
/// plane with itself.
const SHARP: f64 = 0.9;
const SAME: f64 = 1.0 - 1e-9;

/// Pieces of the surface of a region in a box of equal edges.
pub fn patches<const D: usize>(region: &Region<'_, D>, cell: &Aabb<D>) -> Vec<Patch<D>> {
    let edge = cell.upper[0] - cell.lower[0];
    let face_area = (1..D).fold(1.0, |area, _| area * edge);
    let (mut found, mut closing) = (Vec::new(), [0.0; D]);
    for axis in 0..D {
        for (side, sign) in [(cell.lower[axis], -1.0), (cell.upper[axis], 1.0)] {
            let beside = |x: &[f64; D], by: f64| {
                let mut beside = *x;
                beside[axis] += sign * by * edge;
                beside
            };
            let within = |x: &[f64; D]| (region.inside)(&beside(x, -BESIDE));
            let (share, _) = share_of_face(cell, axis, side, &within);
            closing[axis] -= sign * share * face_area;
            let bare = |x: &[f64; D]| {
                let out = beside(x, BESIDE);
                within(x) && !(region.inside)(&out) && (region.free)(&out) && (region.counts)(x)
            };
            let (share, centre) = share_of_face(cell, axis, side, &bare);
            if share > LEAST {
                let area = std::array::from_fn(|a| if a == axis { sign * share * face_area } else { 0.0 });
                found.push(Patch { area, centre, is_on_face: true });
            }
        }
    }
    let size = closing.iter().map(|c| c * c).sum::<f64>().sqrt();
    if size > LEAST * face_area {
        let inside = planes(region, cell, &closing).unwrap_or_else(|| {
            let mut centre = (region.project)(&cell.centre());
            (0..D).for_each(|a| centre[a] = centre[a].clamp(cell.lower[a], cell.upper[a]));
            vec![(closing, centre)]
        });
        found.extend(inside.into_iter().filter_map(|(area, centre)| {
            let size = area.iter().map(|c| c * c).sum::<f64>().sqrt();
            // Far enough out that rounding of the projection does not matter.
            let out = std::array::from_fn(|a| 1e-3f64.mul_add(edge * area[a] / size, centre[a]));
            let counts = size > LEAST * face_area && (region.free)(&out) && (region.counts)(&centre);
            counts.then_some(Patch { area, centre, is_on_face: false })
        }));
    }
    found
}

/// Area vectors and centres of the planes that meet at a sharp edge or corner in a box, from the sum of their
/// area vectors. `None` where there is one plane alone, or the surface is curved.
fn planes<const D: usize>(
    region: &Region<'_, D>,
    cell: &Aabb<D>,
    closing: &[f64; D],
) -> Option<Vec<([f64; D], [f64; D])>> {
    let edge = cell.upper[0] - cell.lower[0];
    let dot = |a: &[f64; D], b: &[f64; D]| (0..D).map(|i| a[i] * b[i]).sum::<f64>();
    // Normal, sum of points and their number.
    let mut planes: Vec<([f64; D], [f64; D], f64)> = Vec::new();
    for number in 0..PARTS.pow(D as u32) {
        let part = |a: usize| ((number / PARTS.pow(a as u32) % PARTS) as f64 + 0.5) / PARTS as f64;
        let x = std::array::from_fn(|a| part(a).mul_add(edge, cell.lower[a]));
        let (point, normal) = ((region.project)(&x), (region.normal)(&x));
        let slack = BESIDE * edge;
        let is_here = (0..D).all(|a| point[a] >= cell.lower[a] - slack && point[a] <= cell.upper[a] + slack);
        // The point next to one beyond an edge lies on the edge, where the plane has another normal.
        let within = std::array::from_fn(|a| (-1e-3 * edge).mul_add(normal[a], point[a]));
        if !is_here || dot(&(region.normal)(&within), &normal) <= SAME {
            continue;
        }
        let at = |least: f64| planes.iter().position(|(other, ..)| dot(other, &normal) > least);
        match (at(SAME), at(SHARP)) {
            (Some(same), _) => {
                let (_, sum, count) = &mut planes[same];
                (0..D).for_each(|a| sum[a] += point[a]);
                *count += 1.0;
            }
            (None, None) if planes.len() < D => planes.push((normal, point, 1.0)),
            _ => return None,
        }
    }
    if planes.len() < 2 {
        return None;
    }
    let normal = |k: usize| planes.get(k).map(|(normal, ..)| normal);
    let matrix = Matrix3::from_fn(|k, l| match (normal(k), normal(l)) {
        (Some(a), Some(b)) => dot(a, b),
        _ => f64::from(u8::from(k == l)),
    });
    let right = Vector3::from_fn(|k, _| normal(k).map_or(0.0, |normal| dot(normal, closing)));
    let sizes = matrix.lu().solve(&right)?;
    let left: [f64; D] = std::array::from_fn(|a| {
        closing[a] - planes.iter().zip(sizes.iter()).map(|((normal, ..), size)| size * normal[a]).sum::<f64>()
    });
    let is_all = dot(&left, &left) <= 1e-6 * dot(closing, closing) && sizes.iter().all(|&size| size >= 0.0);
    is_all.then(|| {
        let piece = |((normal, sum, count), size): (&([f64; D], [f64; D], f64), &f64)| {
            (normal.map(|c| c * size), sum.map(|c| c / count))
        };
        planes.iter().zip(sizes.iter()).map(piece).collect()
    })
}

/// Share of a face of a box that a set covers, and the centre of that part. The face is cut into lines along
/// one of its axes: the one along which more lines cross the edge of the set, on which it is found exactly.
fn share_of_face<const D: usize>(
    cell: &Aabb<D>,
    axis: usize,
    side: f64,
    set: &impl Fn(&[f64; D]) -> bool,
) -> (f64, [f64; D]) {
    let along = |line_axis: usize| {
        let lines = PARTS.pow(D as u32 - 2);
        let (mut share, mut crossings, mut centre) = (0.0, 0, [0.0; D]);
        for line in 0..lines {
            let mut start = cell.lower;
            start[axis] = side;
            if let Some(other) = (0..D).find(|&a| a != axis && a != line_axis) {
                let place = (line as f64 + 0.5) / PARTS as f64;
                start[other] = place.mul_add(cell.upper[other] - cell.lower[other], start[other]);
            }
            let edge = cell.upper[line_axis] - cell.lower[line_axis];
            let own = share_of_line(&start, line_axis, edge, set);
            (share, crossings) = (share + own.share, crossings + own.crossings);
            for a in 0..D {
                let middle = if a == line_axis { own.moment * edge } else { 0.0 };
                centre[a] += start[a].mul_add(own.share, middle);
            }
        }
        let centre = centre.map(|sum| if share > 0.0 { sum / share } else { 0.0 });
        (share / lines as f64, crossings, centre)
    };
    let mut axes = (0..D).filter(|&a| a != axis).map(along);
    let first = axes.next().unwrap_or((0.0, 0, [0.0; D]));
    let best = axes.fold(first, |best, other| if other.1 > best.1 { other } else { best });
    (best.0, best.2)
}

/// Intersection of a line of unit length with a set.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    /// Share of its length.
    share: f64,
    /// Mean place of that part, from 0 to 1, times the share.
    moment: f64,
    /// Ends of the set found on it.
    crossings: u32,
}

fn share_of_line<const D: usize>(
    start: &[f64; D],
    axis: usize,
    edge: f64,
    set: &impl Fn(&[f64; D]) -> bool,
) -> Line {
    let has = |place: f64| {
        let mut x = *start;
        x[axis] = place.mul_add(edge, x[axis]);
        set(&x)
    };
    let mut line = Line::default();
    let mut add = |from: f64, to: f64| {
        line.share += to - from;
        line.moment += 0.5 * (to - from) * (to + from);
    };
    let mut crossings = 0;
    // The ends count as the points just inside of them, whatever side of the surface rounding moves them to.
    let place = |part: usize| part as f64 / PARTS as f64;
    let looked_at = |part: usize| place(part).clamp(BESIDE, 1.0 - BESIDE);
    let mut before = has(looked_at(0));
    for part in 1..=PARTS {
        let after = has(looked_at(part));
        match (before, after) {
            (true, true) => add(place(part - 1), place(part)),
            (false, false) => {}
            _ => {
                let (mut low, mut high) = (place(part - 1), place(part));
                for _ in 0..40 {
                    let middle = 0.5 * (low + high);
                    *(if has(middle) == before { &mut low } else { &mut high }) = middle;
                }
                let end = 0.5 * (low + high);
                if before {
                    add(place(part - 1), end)
                } else {
                    add(end, place(part))
                }
                crossings += 1;
            }
        }
        before = after;
    }
    Line { crossings, ..line }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Placement, Shape};

    /// All pieces of a shape in boxes of a lattice.
    fn all<const D: usize>(shape: &Shape<D>, edge: f64, boxes: usize) -> Vec<Patch<D>> {
        let region = Region {
            inside: &|x| shape.distance(x) < 0.0,
            free: &|_| true,
            counts: &|_| true,
            project: &|x| {
                let (distance, normal) = (shape.distance(x), shape.gradient(x));
                std::array::from_fn(|a| x[a] - distance * normal[a])
            },
            normal: &|x| shape.gradient(x),
        };
        let mut found = Vec::new();
        for mut index in 0..boxes.pow(D as u32) {
            let lower = std::array::from_fn(|_| {
                let place = (index % boxes) as f64 * edge;
                index /= boxes;
                place
            });
            found.extend(patches(&region, &Aabb::new(lower, lower.map(|c| c + edge))));
        }
        found
    }

    fn sum<const D: usize>(patches: &[Patch<D>], value: impl Fn(&Patch<D>) -> f64) -> f64 {
        patches.iter().map(value).sum()
    }

    fn size<const D: usize>(patch: &Patch<D>) -> f64 {
        patch.area.iter().map(|c| c * c).sum::<f64>().sqrt()
    }

    #[test]
    fn a_box_on_faces_of_boxes_has_its_exact_surface() {
        let block = Shape::Box(Aabb::new([0.1, 0.2, 0.3], [0.5, 0.8, 0.6]));
        let found = all(&block, 0.1, 10);
        assert!(found.iter().all(|patch| patch.is_on_face));
        let exact = 2.0 * (0.4 * 0.6 + 0.4 * 0.3 + 0.6 * 0.3);
        let total = sum(&found, size);
        assert!((total - exact).abs() < 1e-14, "{total} {exact}");
        let top = sum(&found, |patch| patch.area[2].max(0.0));
        assert!((top - 0.24).abs() < 1e-15, "{top}");
    }

    /// A box whose faces lie anywhere: the closed surface has no resultant, and each face has its area up to
    /// its edges. Of one that is turned, small faces in the boxes of its corners are missed. In space, parts
    /// of faces of boxes that edges cross are known to a line.
    #[test]
    fn a_box_elsewhere_has_its_area_up_to_its_edges() {
        let block = Shape::Box(Aabb::new([0.13, 0.17], [0.62, 0.79]));
        let found = all(&block, 0.1, 10);
        for axis in 0..2 {
            assert!(sum(&found, |patch| patch.area[axis]).abs() < 1e-12);
        }
        let (up, total) = (sum(&found, |patch| patch.area[1].max(0.0)), sum(&found, size));
        assert!((up - 0.49).abs() < 1e-10 && (total - 2.22).abs() < 1e-10, "{up} {total}");
        let (sine, cosine) = 0.3_f64.sin_cos();
        let placement = Placement { rotation: [[cosine, -sine], [sine, cosine]], pivot: [0.4, 0.5] };
        let total = sum(&all(&Shape::Rotated(Box::new(block), placement), 0.1, 10), size);
        assert!((total / 2.22 - 1.0).abs() < 0.005, "{total}");
        let block = Shape::Box(Aabb::new([0.13, 0.17, 0.24], [0.62, 0.79, 0.57]));
        let found = all(&block, 0.1, 10);
        let (up, total) = (sum(&found, |patch| patch.area[2].max(0.0)), sum(&found, size));
        let exact = 2.0 * (0.49 * 0.62 + 0.49 * 0.33 + 0.62 * 0.33);
        let off = [up / (0.49 * 0.62) - 1.0, total / exact - 1.0];
        assert!(off.iter().all(|off| off.abs() < 0.005), "{off:?}");
    }

    /// Total area and its first moment (the volume, by the divergence theorem) of a disc and a ball converge.
    #[test]
    fn curved_surfaces_converge() {
        let error = |boxes: usize| {
            let disc = Shape::<2>::Sphere { centre: [0.51, 0.47], radius: 0.4 };
            let found = all(&disc, 1.0 / boxes as f64, boxes);
            for axis in 0..2 {
                assert!(sum(&found, |patch| patch.area[axis]).abs() < 1e-5);
            }
            (sum(&found, size) / (0.8 * std::f64::consts::PI) - 1.0).abs()
        };
        let errors = [error(10), error(20), error(40)];
        println!("disc {errors:?}");
        assert!(errors[0] < 0.01 && errors[2] < errors[0] / 8.0, "{errors:?}");
        let ball = Shape::<3>::Sphere { centre: [0.51, 0.47, 0.52], radius: 0.4 };
        let found = all(&ball, 0.05, 20);
        let area = sum(&found, size) / (0.64 * std::f64::consts::PI) - 1.0;
        println!("ball {area}");
        assert!(area.abs() < 0.01, "{area}");
    }

    #[test]
    fn what_does_not_count_is_left_out_exactly() {
        let block = Shape::Box(Aabb::new([0.0, 0.0], [1.0, 0.5]));
        let region = Region {
            inside: &|x: &[f64; 2]| block.distance(x) < 0.0,
            free: &|_| true,
            counts: &|x| (0.43..=0.76).contains(&x[0]),
            project: &|x| *x,
            normal: &|x| block.gradient(x),
        };
        let mut total = 0.0;
        for i in 0..10 {
            let lower = [f64::from(i) * 0.1, 0.4];
            let found = patches(&region, &Aabb::new(lower, lower.map(|c| c + 0.1)));
            total += sum(&found, |patch| patch.area[1]);
        }
        assert!((total - 0.33).abs() < 1e-12, "{total}");
    }
}
