//! Rigid bodies that act on the nodes inside them, or on the particles that touch them, and are acted on.
//!
//! Where they act on nodes: at the foot of a node inside a collider (signed distance at most 0) on its
//! surface the condition holds for the velocity relative to the surface, with the gradient of the signed
//! distance as normal. The momentum that this takes from the material is what the material gives to the
//! collider: its force and torque.
use super::Contact;
use super::motion::{Free, Motion, Pose, Rate, Table};
use super::rigid::Meeting;
use super::rigid::turning::{self, Orientation};
use super::vector::{cross, length};
use crate::geometry::mesh::Deforming;
use crate::geometry::vector::in_space;
use crate::geometry::{Aabb, Shape};
use crate::text::quantity;

/// Nodes or particles, on which a collider acts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ActsOn {
    /// On the nodes inside it.
    #[default]
    Nodes,
    /// On the particles that touch its surface (see [`super::touching`]).
    Particles,
}

/// A collider as the job describes it; in a run only the shape of one that deforms changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Collider<const D: usize> {
    /// Name.
    pub name: String,
    /// Shape in its place in the job; of a deforming collider the shape of the step.
    pub shape: Shape<D>,
    /// How it deforms.
    pub deforming: Option<Deforming>,
    /// The point that rotations leave in place and torques refer to, in the job, m.
    pub reference: [f64; D],
    /// Unit axis of rotations; z in 2D.
    pub axis: [f64; 3],
    /// Law of contact with the material.
    pub contact: Contact,
    /// Whether it acts on nodes or on particles.
    pub acts_on: ActsOn,
    /// How it moves.
    pub motion: Motion<D>,
    /// Time from which that of its motion is counted, s; infinite where it is not there.
    pub start: f64,
}

/// Pose and velocity of a collider, between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColliderState<const D: usize> {
    /// Pose.
    pub pose: Pose<D>,
    /// Velocities; of a prescribed motion the mean ones of the step done last.
    pub rate: Rate<D>,
    /// Angular momentum about the centre of mass of a body that turns about any axis, kg m²/s.
    pub momentum: [f64; 3],
}

impl<const D: usize> Collider<D> {
    /// The state at a time (s); of a free body that at the start.
    pub fn state_at(&self, time: f64) -> ColliderState<D> {
        let own = if self.is_present() { time - self.start } else { 0.0 };
        let rate = match &self.motion {
            Motion::Table(_) | Motion::Rising(..) => Rate::REST,
            motion => motion.mean_rate(own, 0.0),
        };
        let state = self.state(self.motion.place(own), rate);
        match self.free().and_then(|free| free.turning) {
            Some(inertia) => {
                ColliderState { momentum: inertia.momentum(&rate.turning, &Orientation::identity()), ..state }
            }
            None => state,
        }
    }

    /// Whether it acts on the material, and moves.
    pub fn is_present(&self) -> bool {
        self.start.is_finite()
    }

    /// A state from its numbers: displacement of the reference point (m) with the angle (rad), and
    /// velocities.
    pub fn state(&self, place: ([f64; D], f64), rate: Rate<D>) -> ColliderState<D> {
        ColliderState { pose: Pose::new(place.0, place.1, self.axis), rate, momentum: [0.0; 3] }
    }

    /// The free body, if it is one.
    pub fn free(&self) -> Option<&Free<D>> {
        if let Motion::Free(free) = &self.motion { Some(free) } else { None }
    }

    /// Friction and restitution in collisions with other colliders, if this is a free body that is present
    /// and collides.
    pub fn meeting(&self) -> Option<Meeting> {
        self.free().and_then(|free| free.meeting).filter(|_| self.is_present())
    }

    /// Where the reference point is, m.
    pub fn centre(&self, pose: &Pose<D>) -> [f64; D] {
        std::array::from_fn(|a| self.reference[a] + pose.translation[a])
    }

    /// Whether it acts on nodes, in this stage.
    pub fn acts_on_nodes(&self) -> bool {
        self.acts_on == ActsOn::Nodes && self.is_present()
    }

    /// Whether it acts on particles, in this stage.
    pub fn acts_on_particles(&self) -> bool {
        self.acts_on == ActsOn::Particles && self.is_present()
    }

