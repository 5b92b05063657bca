//! The two lengths of a time step.
//!
//! Velocities belong to times half a step before those of places (leapfrog; Verlet 1967). At the start of a
//! step from the time t, places, stress and forces belong to t, and velocities to the middle of the step
//! before. Forces act over the time from there to the middle of this step, the *kick*; then places follow the
//! new velocities over the whole step, the *drift*. Both are taken in the middle of the time over which they
//! act, so the step is of second order, whatever the lengths of the steps are.

/// Lengths of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lengths {
    /// Time over which forces act on velocities, s.
    pub kick: f64,
    /// Time over which places follow the velocities, s: that by which the clock moves on.
    pub drift: f64,
}

impl Lengths {
    /// No time: shows velocities between two steps.
    pub const NONE: Self = Self { kick: 0.0, drift: 0.0 };

    /// Those of a step of length `dt` (s) ahead of which velocities lag by `lag`, s: half of the step before,
    /// and nothing where velocities are those of the present time.
    pub fn new(lag: f64, dt: f64) -> Self {
        Self { kick: 0.5f64.mul_add(dt, lag), drift: dt }
    }

    /// Middle of the time over which forces act in a step from the time `start`, s.
    pub fn middle_of_kick(&self, start: f64) -> f64 {
        0.5f64.mul_add(self.drift - self.kick, start)
    }

    /// Middle of the step from the time `start`, s: the time of its velocities.
    pub fn middle_of_drift(&self, start: f64) -> f64 {
        0.5f64.mul_add(self.drift, start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An oscillator from rest, with steps that differ by a factor of 3 and more.
    fn error(steps: usize) -> f64 {
        let (mut x, mut v, mut lag, mut time) = (1.0_f64, 0.0, 0.0, 0.0);
        for step in 0..steps {
            let dt = (2.0 + (0.3 * step as f64).sin() * 1.0) / steps as f64;
            let lengths = Lengths::new(lag, dt);
            v -= lengths.kick * x;
            x += lengths.drift * v;
            (lag, time) = (0.5 * dt, time + dt);
        }
        (x - time.cos()).abs()
    }

    #[test]
    fn steps_are_of_second_order_whatever_their_lengths() {
        let order = (error(100) / error(400)).log2() / 2.0;
        assert!((1.9..2.1).contains(&order), "{order}");
    }

    #[test]
    fn kicks_meet_in_the_middles_of_steps() {
        let (first, second) = (Lengths::new(0.0, 0.5), Lengths::new(0.25, 1.0));
        assert_eq!([first.kick, second.kick], [0.25, 0.75]);
        // Over 0 to 0.25 and from there to 1.
        assert_eq!([first.middle_of_kick(0.0), second.middle_of_kick(0.5)], [0.125, 0.625]);
        assert_eq!(second.middle_of_drift(0.5), 1.0);
    }
}
