//! Impulses at the contacts of rigid bodies in a step.
//!
//! Moreau's time stepping (Moreau 1988; Jean 1999): where a gap would close within the step, the normal
//! velocity at its end is at least -e times that at its start, and the impulse along the surface is at most μ
//! times that across it. Impulses are found one after the other in a fixed order, over and over (Gauss and
//! Seidel), until none changes. Bodies move with the mean of their velocities at start and end. A second pass
//! removes part of the overlap that remains at the end: it moves bodies and gives them no velocity.
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::find::Found;
use super::{Push, Surroundings};
use crate::boundary::motion::{Pose, Rate};
use crate::geometry::vector::in_space;

/// Most sweeps over all contacts.
const SWEEPS: usize = 1000;
/// Change of velocity, relative to the greatest one at a contact, at which the sweeps end.
const CONVERGED: f64 = 1e-12;
/// Share of an overlap that a step removes.
const TAKEN_BACK: f64 = 0.15;

/// Velocity (m/s) and angular velocity (rad/s), or impulse (kg m/s) and angular impulse (kg m²/s).
type Pair = [Vector3<f64>; 2];

/// A collider among contacts.
struct Body {
    centre: Vector3<f64>,
    /// 1 / mass along each axis; 0 where it cannot be moved, 1/kg.
    lightness: Vector3<f64>,
    /// Inverse of the inertia in space, 1/(kg m²).
    inverse: Matrix3<f64>,
    start: Pair,
    end: Pair,
    push: Pair,
    /// Velocities of the second pass.
    shift: Pair,
}

impl Body {
    fn new<const D: usize>(all: &Surroundings<'_, D>, c: usize, pose: &Pose<D>, mean: &Rate<D>) -> Self {
        let (collider, state) = (&all.colliders[c], &all.states[c]);
        let axis = Vector3::from(collider.axis);
        let spin = |rate: &Rate<D>| rate.spin * axis + Vector3::from(rate.turning);
        let mean = [Vector3::from(in_space(&mean.velocity)), spin(mean)];
        let (mut lightness, mut inverse, mut start) = (Vector3::zeros(), Matrix3::zeros(), mean);
        if let (Some(free), Some(_)) = (collider.free(), collider.meeting()) {
            for a in (0..D).filter(|&a| free.along[a]) {
                start[0][a] = state.rate.velocity[a];
                lightness[a] = 1.0 / free.mass;
            }
            if free.turns() {
                start[1] = spin(&state.rate);
            }
            if let Some(inertia) = &free.turning {
                inverse = inertia.inverse(&pose.orientation);
            } else if let Some(inertia) = free.inertia {
                inverse = axis * axis.transpose() / inertia;
            }
        }
        let end = std::array::from_fn(|k| 2.0 * mean[k] - start[k]);
        let none = [Vector3::zeros(); 2];
        let centre = in_space(&collider.centre(pose)).into();
        Self { centre, lightness, inverse, start, end, push: none, shift: none }
    }

    /// Change of velocities by an impulse and an angular impulse.
    fn response(&self, push: &Pair) -> Pair {
        [self.lightness.component_mul(&push[0]), self.inverse * push[1]]
    }
}

/// Impulse and angular impulse of an impulse (kg m/s) with this arm (m).
fn with_arm(impulse: &Vector3<f64>, arm: &Vector3<f64>) -> Pair {
    [*impulse, arm.cross(impulse)]
}

/// Velocity of a point with this arm, m/s.
fn at([velocity, spin]: &Pair, arm: &Vector3<f64>) -> Vector3<f64> {
    velocity + spin.cross(arm)
}

/// A contact while impulses are sought.
struct Touch {
    found: Found,
    normal: Vector3<f64>,
    arms: Pair,
    tangents: Pair,
    /// Velocity along the normal by an impulse of 1 along it, 1/kg.
    across: f64,
    /// Inverse of the same along the surface, kg.
    along: Matrix2<f64>,
    /// Not above its least eigenvalue, kg.
    least_along: f64,
    /// Whether the gap closes within the step.
    closes: bool,
    least: f64,
    /// Impulse along the normal, kg m/s.
    pressing: f64,
    /// Impulse along the tangents, kg m/s.
    sliding: Vector2<f64>,
    shift: f64,
}

