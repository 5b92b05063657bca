//! The state of a free body as numbers, as stored in checkpoints.
use super::turning::Quaternion;
use crate::boundary::motion::{Pose, Rate};
use crate::boundary::{Collider, ColliderState};

impl<const D: usize> Collider<D> {
    /// A state as numbers: translation, velocity, angle, angular velocity, and of a body that turns about any
    /// axis orientation and angular momentum.
    pub fn numbers(&self, state: &ColliderState<D>) -> Vec<f64> {
        let ColliderState { pose, rate, momentum } = state;
        let mut all = pose.translation.to_vec();
        all.extend(rate.velocity);
        all.extend([pose.angle, rate.spin]);
        if self.turns_freely() {
            all.extend(pose.orientation);
            all.extend(momentum);
        }
        all
    }

    /// A state from its numbers, each given by `number`. `None` if one is missing.
    pub fn from_numbers(&self, number: impl Fn(usize) -> Option<f64>) -> Option<ColliderState<D>> {
        let (mut translation, mut velocity) = ([0.0; D], [0.0; D]);
        for a in 0..D {
            (translation[a], velocity[a]) = (number(a)?, number(D + a)?);
        }
        let rate = Rate::about_axis(velocity, number(2 * D + 1)?);
        let Some(inertia) = self.free().and_then(|free| free.turning) else {
            return Some(self.state((translation, number(2 * D)?), rate));
        };
        let (mut orientation, mut momentum): (Quaternion, _) = ([0.0; 4], [0.0; 3]);
        for (k, part) in orientation.iter_mut().chain(&mut momentum).enumerate() {
            *part = number(2 * D + 2 + k)?;
        }
        let rate = Rate { turning: inertia.spin(&momentum, &orientation), ..rate };
        Some(ColliderState { pose: Pose::oriented(translation, orientation), rate, momentum })
    }

    /// Whether it is a free body that turns about any axis.
    pub fn turns_freely(&self) -> bool {
        self.free().is_some_and(|free| free.turning.is_some())
    }
}
