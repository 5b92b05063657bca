//! Parts of regions with plane sides in balls, cones and cylinders.
//!
//! All are surfaces of revolution whose squared radius is a square polynomial along the axis. Their slices
//! across the axis are discs, whose common part with a polygon has integrals in closed form, edge by edge: an
//! edge in the disc gives the triangle to the centre, an edge outside the sector that it hides.
//!
//! Along the axis, integrals over slices are smooth between the heights of corners, of the points where edges
//! pierce the surface, of those where it touches a side, and of its poles. All are roots of square equations.
//! At these heights integrands behave as half-integer powers, which the substitution t = -cos θ makes smooth.
use std::sync::OnceLock;

use super::chain::Chain;
use crate::geometry::Frustum;
use crate::geometry::moments::Sums;
use crate::geometry::vector::{cross, in_space, product};

/// Points of the Gauss-Legendre rule between two heights.
const POINTS: usize = 16;

/// Parts between two heights for each radius that they are apart, and most of them: the rule is exact to
/// rounding for a quarter of a radius.
const PARTS_OF_RADIUS: f64 = 4.0;
const MOST_PARTS: f64 = 12.0;

/// Solid of revolution: the disc `|x - origin|² <= c₀` in the plane.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Round<const D: usize> {
    origin: [f64; D],
    /// Unit vectors of its frame; in space the last lies along the axis.
    axes: [[f64; D]; D],
    /// Its squared radius is c₀ + c₁ t + c₂ t² at the height t along the axis over the origin, m².
    square: [f64; 3],
}

impl<const D: usize> Round<D> {
    pub(super) fn ball(centre: [f64; D], radius: f64) -> Self {
        let axes = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
        let bend = if D == 2 { 0.0 } else { -1.0 };
        Self { origin: centre, axes, square: [radius * radius, 0.0, bend] }
    }

    /// The cone through both ends of a frustum, without its ends.
    pub(super) fn cone(frustum: &Frustum<D>) -> Self {
        let Frustum { base, axis, height, lower_radius, upper_radius } = frustum;
        let slope = (upper_radius - lower_radius) / height;
        let square = [lower_radius * lower_radius, 2.0 * slope * lower_radius, slope * slope];
        Self { origin: *base, axes: frame(axis), square }
    }

    pub(super) fn moved(self, to: &impl Fn(&[f64; D]) -> [f64; D], rotation: &[[f64; D]; D]) -> Self {
        let turned =
            |v: &[f64; D]| std::array::from_fn(|i| (0..D).map(|j| rotation[i][j] * v[j]).sum::<f64>());
        Self { origin: to(&self.origin), axes: self.axes.each_ref().map(turned), square: self.square }
    }

    /// Adds the integrals over its part in a region.
    pub(super) fn add_to(&self, sign: f64, chain: &Chain<D>, sums: &mut Sums<D>) {
        let own = |x: &[f64; D]| -> [f64; D] {
            let from: [f64; D] = std::array::from_fn(|a| x[a] - self.origin[a]);
            std::array::from_fn(|k| product(&self.axes[k], &from))
        };
        let facets: Vec<Vec<[f64; D]>> =
            chain.facets().iter().map(|facet| facet.iter().map(own).collect()).collect();
        let mut found = Sums::new(self.origin);
        if D == 2 {
            let mut flat = Flat::default();
            for facet in &facets {
                if let [a, b] = facet[..] {
                    flat.add_edge([a[0], a[1]], [b[0], b[1]], self.square[0]);
                }
            }
            flat.add_slice(1.0, 0.0, &mut found);
        } else {
            let facets: Vec<Vec<[f64; 3]>> = facets
                .iter()
                .map(|facet| facet.iter().map(|x| std::array::from_fn(|k| x[k % D])).collect())
                .collect();
            self.add_slices(&facets, &mut found);
        }
        sums.add(sign, &found, &self.axes);
    }

    fn square_at(&self, t: f64) -> f64 {
        let [c, b, a] = self.square;
        a.mul_add(t, b).mul_add(t, c)
    }

    fn add_slices(&self, facets: &[Vec<[f64; 3]>], sums: &mut Sums<D>) {
        let heights = self.heights(facets);
        for pair in heights.windows(2) {
            let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
            let square = self.square_at(middle);
            if !(half > 0.0 && square > 0.0) {
                continue;
            }
            let parts = (PARTS_OF_RADIUS * 2.0 * half / square.sqrt()).ceil().clamp(1.0, MOST_PARTS);
            for part in 0..parts as u32 {
                let half = half / parts;
                let middle = f64::mul_add(f64::from(2 * part + 1), half, pair[0]);
                self.add_slices_between(facets, middle, half, sums);
            }
        }
    }

    fn add_slices_between(&self, facets: &[Vec<[f64; 3]>], middle: f64, half: f64, sums: &mut Sums<D>) {
        for (place, weight) in rule() {
            let t = half.mul_add(*place, middle);
            let square = self.square_at(t);
            let mut flat = Flat::default();
            for facet in facets {
                if let Some([from, to]) = section(facet, t) {
                    flat.add_edge(from, to, square);
                }
            }
            flat.add_slice(half * weight, t, sums);
        }
    }

