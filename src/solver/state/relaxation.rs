//! Progress of kinetic damping towards equilibrium.
use crate::saved::Saved;
use crate::solver::physics::Equilibrium;
use crate::text::quantity;

/// Progress of kinetic damping towards equilibrium; the same on all ranks.
///
/// In a step from rest forces act over half its length, so a mode of frequency ω and amplitude a at rest is
/// at `a (1 - ω² Δt² / 2)` after it. Steps of one length have places `a cos nθ`, so at no stop is a
/// mode further from its equilibrium than at the one before, for all steps that are stable at all.
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
    /// Kind of the last step.
    pub phase: RelaxPhase,
}

/// Kind of a step on the way to equilibrium.
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

/// Kinds of steps by the number that files have for them.
const PHASES: [RelaxPhase; 3] = [RelaxPhase::Falling, RelaxPhase::Stopped, RelaxPhase::FromRest];

impl Relaxation {
    pub(in crate::solver) fn save(&mut self, saved: &mut Saved<'_>) {
        saved.real("relaxation_kinetic_energy", &mut self.kinetic);
        saved.real("relaxation_speed", &mut self.speed);
        saved.real("relaxation_acceleration", &mut self.acceleration);
        saved.count("relaxation_stops", &mut self.stops);
        let mut phase = PHASES.iter().position(|other| *other == self.phase).unwrap_or_default() as u64;
        saved.count("relaxation_phase", &mut phase);
        match usize::try_from(phase).ok().and_then(|phase| PHASES.get(phase)) {
            Some(phase) => self.phase = *phase,
            None => saved.lacks("relaxation_phase"),
        }
    }

    /// After a step in which forces acted over `kick` (s), and nodes with this mass of material (kg) had a
    /// kinetic energy, and after a step from rest `½ kick² Σ f² / m` of the forces on them, J. The second
    /// differs from the first with mass scaling alone, where the root mean square of the velocities is one of
    /// the moving masses, and so too great. Returns whether velocities are to be set to 0.
    pub(in crate::solver) fn note(&mut self, [kinetic, pulled]: [f64; 2], mass: f64, kick: f64) -> bool {
        if mass == 0.0 {
            // Nothing is at rest, after however long a step.
            *self = Self { stops: self.stops, phase: RelaxPhase::FromRest, ..Self::default() };
            return false;
        }
        let root_mean_square = |energy: f64| (2.0 * energy / mass).sqrt();
        let was_at_rest = self.phase == RelaxPhase::Stopped;
        if was_at_rest {
            self.acceleration = root_mean_square(pulled) / kick;
        }
        // Material that does not move at all is at rest too.
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
        write!(f, "peaks: {stops}, the last with {speed}; unbalanced {acceleration} (root mean squares)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An undamped oscillator of 1 kg and 1 rad/s: velocities go at the first step past each peak, and what
    /// is left of the amplitude is what it moved since the peak.
    #[test]
    fn an_oscillator_comes_to_rest() {
        let (mut x, mut v, dt) = (1.0_f64, 0.0, 0.01);
        let asked = Equilibrium { speed: 1e-6, acceleration: 1e-6, own_mass_level: None };
        let mut relaxation = Relaxation::default();
        let mut steps = 0;
        while !relaxation.is_settled(&asked) {
            let is_first = steps == 0 || relaxation.phase == RelaxPhase::Stopped;
            let kick = if is_first { 0.5 * dt } else { dt };
            v -= kick * x;
            x += dt * v;
            v = if relaxation.note([0.5 * v * v; 2], 1.0, kick) { 0.0 } else { v };
            steps += 1;
            assert!(steps < 3000, "{relaxation:?}, x = {x}");
        }
        // The force at rest is that of the place.
        assert!(
            x.abs() < 1.1e-6 && relaxation.acceleration < 1e-6 && relaxation.stops >= 3,
            "{relaxation:?}"
        );
    }

    /// No stop adds to a mode, however few steps its period has: two oscillators, of which one decides about
    /// the stops.
    #[test]
    fn no_mode_grows_from_stop_to_stop() {
        for share in 1..200 {
            for other in [0.1, 0.37, 0.73, 1.0] {
                let full = 0.01 * f64::from(share);
                let frequencies = [full, other * full];
                let (mut x, mut v, mut relaxation) = ([1.0_f64, 0.3], [0.0; 2], Relaxation::default());
                relaxation.phase = RelaxPhase::Stopped;
                let mut greatest = x.map(f64::abs);
                for _ in 0..400 {
                    let kick = if relaxation.phase == RelaxPhase::Stopped { 0.5 } else { 1.0 };
                    for i in 0..2 {
                        v[i] -= kick * frequencies[i].powi(2) * x[i];
                        x[i] += v[i];
                    }
                    let kinetic = 0.5 * (v[0] * v[0] + v[1] * v[1]);
                    if relaxation.note([kinetic; 2], 1.0, kick) {
                        v = [0.0; 2];
                        for i in 0..2 {
                            let least = greatest[i] * (1.0 + 1e-12);
                            assert!(x[i].abs() <= least, "{full} {other}: {x:?} after {greatest:?}");
                            greatest[i] = x[i].abs();
                        }
                    }
                }
            }
        }
    }

    /// Without any motion the first step is a stop, and the second shows that there is no force.
    #[test]
    fn what_is_at_rest_is_settled_after_two_steps() {
        let mut relaxation = Relaxation::default();
        assert!(relaxation.note([0.0; 2], 1.0, 0.1));
        assert!(!relaxation.note([0.0; 2], 1.0, 0.1));
        assert!(relaxation.is_settled(&Equilibrium {
            speed: 1e-9,
            acceleration: 1e-9,
            own_mass_level: None
        }));
    }
}
