//! Where a run is on its way to equilibrium.
use crate::solver::physics::Equilibrium;
use crate::text::quantity;

/// Where a run is on its way to equilibrium; the same on all ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Relaxation {
    /// Kinetic energy of the nodes in the last step, J; 0 once the velocities were set to 0.
    pub kinetic: f64,
    /// Root mean square of the velocities at the last peak, m/s.
    pub speed: f64,
    /// Root mean square of the unbalanced force per mass at the last time at rest, m/s².
    pub acceleration: f64,
    /// Times that velocities were set to 0.
    pub stops: u64,
    /// What the last step was.
    pub phase: RelaxPhase,
}

/// What a step on the way to equilibrium was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RelaxPhase {
    /// The kinetic energy has risen.
    #[default]
    Falling,
    /// It fell, and velocities were set to 0 after the step.
    Stopped,
    /// It began from rest, so that the unbalanced force is known.
    FromRest,
}

impl Relaxation {
    /// After a step of length `dt` (s) in which nodes of a mass (kg) had this kinetic energy (J). True if velocities are to be set to 0.
    pub(in crate::solver) fn note(&mut self, kinetic: f64, mass: f64, dt: f64) -> bool {
        let root_mean_square = |energy: f64| (2.0 * energy / mass).sqrt();
        let was_at_rest = self.phase == RelaxPhase::Stopped;
        if was_at_rest {
            self.acceleration = root_mean_square(kinetic) / dt;
        }
        // What does not move at all is at rest too.
        let is_peak = !was_at_rest && (kinetic < self.kinetic || kinetic == 0.0);
        if is_peak {
            self.speed = root_mean_square(self.kinetic);
            self.stops += 1;
        }
        self.kinetic = if is_peak { 0.0 } else { kinetic };
        self.phase = match (is_peak, was_at_rest) {
            (true, _) => RelaxPhase::Stopped,
            (false, true) => RelaxPhase::FromRest,
            (false, false) => RelaxPhase::Falling,
        };
        is_peak
    }

    /// Whether this is the equilibrium asked for.
    pub fn is_settled(&self, asked: &Equilibrium) -> bool {
        self.phase == RelaxPhase::FromRest
            && self.speed <= asked.speed
            && self.acceleration <= asked.acceleration
    }
}

/// For the end of a run.
impl std::fmt::Display for Relaxation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { speed, acceleration, stops, .. } = *self;
        let [speed, acceleration] =
            [(speed, "m/s"), (acceleration, "m/s²")].map(|(v, unit)| quantity(v, unit));
        write!(
            f,
            "peaks passed: {stops}, the last with {speed}; unbalanced {acceleration} (root mean squares)"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An undamped oscillator of 1 kg and 1 rad/s: velocities go at the first step past each peak, and what is left of the amplitude is
    /// what it moved since the peak.
    #[test]
    fn an_oscillator_comes_to_rest() {
        let (mut x, mut v, dt) = (1.0_f64, 0.0, 0.01);
        let asked = Equilibrium { speed: 1e-6, acceleration: 1e-6 };
        let mut relaxation = Relaxation::default();
        let mut steps = 0;
        while !relaxation.is_settled(&asked) {
            v -= dt * x;
            x += dt * v;
            if relaxation.note(0.5 * v * v, 1.0, dt) {
                v = 0.0;
            }
            steps += 1;
            assert!(steps < 3000, "{relaxation:?}, x = {x}");
        }
        // The force at rest is that of the place.
        assert!(
            x.abs() < 1.1e-6 && relaxation.acceleration < 1e-6 && relaxation.stops >= 3,
            "{relaxation:?}"
        );
    }

    /// Without any motion the first step is a stop, and the second shows that there is no force.
    #[test]
    fn what_is_at_rest_is_settled_after_two_steps() {
        let mut relaxation = Relaxation::default();
        assert!(relaxation.note(0.0, 1.0, 0.1));
        assert!(!relaxation.note(0.0, 1.0, 0.1));
        assert!(relaxation.is_settled(&Equilibrium { speed: 1e-9, acceleration: 1e-9 }));
    }
}
