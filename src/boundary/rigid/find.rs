//! Contacts of rigid bodies: points of one against the signed distance of the other, and against the faces of
//! the domain.
use super::Surroundings;
use super::features::{Feature, points_of_rim};
use crate::boundary::motion::{Pose, Rate};
use crate::boundary::vector::length;
use crate::boundary::vector::{dot, in_plane};
use crate::boundary::{Collider, Contact};
use crate::geometry::vector::in_space;

/// Most contacts between two bodies.
const MOST: usize = 8;
/// Gap, as a share of a body's size, up to which points are tested however slow bodies are; also the depth
/// inside a body at which normals are evaluated: at the surface the normal of a point above an edge is
/// ambiguous.
const SMALL: f64 = 1e-3;

/// A point at which two bodies touch, or may touch in this step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// The free body.
    pub body: usize,
    /// The other collider; `None`: a face of the domain.
    pub other: Option<usize>,
    /// Where, m.
    pub point: [f64; 3],
    /// Unit normal from the other to the body.
    pub normal: [f64; 3],
    /// Gap in the middle of the step, m; negative for an overlap.
    pub gap: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Coefficient of restitution.
    pub restitution: f64,
}

/// A candidate: place, normal to the body whose point it is, gap.
type Candidate = ([f64; 3], [f64; 3], f64);

/// Signed distance and normal of an obstacle.
type Distance<'a> = dyn Fn(&[f64; 3]) -> (f64, [f64; 3]) + 'a;

/// All contacts, in a fixed order.
pub(super) fn contacts<const D: usize>(
    all: &Surroundings<'_, D>,
    poses: &[Pose<D>],
    rates: &[Rate<D>],
    dt: f64,
) -> Vec<Found> {
    let mut found = Vec::new();
    for body in 0..all.colliders.len() {
        let collider = &all.colliders[body];
        let Some(meeting) = collider.meeting() else { continue };
        let reach = |c: usize| reach(all, rates, c, dt);
        let size = all.features[body].radius;
        let mut add = |other: Option<usize>, friction: f64, restitution: f64, candidates: Vec<Candidate>| {
            found.extend(chosen(candidates, size).into_iter().map(|(point, normal, gap)| Found {
                body,
                other,
                point,
                normal,
                gap,
                friction,
                restitution,
            }));
        };
        for axis in 0..D {
            for (side, face) in all.faces[axis].iter().enumerate() {
                if matches!(face, Contact::Symmetric | Contact::Outflow | Contact::Absorbing) {
                    continue;
                }
                let (from, sign) = [(0.0, 1.0), (all.extent[axis], -1.0)][side];
                let mut normal = [0.0; 3];
                normal[axis] = sign;
                let distance = |x: &[f64; 3]| (sign * (x[axis] - from), normal);
                let candidates = candidates(all, poses, body, reach(body), &distance);
                add(None, meeting.friction, meeting.restitution, candidates);
            }
        }
        for (other, partner) in all.colliders.iter().enumerate() {
            let theirs = partner.meeting();
            let is_passive = partner.free().is_some() && theirs.is_none();
            if other == body || !partner.is_present() || is_passive || (theirs.is_some() && other < body) {
                continue;
            }
            // Of two free bodies the smaller coefficients.
            let friction = theirs.map_or(meeting.friction, |own| own.friction.min(meeting.friction));
            let restitution =
                theirs.map_or(meeting.restitution, |own| own.restitution.min(meeting.restitution));
            let near = reach(body) + reach(other);
            let mut both = against(all, poses, [body, other], near);
            if is_mixed(all, body, other) {
                let back = against(all, poses, [other, body], near).into_iter();
                both.extend(back.map(|(x, normal, gap)| (x, normal.map(|n| -n), gap)));
            }
            add(Some(other), friction, restitution, both);
        }
    }
    found
}

/// Whether points of the second body have to be tested as well: for a ball its centre suffices.
fn is_mixed<const D: usize>(all: &Surroundings<'_, D>, body: usize, other: usize) -> bool {
    !matches!(all.features[body].all[..], [Feature::Ball { .. }]) && !all.features[other].all.is_empty()
}

/// Gap up to which points of a collider are tested, m.
fn reach<const D: usize>(all: &Surroundings<'_, D>, rates: &[Rate<D>], c: usize, dt: f64) -> f64 {
    let size = all.features[c].radius;
    let (now, mean) = (all.states[c].rate.speeds(), rates[c].speeds());
    let turn = if size.is_finite() { 2.0 * size * now.1.max(mean.1) } else { 0.0 };
    let small = if size.is_finite() { SMALL * size } else { 0.0 };
    dt.mul_add(2.0 * now.0.max(mean.0) + turn, small)
}

