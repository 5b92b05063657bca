//! Free rigid bodies: their rotation, and their contact with faces of the domain, with other colliders and
//! with each other.
//!
//! | file | what it holds |
//! |---|---|
//! | `turning` | inertia, orientation, and the rotation of a body without torque |
//! | `numbers` | the state of a free body as stored in checkpoints |
//! | `features` | points of a body that may touch something |
//! | `meeting` `surroundings` | law of collisions; what bodies may touch, and the impulses on it |
//! | `find` | contacts of bodies in a step |
//! | `impulses` | impulses at all of them |
//! | this | a step of all free bodies |
//!
//! All ranks know all colliders and do the same sums in the same order.
mod features;
mod find;
mod impulses;
mod meeting;
mod numbers;
mod surroundings;
pub mod turning;

pub use features::Features;
pub use meeting::Meeting;
pub use surroundings::{Push, Surroundings};

use super::motion::{Motion, Pose, Rate};

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

#[cfg(test)]
mod tests;
