//! Boundary of a region with plane sides.
use crate::geometry::Aabb;
use crate::geometry::moments::Sums;
use crate::geometry::vector::{cross, dot};

/// Pieces of a boundary, each oriented so that the region lies to its left (in the plane) or behind it (in
/// space): edges with two ends, or convex polygons. What counts is the sum of all, so pieces may cross the
/// region as long as others do so in the opposite sense.
#[derive(Clone, Debug)]
pub(super) struct Chain<const D: usize> {
    facets: Vec<Vec<[f64; D]>>,
}

impl<const D: usize> Chain<D> {
    pub(super) fn of_box(aabb: &Aabb<D>) -> Self {
        const EDGES: [&[usize]; 4] = [&[0, 1], &[1, 3], &[3, 2], &[2, 0]];
        const SIDES: [&[usize]; 6] =
            [&[0, 4, 6, 2], &[1, 3, 7, 5], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 2, 3, 1], &[4, 5, 7, 6]];
        let corner = |corner: &usize| {
            std::array::from_fn(|a| if corner >> a & 1 == 1 { aabb.upper[a] } else { aabb.lower[a] })
        };
        let facets = if D == 2 { &EDGES[..] } else { &SIDES[..] };
        Self { facets: facets.iter().map(|corners| corners.iter().map(corner).collect()).collect() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.facets.is_empty()
    }

    pub(super) fn facets(&self) -> &[Vec<[f64; D]>] {
        &self.facets
    }

    /// Leaves what lies in the half-space `n · x <= offset`. Returns whether this cuts anything off.
    pub(super) fn clip(&mut self, normal: &[f64; D], offset: f64) -> bool {
        let height = |x: &[f64; D]| (0..D).map(|a| normal[a] * x[a]).sum::<f64>() - offset;
        if self.facets.iter().flatten().all(|x| height(x) <= 0.0) {
            return false;
        }
        let mut left = Vec::with_capacity(self.facets.len() + 4);
        // The new side is a fan about a point of it: its boundary is what the cuts of all facets leave open.
        let mut apex: Option<[f64; D]> = None;
        for facet in self.facets.drain(..) {
            let heights: Vec<f64> = facet.iter().map(height).collect();
            if heights.iter().all(|&h| h <= 0.0) {
                left.push(facet);
                continue;
            }
            if heights.iter().all(|&h| h > 0.0) {
                continue;
            }
            let cut = cut(&facet, &heights);
            match (apex, cut.back, cut.out) {
                (None, Some(point), _) | (None, None, Some(point)) => apex = Some(point),
                (Some(apex), Some(back), Some(out)) => left.push(vec![apex, back, out]),
                (Some(apex), Some(back), None) => left.push(vec![apex, back]),
                (Some(apex), None, Some(out)) => left.push(vec![out, apex]),
                (_, None, None) => {}
            }
            left.push(cut.left);
        }
        self.facets = left;
        true
    }

    pub(super) fn moved(self, to: &impl Fn(&[f64; D]) -> [f64; D]) -> Self {
        let facets = self.facets.into_iter().map(|facet| facet.iter().map(to).collect());
        Self { facets: facets.collect() }
    }

    /// Adds the integrals over the region: those over simplices between the origin and the boundary.
    pub(super) fn add_to(&self, sign: f64, sums: &mut Sums<D>) {
        let origin = sums.origin;
        let about = |x: &[f64; D]| -> [f64; D] { std::array::from_fn(|a| x[a] - origin[a]) };
        for facet in &self.facets {
            let Some(first) = facet.first().map(about) else { continue };
            if D == 2 {
                let last = facet.get(1).map_or(first, about);
                sums.add_simplex(0.5 * sign * (first[0] * last[1] - first[1] * last[0]), &[first, last]);
                continue;
            }
            for pair in facet[1..].windows(2) {
                let corners = [first, about(&pair[0]), about(&pair[1])];
                let [a, b, c] = corners.map(|x| std::array::from_fn(|k| x[k % D]));
                sums.add_simplex(sign * dot(a, cross(b, c)) / 6.0, &corners);
            }
        }
    }
}

/// Rest of a facet behind a plane, and where its boundary passes the plane outwards and back.
struct Cut<const D: usize> {
    left: Vec<[f64; D]>,
    out: Option<[f64; D]>,
    back: Option<[f64; D]>,
}

/// Cuts a facet with corners at these heights over a plane. A point of an edge that two facets share has the
/// same bits in both.
fn cut<const D: usize>(facet: &[[f64; D]], heights: &[f64]) -> Cut<D> {
    let mut cut = Cut { left: Vec::with_capacity(facet.len() + 1), out: None, back: None };
    let edges = if facet.len() == 2 { 1 } else { facet.len() };
    for k in 0..facet.len() {
        if heights[k] <= 0.0 {
            cut.left.push(facet[k]);
        }
        if k == edges {
            break;
        }
        let next = (k + 1) % facet.len();
        match (heights[k] <= 0.0, heights[next] <= 0.0) {
            (true, false) => {
                let point = between(&facet[k], &facet[next], heights[k], heights[next]);
                cut.out = Some(point);
                cut.left.push(point);
            }
            (false, true) => {
                let point = between(&facet[next], &facet[k], heights[next], heights[k]);
                cut.back = Some(point);
                cut.left.push(point);
            }
            _ => {}
        }
    }
    cut
}

/// The point of height 0 between one below and one above.
fn between<const D: usize>(below: &[f64; D], above: &[f64; D], low: f64, high: f64) -> [f64; D] {
    let share = low / (low - high);
    std::array::from_fn(|a| share.mul_add(above[a] - below[a], below[a]))
}