/// Finds the impulses, changes the mean velocities of free bodies and adds the impulses to those of the
/// colliders.
pub(super) fn solve<const D: usize>(
    all: &Surroundings<'_, D>,
    poses: &[Pose<D>],
    found: Vec<Found>,
    rates: &mut [Rate<D>],
    pushes: &mut [Push],
    dt: f64,
) {
    let mut bodies: Vec<Body> = (0..poses.len()).map(|c| Body::new(all, c, &poses[c], &rates[c])).collect();
    let mut touches: Vec<Touch> = found.into_iter().map(|found| Touch::new(found, &bodies, dt)).collect();
    let scale = touches.iter().fold(0.0, |most: f64, touch| {
        let [start, end] = [touch.relative(&bodies, |b| &b.start), touch.relative(&bodies, |b| &b.end)];
        most.max(start.norm()).max(end.norm())
    });
    sweep(&mut touches, CONVERGED * scale, |touch| touch.correct(&mut bodies, dt));
    for touch in &mut touches {
        let outward = touch.relative(&bodies, |b| &b.end).dot(&touch.normal);
        let left = (0.5 * dt).mul_add(outward, touch.found.gap);
        touch.least = if left < 0.0 { -TAKEN_BACK * left / dt } else { -left / dt };
    }
    sweep(&mut touches, CONVERGED * scale, |touch| touch.separate(&mut bodies));
    let none = [Vector3::zeros(); 2];
    for (c, body) in bodies.iter().enumerate() {
        pushes[c] = Push { impulse: body.push[0].into(), turn: body.push[1].into() };
        if all.colliders[c].meeting().is_none() || (body.push == none && body.shift == none) {
            continue;
        }
        let gained = body.response(&body.push);
        let [velocity, spin]: Pair = std::array::from_fn(|k| 0.5 * gained[k] + body.shift[k]);
        let rate = &mut rates[c];
        (0..D).for_each(|a| rate.velocity[a] += velocity[a]);
        if all.colliders[c].turns_freely() {
            (0..3).for_each(|a| rate.turning[a] += spin[a]);
        } else {
            rate.spin += spin.dot(&Vector3::from(all.colliders[c].axis));
        }
    }
}

/// Corrects all contacts, forwards and backwards in turns (stacks then need half the sweeps), until no
/// velocity changes by more than `least`, m/s.
fn sweep(touches: &mut [Touch], least: f64, mut correct: impl FnMut(&mut Touch) -> f64) {
    for turn in 0..SWEEPS {
        let change = match turn % 2 {
            0 => touches.iter_mut().map(&mut correct).fold(0.0, f64::max),
            _ => touches.iter_mut().rev().map(&mut correct).fold(0.0, f64::max),
        };
        if change <= least {
            break;
        }
    }
}

impl Touch {
    fn new(found: Found, bodies: &[Body], dt: f64) -> Self {
        let (normal, point) = (Vector3::from(found.normal), Vector3::from(found.point));
        let [own, other] = [Some(found.body), found.other].map(|body| body.map(|body| &bodies[body]));
        let arms = [own, other].map(|body| body.map_or_else(Vector3::zeros, |body| point - body.centre));
        let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
        let tangents = [first, normal.cross(&first)];
        // Change of the velocity between the bodies by an impulse of 1 in this direction.
        let unit = |direction: &Vector3<f64>| -> Vector3<f64> {
            let of_each = [own, other].into_iter().zip(&arms).filter_map(|(body, arm)| Some((body?, arm)));
            of_each.map(|(body, arm)| at(&body.response(&with_arm(direction, arm)), arm)).sum()
        };
        let across = unit(&normal).dot(&normal);
        let both = tangents.map(|tangent| unit(&tangent));
        let k = Matrix2::from_fn(|i, j| both[j].dot(&tangents[i]));
        let (size, trace) = (k.m11.max(k.m22), k.trace());
        let along = if k.determinant() > 1e-12 * size * size { k.try_inverse() } else { None };
        // In a plane, or where a body cannot move along one of the two.
        let inverse = |k: f64| if k > 1e-12 * size { 1.0 / k } else { 0.0 };
        let along = along.unwrap_or(Matrix2::from_diagonal(&k.diagonal().map(inverse)));
        let mut touch = Self {
            found,
            normal,
            arms,
            tangents,
            across,
            along,
            least_along: if trace > 0.0 { 1.0 / trace } else { 0.0 },
            closes: false,
            least: 0.0,
            pressing: 0.0,
            sliding: Vector2::zeros(),
            shift: 0.0,
        };
        let [start, end] = [touch.relative(bodies, |b| &b.start), touch.relative(bodies, |b| &b.end)]
            .map(|velocity| velocity.dot(&normal));
        touch.least = -touch.found.restitution * start.min(0.0);
        touch.closes = touch.found.gap <= 0.0 || (0.5 * dt).mul_add(end, touch.found.gap) < 0.0;
        touch
    }

