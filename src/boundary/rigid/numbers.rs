//! The state of a free body as numbers, as stored in checkpoints.
use nalgebra::{Quaternion, UnitQuaternion};

use super::turning::quaternion;
use crate::boundary::motion::{Pose, Rate};
use crate::boundary::{Collider, ColliderState};
use crate::saved::Saved;

impl<const D: usize> Collider<D> {
    /// The state of a free body, the collider numbered `index`; others follow from the time.
    pub fn save(&self, index: usize, state: &mut ColliderState<D>, saved: &mut Saved<'_>) {
        if self.free().is_none() {
            return;
        }
        let mut numbers = self.numbers(state);
        for (i, number) in numbers.iter_mut().enumerate() {
            saved.real(format!("collider_{index}_state_{i}"), number);
        }
        if saved.is_reading() {
            *state = self.state_of(&numbers);
        }
    }

    /// A state as numbers: translation, velocity, angle, angular velocity, and of a body that turns about any
    /// axis orientation and angular momentum.
    fn numbers(&self, state: &ColliderState<D>) -> Vec<f64> {
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

    /// A state from its numbers.
    fn state_of(&self, numbers: &[f64]) -> ColliderState<D> {
        let translation = std::array::from_fn(|a| numbers[a]);
        let velocity = std::array::from_fn(|a| numbers[D + a]);
        let (angle, rate) = (numbers[2 * D], Rate::about_axis(velocity, numbers[2 * D + 1]));
        let Some(inertia) = self.free().and_then(|free| free.turning) else {
            return self.state((translation, angle), rate);
        };
        let [w, x, y, z, momentum @ ..]: [f64; 7] = std::array::from_fn(|k| numbers[2 * D + 2 + k]);
        // As it was: a length of one that is found anew would change the last digits.
        let orientation = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
        let rate = Rate { turning: inertia.spin(&momentum, &orientation), ..rate };
        ColliderState { pose: Pose::oriented(translation, orientation), rate, momentum }
    }

    /// Whether it is a free body that turns about any axis.
    pub fn turns_freely(&self) -> bool {
        self.free().is_some_and(|free| free.turning.is_some())
    }
}
