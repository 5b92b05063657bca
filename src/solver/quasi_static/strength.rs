//! The search for the factor of safety: strength falls from step to step until forces do not balance.
//!
//! The factor that divides the strength grows with time. From the first step that fails on the last factor
//! with equilibrium and the least one without close in on each other by halves. Forces balance on the shape
//! at the start of each step, as in limit analysis: else the ground would slide to a flatter shape, which
//! bears more.
use crate::solver::physics::StrengthReduction;
use crate::solver::state::Solver;

/// Rounding of steps.
const ROUNDING: f64 = 1e-9;

impl StrengthReduction {
    /// Whether a step of this length that fails ends the search.
    pub(super) fn is_bracket(&self, length: f64) -> bool {
        length <= self.tolerance * (1.0 + ROUNDING)
    }

    /// Length of the next step after one of length `dt`, where `planned` was meant. Once a step has failed,
    /// plans are half of what lies between the two factors.
    pub(super) fn next(&self, planned: f64, dt: f64) -> f64 {
        if planned == self.step { planned } else { planned - 0.5 * dt }
    }
}

impl<const D: usize> Solver<D> {
    /// Not collective. The least factor without equilibrium, once the search for the factor of safety is
    /// over; the same on all ranks.
    pub fn factor_without_equilibrium(&self) -> Option<f64> {
        let reduction = self.physics.reduction.as_ref()?;
        let open = 2.0 * self.equilibrium.next_load_step;
        let is_over = self.equilibrium.next_load_step < reduction.step && reduction.is_bracket(open);
        is_over.then(|| self.physics.strength_factor(self.clock.time) + open)
    }
}