    /// Velocity of the body relative to the other at the contact, m/s.
    fn relative(&self, bodies: &[Body], of: impl Fn(&Body) -> &Pair) -> Vector3<f64> {
        let own = at(of(&bodies[self.found.body]), &self.arms[0]);
        self.found.other.map_or(own, |other| own - at(of(&bodies[other]), &self.arms[1]))
    }

    /// Impulses on both bodies by an impulse on the first: number of the body, impulse and angular impulse.
    fn both(&self, impulse: &Vector3<f64>) -> impl Iterator<Item = (usize, Pair)> {
        let bodies = [(Some(self.found.body), *impulse), (self.found.other, -*impulse)];
        let pushes = bodies.into_iter().zip(self.arms);
        pushes.filter_map(|((body, impulse), arm)| Some((body?, with_arm(&impulse, &arm))))
    }

    /// Gives an impulse to the body and its opposite to the other.
    fn give(&self, bodies: &mut [Body], impulse: &Vector3<f64>) {
        for (body, push) in self.both(impulse) {
            let body = &mut bodies[body];
            let change = body.response(&push);
            for k in 0..2 {
                body.push[k] += push[k];
                body.end[k] += change[k];
            }
        }
    }

    /// Corrects the impulse; returns the change of velocity, m/s.
    fn correct(&mut self, bodies: &mut [Body], dt: f64) -> f64 {
        if self.across <= 0.0 {
            return 0.0;
        }
        let outward = self.relative(bodies, |b| &b.end).dot(&self.normal);
        self.closes |= (0.5 * dt).mul_add(outward, self.found.gap) < 0.0;
        if !self.closes {
            return 0.0;
        }
        let wanted = (self.pressing + (self.least - outward) / self.across).max(0.0);
        let more = wanted - self.pressing;
        self.pressing = wanted;
        self.give(bodies, &(self.normal * more));
        let velocity = self.relative(bodies, |b| &b.end);
        let slip = Vector2::from(self.tangents.map(|tangent| velocity.dot(&tangent)));
        let mut sliding = self.sliding - self.along * slip;
        let most = self.found.friction * self.pressing;
        if sliding.norm() > most {
            // Sliding: the same factor along both tangents, so that friction opposes the velocity.
            sliding = self.sliding - self.least_along * slip;
            let size = sliding.norm();
            if size > most {
                sliding *= most / size;
            }
        }
        let change = sliding - self.sliding;
        self.sliding = sliding;
        self.give(bodies, &(change[0] * self.tangents[0] + change[1] * self.tangents[1]));
        self.across * (more.abs() + change.norm())
    }

    /// Corrects the velocity of the second pass, along the normal alone; returns its change, m/s.
    fn separate(&mut self, bodies: &mut [Body]) -> f64 {
        if self.across <= 0.0 {
            return 0.0;
        }
        let outward = self.relative(bodies, |b| &b.shift).dot(&self.normal);
        let wanted = (self.shift + (self.least - outward) / self.across).max(0.0);
        let more = wanted - self.shift;
        self.shift = wanted;
        for (body, push) in self.both(&(self.normal * more)) {
            let change = bodies[body].response(&push);
            (0..2).for_each(|k| bodies[body].shift[k] += change[k]);
        }
        self.across * more.abs()
    }
}