    /// Where the point `x` of space (m) lies in the collider as the job has it.
    pub fn to_own(&self, x: &[f64; D], pose: &Pose<D>) -> [f64; D] {
        let centre = self.centre(pose);
        std::array::from_fn(|i| {
            (0..D).fold(self.reference[i], |sum, j| pose.rotation[j][i].mul_add(x[j] - centre[j], sum))
        })
    }

    /// Where the point `y` (m) of the collider as the job has it lies in space.
    pub fn to_space(&self, y: &[f64; D], pose: &Pose<D>) -> [f64; D] {
        let turned = self.turned(&std::array::from_fn(|a| y[a] - self.reference[a]), pose);
        let centre = self.centre(pose);
        std::array::from_fn(|a| centre[a] + turned[a])
    }

    /// A vector of the collider as the job has it, turned with it.
    pub fn turned(&self, own: &[f64; D], pose: &Pose<D>) -> [f64; D] {
        std::array::from_fn(|i| (0..D).fold(0.0, |sum, j| pose.rotation[i][j].mul_add(own[j], sum)))
    }

    /// Signed distance of a point `x` (m) to the surface of the collider in a pose, m; negative inside. For
    /// booleans of shapes a bound, never larger in magnitude (see [`crate::geometry`]).
    pub fn distance(&self, x: &[f64; D], pose: &Pose<D>) -> f64 {
        self.shape.distance(&self.to_own(x, pose))
    }

    /// Lower bound on the distance of a box to the collider in a pose, m: the distance of its centre less its
    /// half diagonal. Not above 0 for every box that meets the collider.
    pub fn distance_to_box(&self, aabb: &Aabb<D>, pose: &Pose<D>) -> f64 {
        self.distance(&aabb.centre(), pose) - aabb.half_diagonal()
    }

    /// Outward unit normal at a point: the gradient of the signed distance.
    pub fn normal(&self, x: &[f64; D], pose: &Pose<D>) -> [f64; D] {
        self.turned(&self.shape.gradient(&self.to_own(x, pose)), pose)
    }

    /// Sets the shape that it has at a time (s), if it deforms.
    pub fn deform(&mut self, time: f64) {
        let (is_present, start) = (self.is_present(), self.start);
        let Some(deforming) = self.deforming.as_mut().filter(|_| is_present) else { return };
        if let Some(mesh) = deforming.advance(time - start) {
            self.shape = Shape::Mesh(mesh);
        }
    }

    /// Velocity of the collider at a point `x` of its surface: `V + ω × (x - c)`, and that of its
    /// deformation, m/s.
    pub fn velocity_at(&self, x: &[f64; D], pose: &Pose<D>, rate: &Rate<D>) -> [f64; D] {
        let rigid = self.rigid_velocity_at(x, pose, rate);
        let (Some(deforming), Shape::Mesh(mesh)) = (&self.deforming, &self.shape) else { return rigid };
        let velocity = deforming.velocity(mesh, &in_space(&self.to_own(x, pose)));
        let turned = self.turned(&std::array::from_fn(|a| velocity[a]), pose);
        std::array::from_fn(|a| rigid[a] + turned[a])
    }

    fn rigid_velocity_at(&self, x: &[f64; D], pose: &Pose<D>, rate: &Rate<D>) -> [f64; D] {
        let turns = rate.turning != [0.0; 3];
        if rate.spin == 0.0 && !turns {
            return rate.velocity;
        }
        let centre = self.centre(pose);
        let arm = in_space::<D>(&std::array::from_fn(|a| x[a] - centre[a]));
        if turns {
            let cross = cross(rate.turning, arm);
            return std::array::from_fn(|a| rate.velocity[a] + cross[a]);
        }
        let cross = cross(self.axis, arm);
        std::array::from_fn(|a| rate.spin.mul_add(cross[a], rate.velocity[a]))
    }

    /// Mean velocities over the step from `time` to `time + dt` (s). A free body gains `dt g`; the impulse of
    /// the material in the step acts from the next one on.
    pub fn step_rate(&self, state: &ColliderState<D>, gravity: &[f64; D], time: f64, dt: f64) -> Rate<D> {
        match &self.motion {
            _ if !self.is_present() => Rate::REST,
            Motion::Free(free) => {
                let driven = free.driven.mean_rate(time - self.start, dt);
                Rate {
                    velocity: std::array::from_fn(|a| match free.along[a] {
                        true => (0.5 * dt).mul_add(gravity[a], state.rate.velocity[a]),
                        false => driven.velocity[a],
                    }),
                    spin: if free.turns() { state.rate.spin } else { driven.spin },
                    turning: free
                        .turning
                        .map_or([0.0; 3], |own| own.mean_spin(&state.momentum, &state.pose.orientation, dt)),
                }
            }
            motion => motion.mean_rate(time - self.start, dt),
        }
    }

