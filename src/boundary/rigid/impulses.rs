//! Impulses at the contacts of rigid bodies in a step.
//!
//! Moreau's time stepping (Moreau 1988; Jean 1999): where a gap would close within the step, the normal
//! velocity at its end is at least -e times that at its start, and the impulse along the surface is at most μ
//! times that across it. Impulses are found one after the other in a fixed order, over and over (Gauss and
//! Seidel), until none changes. Bodies move with the mean of their velocities at start and end. A second pass
//! removes part of the overlap that remains at the end: it moves bodies and gives them no velocity.
use super::find::Found;
use super::{Push, Surroundings, dot};
use crate::boundary::collider::cross;
use crate::boundary::motion::{Pose, Rate, length};
use crate::geometry::vector::in_space;

/// Most sweeps over all contacts.
const SWEEPS: usize = 1000;
/// Change of velocity, relative to the greatest one at a contact, at which the sweeps end.
const CONVERGED: f64 = 1e-12;
/// Share of an overlap that a step removes.
const TAKEN_BACK: f64 = 0.15;

/// A collider among contacts.
struct Body {
    centre: [f64; 3],
    /// 1 / mass along each axis; 0 where it cannot be moved, 1/kg.
    lightness: [f64; 3],
    /// Inverse of the inertia in space, 1/(kg m²).
    inverse: [[f64; 3]; 3],
    start: [[f64; 3]; 2],
    end: [[f64; 3]; 2],
    push: Push,
    /// Velocities of the second pass.
    shift: [[f64; 3]; 2],
}

impl Body {
    fn new<const D: usize>(all: &Surroundings<'_, D>, c: usize, pose: &Pose<D>, mean: &Rate<D>) -> Self {
        let (collider, state) = (&all.colliders[c], &all.states[c]);
        let spin = |rate: &Rate<D>| -> [f64; 3] {
            std::array::from_fn(|a| rate.spin.mul_add(collider.axis[a], rate.turning[a]))
        };
        let mean = [in_space(&mean.velocity), spin(mean)];
        let (mut lightness, mut inverse, mut start) = ([0.0; 3], [[0.0; 3]; 3], mean);
        if let (Some(free), Some(_)) = (collider.free(), collider.meeting()) {
            for a in (0..D).filter(|&a| free.along[a]) {
                start[0][a] = state.rate.velocity[a];
                lightness[a] = 1.0 / free.mass;
            }
            if free.turns() {
                start[1] = spin(&state.rate);
            }
            if let Some(inertia) = &free.turning {
                for k in 0..3 {
                    let unit = std::array::from_fn(|a| if a == k { 1.0 } else { 0.0 });
                    inverse[k] = inertia.spin(&unit, &pose.orientation);
                }
            } else if let Some(inertia) = free.inertia {
                let axis = &collider.axis;
                inverse = std::array::from_fn(|i| std::array::from_fn(|j| axis[i] * axis[j] / inertia));
            }
        }
        let end = std::array::from_fn(|k| std::array::from_fn(|a| 2.0 * mean[k][a] - start[k][a]));
        let (push, shift) = (Push::default(), [[0.0; 3]; 2]);
        Self { centre: in_space(&collider.centre(pose)), lightness, inverse, start, end, push, shift }
    }

    /// Change of velocities by an impulse of this arm.
    fn response(&self, arm: &[f64; 3], impulse: &[f64; 3]) -> [[f64; 3]; 2] {
        let turn = cross(*arm, *impulse);
        [
            std::array::from_fn(|a| self.lightness[a] * impulse[a]),
            std::array::from_fn(|a| dot(&self.inverse[a], &turn)),
        ]
    }
}

/// Velocity of a point with this arm, m/s.
fn at([velocity, spin]: &[[f64; 3]; 2], arm: &[f64; 3]) -> [f64; 3] {
    let turning = cross(*spin, *arm);
    std::array::from_fn(|a| velocity[a] + turning[a])
}