/// Points of the first collider near the surface of the second.
fn against<const D: usize>(
    all: &Surroundings<'_, D>,
    poses: &[Pose<D>],
    [one, two]: [usize; 2],
    near: f64,
) -> Vec<Candidate> {
    let (collider, pose): (&Collider<D>, _) = (&all.colliders[two], &poses[two]);
    let (centre, size) = middle(all, poses, one);
    let depth = if size.is_finite() { SMALL * size } else { 0.0 };
    let distance = |x: &[f64; 3]| {
        let way: [f64; 3] = std::array::from_fn(|a| centre[a] - x[a]);
        let long = length(&way);
        let share = if long > depth { depth / long } else { 0.0 };
        let inside: [f64; 3] = std::array::from_fn(|a| share.mul_add(way[a], x[a]));
        let normal = in_space(&collider.normal(&in_plane(&inside), pose));
        (collider.distance(&in_plane(x), pose), normal)
    };
    candidates(all, poses, one, near, &distance)
}

/// Centre and radius of a ball around a collider.
fn middle<const D: usize>(all: &Surroundings<'_, D>, poses: &[Pose<D>], c: usize) -> ([f64; 3], f64) {
    let features = &all.features[c];
    (in_space(&all.colliders[c].to_space(&in_plane(&features.centre), &poses[c])), features.radius)
}

/// Points of a collider at a `distance` of less than `near` (m), with the normal there.
fn candidates<const D: usize>(
    all: &Surroundings<'_, D>,
    poses: &[Pose<D>],
    c: usize,
    near: f64,
    distance: &Distance<'_>,
) -> Vec<Candidate> {
    let (collider, pose) = (&all.colliders[c], &poses[c]);
    let (centre, radius) = middle(all, poses, c);
    let mut found = Vec::new();
    if distance(&centre).0 - radius > near {
        return found;
    }
    let take = |x: [f64; 3], found: &mut Vec<Candidate>| {
        let (gap, normal) = distance(&x);
        if gap <= near {
            found.push((x, normal, gap));
        }
    };
    for feature in &all.features[c].all {
        match feature {
            Feature::Point(x) => take(in_space(&collider.to_space(x, pose)), &mut found),
            Feature::Ball { centre, radius } => {
                let centre = in_space(&collider.to_space(centre, pose));
                let (gap, normal) = distance(&centre);
                if gap - radius <= near {
                    let point = std::array::from_fn(|a| (-radius).mul_add(normal[a], centre[a]));
                    found.push((point, normal, gap - radius));
                }
            }
            Feature::Rim { centre, axis, radius } => {
                let centre = in_space(&collider.to_space(&in_plane(centre), pose));
                let axis = in_space(&collider.turned(&in_plane(axis), pose));
                let (gap, normal) = distance(&centre);
                if gap - radius <= near {
                    for x in points_of_rim(&centre, &axis, *radius, &normal) {
                        take(x, &mut found);
                    }
                }
            }
        }
    }
    found
}

/// Selection of candidates: the deepest, then repeatedly the one farthest from those selected, while that
/// distance is above a share of the body's size.
fn chosen(candidates: Vec<Candidate>, size: f64) -> Vec<Candidate> {
    let mut taken: Vec<Candidate> = Vec::new();
    let deepest = candidates.iter().fold(None, |best: Option<&Candidate>, one| match best {
        Some(best) if best.2 <= one.2 => Some(best),
        _ => Some(one),
    });
    taken.extend(deepest);
    let square = |a: &Candidate, b: &Candidate| {
        let way: [f64; 3] = std::array::from_fn(|k| a.0[k] - b.0[k]);
        dot(&way, &way)
    };
    let mut nearest: Vec<f64> =
        candidates.iter().map(|one| taken.first().map_or(0.0, |t| square(one, t))).collect();
    while taken.len() < MOST {
        let farthest = (0..candidates.len()).fold(None, |best: Option<usize>, k| {
            if best.is_some_and(|b| nearest[b] >= nearest[k]) { best } else { Some(k) }
        });
        let Some(k) = farthest.filter(|&k| nearest[k] > (SMALL * size) * (SMALL * size)) else { break };
        taken.push(candidates[k]);
        for (far, one) in nearest.iter_mut().zip(&candidates) {
            *far = far.min(square(one, &candidates[k]));
        }
    }
    taken
}