    /// Pose after a step of length `dt` (s) that ends at `time` (s), in which the collider moved with `mean`:
    /// the impulse of the material on a free body in a step moves it in the next.
    pub fn next_pose(&self, state: &ColliderState<D>, mean: &Rate<D>, [time, dt]: [f64; 2]) -> Pose<D> {
        self.advanced(state, mean, &[0.0; D], [time, dt], [0.0; D], [0.0; 3]).pose
    }

    /// The state after a step that ends at `time` (s) and was `dt` long, in which the collider moved with
    /// `mean` and got the given impulse (kg m/s) and angular impulse about its reference point (kg m²/s).
    /// Without contact a free body follows the parabola of its fall exactly.
    pub fn advanced(
        &self,
        state: &ColliderState<D>,
        mean: &Rate<D>,
        gravity: &[f64; D],
        [time, dt]: [f64; 2],
        impulse: [f64; D],
        torque: [f64; 3],
    ) -> ColliderState<D> {
        if !self.is_present() {
            return *state;
        }
        let Motion::Free(free) = &self.motion else {
            return self.state(self.motion.place(time - self.start), *mean);
        };
        let mut rate = *mean;
        let (mut translation, mut angle) = free.driven.place(time - self.start);
        for a in (0..D).filter(|&a| free.along[a]) {
            rate.velocity[a] = dt.mul_add(gravity[a], state.rate.velocity[a]) + impulse[a] / free.mass;
            translation[a] = dt.mul_add(mean.velocity[a], state.pose.translation[a]);
        }
        if let Some(inertia) = &free.turning {
            let turn = mean.turning.map(|w| dt * w);
            let orientation = turning::advanced(&state.pose.orientation, &turn);
            let momentum = std::array::from_fn(|a| state.momentum[a] + torque[a]);
            rate.turning = inertia.spin(&momentum, &orientation);
            return ColliderState { pose: Pose::oriented(translation, orientation), rate, momentum };
        }
        if let Some(inertia) = free.inertia {
            let about = (0..3).fold(0.0, |sum, a| self.axis[a].mul_add(torque[a], sum));
            rate.spin = state.rate.spin + about / inertia;
            angle = dt.mul_add(mean.spin, state.pose.angle);
        }
        self.state((translation, angle), rate)
    }

    /// Bound on the speed of any point of the collider within `extent` (the upper corner of the domain, m)
    /// from `time` on, m/s; of a free body that of the state.
    pub fn greatest_speed(&self, state: &ColliderState<D>, extent: &[f64; D], time: f64) -> f64 {
        let (speed, spin) = match &self.motion {
            _ if !self.is_present() => (0.0, 0.0),
            Motion::Free(free) => {
                let (own, driven) = (state.rate.speeds(), free.driven.greatest_speeds(time - self.start));
                (own.0 + driven.0, own.1.max(driven.1))
            }
            motion => motion.greatest_speeds(time - self.start),
        };
        let deformation = self.deforming.as_ref().map_or(0.0, |own| own.greatest_speed(time - self.start));
        let speed = speed + deformation;
        if spin == 0.0 {
            return speed;
        }
        // The farthest point: of a bounded shape a corner of its box; of others one of the domain, from the
        // place that the reference point has now.
        let farthest = |from: &[f64; D], aabb: &Aabb<D>| {
            let arm: [f64; D] =
                std::array::from_fn(|a| (from[a] - aabb.lower[a]).abs().max((aabb.upper[a] - from[a]).abs()));
            length(&arm)
        };
        let own = farthest(&self.reference, &self.shape.bounds());
        let inside = farthest(&self.centre(&state.pose), &Aabb::new([0.0; D], *extent));
        spin.mul_add(if own.is_finite() { own } else { inside }, speed)
    }
}