/// A contact while impulses are sought.
struct Touch {
    found: Found,
    arms: [[f64; 3]; 2],
    tangents: [[f64; 3]; 2],
    /// Velocity along the normal by an impulse of 1 along it, 1/kg.
    across: f64,
    /// Inverse of the same along the surface, kg.
    along: [[f64; 2]; 2],
    /// Not above its least eigenvalue, kg.
    least_along: f64,
    /// Whether the gap closes within the step.
    closes: bool,
    least: f64,
    normal: f64,
    sliding: [f64; 2],
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
        most.max(length(&start)).max(length(&end))
    });
    sweep(&mut touches, CONVERGED * scale, |touch| touch.correct(&mut bodies, dt));
    for touch in &mut touches {
        let outward = dot(&touch.relative(&bodies, |b| &b.end), &touch.found.normal);
        let left = (0.5 * dt).mul_add(outward, touch.found.gap);
        touch.least = if left < 0.0 { -TAKEN_BACK * left / dt } else { -left / dt };
    }
    sweep(&mut touches, CONVERGED * scale, |touch| touch.separate(&mut bodies));
    for (c, body) in bodies.iter().enumerate() {
        pushes[c] = body.push;
        if all.colliders[c].meeting().is_none()
            || (body.push == Push::default() && body.shift == [[0.0; 3]; 2])
        {
            continue;
        }
        let gained: [[f64; 3]; 2] = {
            let turn: [f64; 3] = std::array::from_fn(|a| dot(&body.inverse[a], &body.push.turn));
            let way: [f64; 3] = std::array::from_fn(|a| body.lightness[a] * body.push.impulse[a]);
            [way, turn]
        };
        let more: [[f64; 3]; 2] =
            std::array::from_fn(|k| std::array::from_fn(|a| 0.5f64.mul_add(gained[k][a], body.shift[k][a])));
        let rate = &mut rates[c];
        (0..D).for_each(|a| rate.velocity[a] += more[0][a]);
        if all.colliders[c].turns_freely() {
            (0..3).for_each(|a| rate.turning[a] += more[1][a]);
        } else {
            rate.spin += dot(&more[1], &all.colliders[c].axis);
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
        let n = &found.normal;
        let arm = |body: &Body| std::array::from_fn(|a| found.point[a] - body.centre[a]);
        let arms = [arm(&bodies[found.body]), found.other.map_or([0.0; 3], |other| arm(&bodies[other]))];
        let least = (0..3).fold(0, |best, a| if n[a].abs() < n[best].abs() { a } else { best });
        let first = cross(*n, std::array::from_fn(|a| if a == least { 1.0 } else { 0.0 }));
        let long = length(&first);
        let first = first.map(|c| c / long);
        let tangents = [first, cross(*n, first)];
        let mut touch = Self {
            found,
            arms,
            tangents,
            across: 0.0,
            along: [[0.0; 2]; 2],
            least_along: 0.0,
            closes: false,
            least: 0.0,
            normal: 0.0,
            sliding: [0.0; 2],
            shift: 0.0,
        };
        let unit = |direction: &[f64; 3]| {
            let sum = |body: &Body, arm: &[f64; 3]| at(&body.response(arm, direction), arm);
            let own = sum(&bodies[found.body], &arms[0]);
            let theirs = found.other.map_or([0.0; 3], |other| sum(&bodies[other], &arms[1]));
            let both: [f64; 3] = std::array::from_fn(|a| own[a] + theirs[a]);
            both
        };
        touch.across = dot(&unit(n), n);
        let [one, two] = [unit(&tangents[0]), unit(&tangents[1])];
        let k = [
            [dot(&one, &tangents[0]), dot(&two, &tangents[0])],
            [dot(&one, &tangents[1]), dot(&two, &tangents[1])],
        ];
        let determinant = k[0][0] * k[1][1] - k[0][1] * k[1][0];
        let size = k[0][0].max(k[1][1]);
        let trace = k[0][0] + k[1][1];
        touch.least_along = if trace > 0.0 { 1.0 / trace } else { 0.0 };
        touch.along = if determinant > 1e-12 * size * size {
            [[k[1][1] / determinant, -k[0][1] / determinant], [-k[1][0] / determinant, k[0][0] / determinant]]
        } else {
            // In a plane, or where a body cannot move along one of the two.
            let inverse = |k: f64| if k > 1e-12 * size { 1.0 / k } else { 0.0 };
            [[inverse(k[0][0]), 0.0], [0.0, inverse(k[1][1])]]
        };
        let [start, end] = [touch.relative(bodies, |b| &b.start), touch.relative(bodies, |b| &b.end)]
            .map(|velocity| dot(&velocity, n));
        touch.least = -found.restitution * start.min(0.0);
        touch.closes = found.gap <= 0.0 || (0.5 * dt).mul_add(end, found.gap) < 0.0;
        touch
    }

    /// Velocity of the body relative to the other at the contact, m/s.
    fn relative(&self, bodies: &[Body], of: impl Fn(&Body) -> &[[f64; 3]; 2]) -> [f64; 3] {
        let own = at(of(&bodies[self.found.body]), &self.arms[0]);
        let theirs = self.found.other.map_or([0.0; 3], |other| at(of(&bodies[other]), &self.arms[1]));
        std::array::from_fn(|a| own[a] - theirs[a])
    }

    /// Impulses on both bodies by an impulse on the first: number of the body, impulse, and its arm.
    fn both(&self, impulse: &[f64; 3]) -> impl Iterator<Item = (usize, [f64; 3], [f64; 3])> {
        let bodies = [(Some(self.found.body), *impulse), (self.found.other, impulse.map(|c| -c))];
        bodies.into_iter().zip(self.arms).filter_map(|((body, impulse), arm)| Some((body?, impulse, arm)))
    }

    /// Gives an impulse to the body and its opposite to the other.
    fn give(&self, bodies: &mut [Body], impulse: &[f64; 3]) {
        for (body, impulse, arm) in self.both(impulse) {
            let body = &mut bodies[body];
            let (turn, change) = (cross(arm, impulse), body.response(&arm, &impulse));
            for a in 0..3 {
                body.push.impulse[a] += impulse[a];
                body.push.turn[a] += turn[a];
                for k in 0..2 {
                    body.end[k][a] += change[k][a];
                }
            }
        }
    }

    /// Corrects the impulse; returns the change of velocity, m/s.
    fn correct(&mut self, bodies: &mut [Body], dt: f64) -> f64 {
        if self.across <= 0.0 {
            return 0.0;
        }
        let outward = dot(&self.relative(bodies, |b| &b.end), &self.found.normal);
        self.closes |= (0.5 * dt).mul_add(outward, self.found.gap) < 0.0;
        if !self.closes {
            return 0.0;
        }
        let wanted = (self.normal + (self.least - outward) / self.across).max(0.0);
        let more = wanted - self.normal;
        self.normal = wanted;
        self.give(bodies, &self.found.normal.map(|n| n * more));
        let velocity = self.relative(bodies, |b| &b.end);
        let slip = self.tangents.each_ref().map(|t| dot(&velocity, t));
        let mut sliding: [f64; 2] = std::array::from_fn(|k| {
            self.sliding[k] - self.along[k][0].mul_add(slip[0], self.along[k][1] * slip[1])
        });
        let most = self.found.friction * self.normal;
        if length(&sliding) > most {
            // Sliding: the same factor along both tangents, so that friction opposes the velocity.
            sliding = std::array::from_fn(|k| (-self.least_along).mul_add(slip[k], self.sliding[k]));
            let size = length(&sliding);
            if size > most {
                sliding = sliding.map(|s| s * (most / size));
            }
        }
        let change: [f64; 2] = std::array::from_fn(|k| sliding[k] - self.sliding[k]);
        self.sliding = sliding;
        let [t, u] = &self.tangents;
        self.give(bodies, &std::array::from_fn(|a| change[0].mul_add(t[a], change[1] * u[a])));
        self.across * (more.abs() + length(&change))
    }

    /// Corrects the velocity of the second pass, along the normal alone; returns its change, m/s.
    fn separate(&mut self, bodies: &mut [Body]) -> f64 {
        if self.across <= 0.0 {
            return 0.0;
        }
        let outward = dot(&self.relative(bodies, |b| &b.shift), &self.found.normal);
        let wanted = (self.shift + (self.least - outward) / self.across).max(0.0);
        let more = wanted - self.shift;
        self.shift = wanted;
        for (body, impulse, arm) in self.both(&self.found.normal.map(|n| n * more)) {
            let change = bodies[body].response(&arm, &impulse);
            for k in 0..2 {
                (0..3).for_each(|a| bodies[body].shift[k][a] += change[k][a]);
            }
        }
        self.across * more.abs()
    }
}