    /// Heights between which slices change smoothly, ascending.
    fn heights(&self, facets: &[Vec<[f64; 3]>]) -> Vec<f64> {
        let [c, b, a] = self.square;
        let mut heights: Vec<f64> = facets.iter().flatten().map(|x| x[2]).collect();
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        heights.extend(roots(a, b, c));
        for facet in facets {
            for (k, x) in facet.iter().enumerate() {
                let y = facet[(k + 1) % facet.len()];
                let [u, v, w] = [y[0] - x[0], y[1] - x[1], y[2] - x[2]];
                let gap = x[0] * x[0] + x[1] * x[1] - self.square_at(x[2]);
                let slope = x[0] * u + x[1] * v - w * (0.5 * b + a * x[2]);
                let shares = roots(u * u + v * v - a * w * w, 2.0 * slope, gap);
                heights.extend(shares.filter(|s| (0.0..=1.0).contains(s)).map(|s| s.mul_add(w, x[2])));
            }
            heights.extend(self.tangents(facet));
        }
        heights.retain(|t| (low..=high).contains(t));
        heights.sort_unstable_by(f64::total_cmp);
        let least = 1e-13 * (high - low);
        heights.dedup_by(|next, last| *next - *last <= least);
        heights
    }

    /// Heights at which the surface touches the side of a region: there its disc touches the line in which
    /// the slice cuts the side, n · x = d, so (d - n₃ t)² = (n₁² + n₂²) r(t)².
    fn tangents(&self, facet: &[[f64; 3]]) -> impl Iterator<Item = f64> {
        let [c, b, a] = self.square;
        let mut normal = [0.0; 3];
        for pair in facet.windows(2).skip(1) {
            let [p, q] = [&pair[0], &pair[1]].map(|x| std::array::from_fn(|k| x[k] - facet[0][k]));
            let area = cross(p, q);
            (0..3).for_each(|k| normal[k] += area[k]);
        }
        let size = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        let [n1, n2, n3] = normal.map(|n| if size > 0.0 { n / size } else { 0.0 });
        let offset = n1 * facet[0][0] + n2 * facet[0][1] + n3 * facet[0][2];
        let across = n1 * n1 + n2 * n2;
        let heights =
            roots(n3 * n3 - across * a, -2.0 * offset * n3 - across * b, offset * offset - across * c);
        let corner = |bound: fn(f64, f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|k| facet.iter().map(|x| x[k]).reduce(bound).unwrap_or(0.0))
        };
        let (lower, upper) = (corner(f64::min), corner(f64::max));
        let slack = 1e-9 * (0..3).map(|k| upper[k] - lower[k]).fold(0.0, f64::max);
        heights.filter(move |t| {
            let share = (offset - n3 * t) / across;
            let point = [n1 * share, n2 * share, *t];
            across > 1e-20 && (0..3).all(|k| lower[k] - slack <= point[k] && point[k] <= upper[k] + slack)
        })
    }
}

/// Unit vectors with the given one last, in a right-handed frame.
fn frame<const D: usize>(axis: &[f64; D]) -> [[f64; D]; D] {
    let along = in_space(axis);
    let least = (0..3).min_by(|&a, &b| along[a].abs().total_cmp(&along[b].abs())).unwrap_or(0);
    let unit: [f64; 3] = std::array::from_fn(|a| if a == least { 1.0 } else { 0.0 });
    let across = cross(along, unit);
    let size = across.iter().map(|c| c * c).sum::<f64>().sqrt();
    let first = across.map(|c| c / size);
    let vectors = [first, cross(along, first), along];
    std::array::from_fn(|k| std::array::from_fn(|a| vectors[k % 3][a % 3]))
}

/// Real roots of a x² + b x + c, none where all vanish.
fn roots(a: f64, b: f64, c: f64) -> impl Iterator<Item = f64> {
    let square = b * b - 4.0 * a * c;
    // The form without cancellation.
    let half = -0.5 * (b + square.max(0.0).sqrt().copysign(b));
    let both = [half / a, c / half];
    both.into_iter().filter(move |root| square >= 0.0 && root.is_finite())
}

/// The edge in which a facet meets the slice at a height, with the region to its left.
fn section(facet: &[[f64; 3]], t: f64) -> Option<[[f64; 2]; 2]> {
    let is_in = |x: &[f64; 3]| x[2] <= t;
    if facet.iter().all(is_in) || !facet.iter().any(is_in) {
        return None;
    }
    let (mut out, mut back) = (None, None);
    for (k, x) in facet.iter().enumerate() {
        let y = &facet[(k + 1) % facet.len()];
        let at = |low: &[f64; 3], high: &[f64; 3]| {
            let share = (t - low[2]) / (high[2] - low[2]);
            [0, 1].map(|a| share.mul_add(high[a] - low[a], low[a]))
        };
        match (is_in(x), is_in(y)) {
            (true, false) => out = Some(at(x, y)),
            (false, true) => back = Some(at(y, x)),
            _ => {}
        }
    }
    Some([back?, out?])
}

