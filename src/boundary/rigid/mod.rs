//! Free rigid bodies: their rotation, and their contact with faces of the domain, with other colliders and
//! with each other.
//!
//! | file | what it holds |
//! |---|---|
//! | `turning` | inertia, orientation, and the rotation of a body without torque |
//! | `numbers` | the state of a free body as stored in checkpoints |
//! | `features` | points of a body that may touch something |
//! | `find` | contacts of bodies in a step |
//! | `impulses` | impulses at all of them |
//! | this | a step of all free bodies |
//!
//! All ranks know all colliders and do the same sums in the same order.
mod features;
mod find;
mod impulses;
mod numbers;
pub mod turning;

pub use features::Features;

use super::motion::{Motion, Pose, Rate};
use super::{Collider, ColliderState, Contact};

/// Friction and restitution of a free body in collisions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Coefficient of friction.
    pub friction: f64,
    /// Coefficient of restitution: speed after over speed before the collision.
    pub restitution: f64,
}

/// Colliders and faces of the domain that bodies may touch in a step.
pub struct Surroundings<'a, const D: usize> {
    /// All colliders, in their order.
    pub colliders: &'a [Collider<D>],
    /// Their states at the start of the step.
    pub states: &'a [ColliderState<D>],
    /// Points of each collider that may touch something.
    pub features: &'a [Features<D>],
    /// Conditions on the lower and upper face of the domain along each axis.
    pub faces: &'a [[Contact; 2]; D],
    /// Upper corner of the domain, m.
    pub extent: [f64; D],
}

/// Impulse (kg m/s) and angular impulse about the reference point (kg m²/s) on a collider in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Push {
    /// Impulse.
    pub impulse: [f64; 3],
    /// Angular impulse.
    pub turn: [f64; 3],
}

impl<const D: usize> Surroundings<'_, D> {
    /// Changes the mean velocities of free bodies that touch something in a step of length `dt` (s). Returns
    /// the impulses on each collider.
    pub fn touch(&self, rates: &mut [Rate<D>], dt: f64) -> Vec<Push> {
        let mut pushes = vec![Push::default(); self.colliders.len()];
        if dt <= 0.0 || !self.colliders.iter().any(|collider| collider.meeting().is_some()) {
            return pushes;
        }
        let halfway: Vec<Pose<D>> =
            (0..self.colliders.len()).map(|c| self.halfway(c, &rates[c], dt)).collect();
        let found = find::contacts(self, &halfway, rates, dt);
        if !found.is_empty() {
            impulses::solve(self, &halfway, found, rates, &mut pushes, dt);
        }
        pushes
    }

    /// Pose of a collider in the middle of the step if nothing touches it. Contacts are found there, so that
    /// an impulse in the middle of the step conserves the angular momentum of both bodies.
    fn halfway(&self, c: usize, mean: &Rate<D>, dt: f64) -> Pose<D> {
        let (collider, state) = (&self.colliders[c], &self.states[c]);
        let pose = &state.pose;
        if matches!(collider.motion, Motion::Fixed) || !collider.is_present() {
            return *pose;
        }
        let half = 0.5 * dt;
        let velocity = if collider.free().is_some() { state.rate.velocity } else { mean.velocity };
        let translation = std::array::from_fn(|a| half.mul_add(velocity[a], pose.translation[a]));
        if collider.turns_freely() {
            let turn = mean.turning.map(|w| half * w);
            return Pose::oriented(translation, turning::advanced(&pose.orientation, &turn));
        }
        Pose::new(translation, half.mul_add(mean.spin, pose.angle), collider.axis)
    }
}

/// A vector of space as one of the job.
pub(super) fn in_plane<const D: usize>(v: &[f64; 3]) -> [f64; D] {
    std::array::from_fn(|a| v[a])
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).fold(0.0, |sum, k| a[k].mul_add(b[k], sum))
}

#[cfg(test)]
mod tests;
