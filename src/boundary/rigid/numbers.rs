//! The state of a free body as numbers, as stored in checkpoints.
use nalgebra::{Quaternion, UnitQuaternion};

use super::turning::quaternion;
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
            all.extend(quaternion(&pose.orientation));
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
        let mut rest = [0.0; 7];
        for (k, part) in rest.iter_mut().enumerate() {
            *part = number(2 * D + 2 + k)?;
        }
        let [w, x, y, z, momentum @ ..] = rest;
        // As it was: a length of one that is found anew would change the last digits.
        let orientation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        let rate = Rate { turning: inertia.spin(&momentum, &orientation), ..rate };
        Some(ColliderState { pose: Pose::oriented(translation, orientation), rate, momentum })
    }

    /// Whether it is a free body that turns about any axis.
    pub fn turns_freely(&self) -> bool {
        self.free().is_some_and(|free| free.turning.is_some())
    }
}