/// Places from -1 to 1 and weights of the rule for integrals over t = -cos θ.
fn rule() -> &'static [(f64, f64); POINTS] {
    static RULE: OnceLock<[(f64, f64); POINTS]> = OnceLock::new();
    RULE.get_or_init(|| {
        let (pi, n) = (std::f64::consts::PI, POINTS as f64);
        std::array::from_fn(|i| {
            // Newton's method for the root of the Legendre polynomial.
            let mut x = libm::cos(pi * (i as f64 + 0.75) / (n + 0.5));
            let mut slope = 1.0;
            for _ in 0..20 {
                let (mut before, mut value) = (1.0, x);
                for k in 2..=POINTS {
                    let k = k as f64;
                    (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
                }
                slope = n * (x * value - before) / (x * x - 1.0);
                x -= value / slope;
            }
            let angle = 0.5 * pi * (1.0 - x);
            let weight = 2.0 / ((1.0 - x * x) * slope * slope);
            (-libm::cos(angle), 0.5 * pi * weight * libm::sin(angle))
        })
    })
}

/// Integrals over the common part of a disc about the origin and a polygon: 1, x, y, x², xy, y².
#[derive(Default)]
struct Flat {
    area: f64,
    first: [f64; 2],
    second: [f64; 3],
}

impl Flat {
    /// Adds what the edge from `a` to `b` gives, for a disc of this squared radius.
    fn add_edge(&mut self, a: [f64; 2], b: [f64; 2], square: f64) {
        let way = [b[0] - a[0], b[1] - a[1]];
        let length = way[0] * way[0] + way[1] * way[1];
        if square <= 0.0 || length <= 0.0 {
            return;
        }
        let along = a[0] * way[0] + a[1] * way[1];
        let gap = a[0] * a[0] + a[1] * a[1] - square;
        let root = along.mul_add(along, -(length * gap));
        let at = |share: f64| [0, 1].map(|k| share.mul_add(way[k], a[k]));
        let root = if root > 0.0 { root.sqrt() } else { 0.0 };
        let [enters, leaves] = [-root, root].map(|root| ((root - along) / length).clamp(0.0, 1.0));
        if enters >= leaves {
            self.add_sector(a, b, square);
            return;
        }
        let enters = if enters > 0.0 { Some(at(enters)) } else { None };
        let leaves = if leaves < 1.0 { Some(at(leaves)) } else { None };
        if let Some(point) = enters {
            self.add_sector(a, point, square);
        }
        self.add_triangle(enters.unwrap_or(a), leaves.unwrap_or(b));
        if let Some(point) = leaves {
            self.add_sector(point, b, square);
        }
    }

    /// The triangle between the centre and an edge.
    fn add_triangle(&mut self, p: [f64; 2], q: [f64; 2]) {
        let area = 0.5 * (p[0] * q[1] - p[1] * q[0]);
        let sum = [p[0] + q[0], p[1] + q[1]];
        self.area += area;
        (0..2).for_each(|k| self.first[k] += area / 3.0 * sum[k]);
        for (second, (i, j)) in self.second.iter_mut().zip([(0, 0), (0, 1), (1, 1)]) {
            *second += area / 12.0 * (p[i] * p[j] + q[i] * q[j] + sum[i] * sum[j]);
        }
    }

    /// The sector between the directions of two points outside.
    fn add_sector(&mut self, p: [f64; 2], q: [f64; 2], square: f64) {
        let angle = libm::atan2(p[0] * q[1] - p[1] * q[0], p[0] * q[0] + p[1] * q[1]);
        if angle == 0.0 {
            return;
        }
        let [p, q] = [p, q].map(|x| {
            let size = (x[0] * x[0] + x[1] * x[1]).sqrt();
            [x[0] / size, x[1] / size]
        });
        let radius = square.sqrt();
        self.area += 0.5 * square * angle;
        self.first[0] += square * radius / 3.0 * (q[1] - p[1]);
        self.first[1] += square * radius / 3.0 * (p[0] - q[0]);
        let (fourth, twice) = (0.25 * square * square, 0.5 * (q[0] * q[1] - p[0] * p[1]));
        self.second[0] += fourth * (0.5 * angle + twice);
        self.second[1] += fourth * 0.5 * (q[1] * q[1] - p[1] * p[1]);
        self.second[2] += fourth * (0.5 * angle - twice);
    }

    /// Adds the slice at a height with a weight.
    fn add_slice<const D: usize>(&self, weight: f64, t: f64, sums: &mut Sums<D>) {
        let [xx, xy, yy] = self.second;
        let second = [
            [xx, xy, t * self.first[0]],
            [xy, yy, t * self.first[1]],
            [t * self.first[0], t * self.first[1], t * t * self.area],
        ];
        let first = [self.first[0], self.first[1], t * self.area];
        sums.volume += weight * self.area;
        for i in 0..D {
            sums.first[i] += weight * first[i];
            (0..D).for_each(|j| sums.second[i][j] += weight * second[i][j]);
        }
    }
}