impl<const D: usize> std::fmt::Display for Collider<D> {
    /// Contact and motion in words.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}, ", self.contact)?;
        if self.acts_on == ActsOn::Particles {
            write!(f, "at particles, ")?;
        }
        if let Some(deforming) = &self.deforming {
            let duration = quantity(deforming.duration(), "s");
            write!(f, "deforming through {} meshes in {duration}, ", deforming.len())?;
        }
        let both = |speed: f64, spin: f64| format!("{}, {}", quantity(speed, "m/s"), quantity(spin, "rad/s"));
        let speeds = |rate: &Rate<D>| {
            let spin = if rate.spin == 0.0 { length(&rate.turning) } else { rate.spin };
            both(length(&rate.velocity), spin)
        };
        let rows = |table: &Table<D>| {
            let (speed, spin) = table.greatest_speeds(f64::NEG_INFINITY);
            let smooth = if table.is_smooth { "smooth " } else { "" };
            format!("a {smooth}table of {} rows, at most {}", table.rows.len(), both(speed, spin))
        };
        match &self.motion {
            Motion::Fixed => write!(f, "fixed"),
            Motion::Steady(rate) => write!(f, "steady with {}", speeds(rate)),
            Motion::Rising(rate, span) => {
                write!(f, "steady with {} after {}", speeds(rate), quantity(*span, "s"))
            }
            Motion::Table(table) => write!(f, "by {}", rows(table)),
            Motion::Free(free) => {
                let turns = if free.turning.is_some() { " about any axis" } else { "" };
                write!(f, "free{turns}, {}, at first {}", quantity(free.mass, "kg"), speeds(&free.start))?;
                if free.driven.rows.is_empty() {
                    Ok(())
                } else {
                    write!(f, ", driven by {}", rows(&free.driven))
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(motion: Motion<2>) -> Collider<2> {
        Collider {
            name: "disc".into(),
            shape: Shape::Box(Aabb::new([1.0, 0.0], [2.0, 0.5])),
            deforming: None,
            reference: [1.0, 0.0],
            axis: [0.0, 0.0, 1.0],
            contact: Contact::Sticky,
            acts_on: ActsOn::Nodes,
            motion,
            start: 0.0,
        }
    }

    #[test]
    fn poses_move_distances_normals_and_velocities() {
        let spin = std::f64::consts::FRAC_PI_2;
        let collider = disc(Motion::Steady(Rate::about_axis([0.0, 1.0], spin)));
        // Shifted by 1 m upwards and turned by 90 degrees: from x = 0.5 to 1, y = 1 to 2.
        let state = collider.state_at(1.0);
        let close = |a: [f64; 2], b: [f64; 2]| assert!(length(&[a[0] - b[0], a[1] - b[1]]) < 1e-15, "{a:?}");
        assert!((collider.distance(&[0.3, 1.5], &state.pose) - 0.2).abs() < 1e-15);
        close(collider.normal(&[0.3, 1.5], &state.pose), [-1.0, 0.0]);
        close(collider.velocity_at(&[1.0, 2.0], &state.pose, &state.rate), [-spin, 1.0]);
        let speed = collider.greatest_speed(&state, &[9.0, 9.0], 1.0);
        assert!((speed - (1.0 + spin * 1.25_f64.sqrt())).abs() < 1e-14, "{speed}");
    }

    #[test]
    fn free_bodies_fall_on_the_parabola_and_take_impulses() {
        let free = Free {
            mass: 2.0,
            along: [true, true],
            inertia: Some(0.5),
            turning: None,
            meeting: None,
            driven: Table::default(),
            start: Rate::about_axis([1.0, 3.0], 0.0),
        };
        let (collider, gravity) = (disc(Motion::Free(free)), [0.0, -10.0]);
        let (mut state, mut time) = (collider.state_at(0.0), 0.0);
        for step in 0..100 {
            let dt = 0.001 * f64::from(1 + step % 3);
            let mean = collider.step_rate(&state, &gravity, time, dt);
            time += dt;
            state = collider.advanced(&state, &mean, &gravity, [time, dt], [0.0; 2], [0.0; 3]);
        }
        let exact = [time, 3.0 * time - 5.0 * time * time];
        assert!((0..2).all(|a| (state.pose.translation[a] - exact[a]).abs() < 1e-14), "{state:?} {exact:?}");
        let hit = collider.advanced(&state, &state.rate, &[0.0; 2], [time, 0.0], [4.0, 0.0], [0.0, 0.0, 1.0]);
        assert_eq!(hit.rate.velocity, [state.rate.velocity[0] + 2.0, state.rate.velocity[1]]);
        assert_eq!(hit.rate.spin, 2.0);
    }
}
