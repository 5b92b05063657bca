//! Exact signed distances of the primitives.
use crate::geometry::{Aabb, Frustum};

fn norm(components: impl Iterator<Item = f64>) -> f64 {
    components.map(|c| c * c).sum::<f64>().sqrt()
}

/// Distance to an axis-aligned box: per axis the excess over the half width; outside the excesses add
/// as a vector, inside the nearest face counts.
pub(in crate::geometry) fn box_distance<const D: usize>(aabb: &Aabb<D>, x: &[f64; D]) -> f64 {
    let excess: [f64; D] = std::array::from_fn(|a| (aabb.lower[a] - x[a]).max(x[a] - aabb.upper[a]));
    let nearest = excess.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if nearest <= 0.0 { nearest } else { norm(excess.iter().map(|e| e.max(0.0))) }
}

/// Distance to a ball.
pub(super) fn sphere_distance<const D: usize>(centre: &[f64; D], radius: f64, x: &[f64; D]) -> f64 {
    norm((0..D).map(|a| x[a] - centre[a])) - radius
}

/// Distance to a half-space with a unit normal.
pub(super) fn half_space_distance<const D: usize>(point: &[f64; D], normal: &[f64; D], x: &[f64; D]) -> f64 {
    (0..D).map(|a| (x[a] - point[a]) * normal[a]).sum()
}

/// Distance of `q` to the segment from `a` to `b`.
fn segment_distance(a: [f64; 2], b: [f64; 2], q: [f64; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [q[0] - a[0], q[1] - a[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let fraction =
        if square > 0.0 { ((to[0] * along[0] + to[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    norm([to[0] - fraction * along[0], to[1] - fraction * along[1]].into_iter())
}

/// Distance to a truncated cone, in the half plane of radius and height: the nearest of the two ends
/// and the slant.
pub(super) fn frustum_distance<const D: usize>(frustum: &Frustum<D>, x: &[f64; D]) -> f64 {
    let Frustum { base, axis, height, lower_radius, upper_radius } = *frustum;
    let from_base: [f64; D] = std::array::from_fn(|a| x[a] - base[a]);
    let t: f64 = (0..D).map(|a| from_base[a] * axis[a]).sum();
    let r = norm((0..D).map(|a| from_base[a] - t * axis[a]));
    let (foot, head) = ([lower_radius, 0.0], [upper_radius, height]);
    let distance = segment_distance([0.0, 0.0], foot, [r, t])
        .min(segment_distance([0.0, height], head, [r, t]))
        .min(segment_distance(foot, head, [r, t]));
    let slant = lower_radius + (upper_radius - lower_radius) * (t / height);
    if t > 0.0 && t < height && r < slant { -distance } else { distance }
}

/// Distance to a simple polygon; inside by the parity of edges crossed by a ray.
pub(super) fn polygon_distance(points: &[[f64; 2]], q: [f64; 2]) -> f64 {
    let mut distance = f64::INFINITY;
    let mut inside = false;
    for (i, &b) in points.iter().enumerate() {
        let a = points[(i + points.len() - 1) % points.len()];
        distance = distance.min(segment_distance(a, b, q));
        // Half-open in y: a ray through a vertex counts it for one of its two edges.
        if (a[1] > q[1]) != (b[1] > q[1]) {
            let crossing = a[0] + (q[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            inside ^= q[0] < crossing;
        }
    }
    if inside { -distance } else { distance }
}
