//! Artificial viscosity (von Neumann and Richtmyer 1950): pressure against compression that is too quick for
//! the cells, so that shocks are a few cells wide.
//!
//! With cells of edge h, the rate of compression `d = -tr D > 0` and the wave speed c,
//! ```text
//! q = ρ h d (a_2 h d + a_1 c)
//! ```
//! Its Kirchhoff value `J q` has the density of the undeformed material in place of ρ. Its power heats: each
//! law says what becomes of that. The tangent `∂q/∂d = ρ h Q` with `Q = a_1 c + 2 a_2 h d` damps waves, which
//! bounds the step as if they travelled at `Q + √(Q² + c²)`.
use crate::simd::LANES;

/// Numbers booked of it: work, and the part of it that is heat of the material.
pub const SHOCK_SUMS: usize = 2;

/// Coefficients of artificial viscosity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viscosity {
    /// `a_1`, of the wave speed.
    pub linear: f64,
    /// `a_2`, of the difference of velocity over a cell.
    pub quadratic: f64,
}

impl Viscosity {
    /// Speed of waves that bounds the step where they have the speed `wave` without viscosity and the
    /// difference of velocity over a cell is `jump`, m/s.
    pub fn bound(&self, wave: f64, jump: f64) -> f64 {
        let damping = self.linear * wave + 2.0 * self.quadratic * jump;
        damping + damping.hypot(wave)
    }
}

/// Artificial viscosity in an update.
#[derive(Clone, Copy, Debug)]
pub struct Shock {
    /// Coefficients.
    pub viscosity: Viscosity,
    /// Rate of the volume, `tr D`, of each particle, 1/s.
    pub rate: [f64; LANES],
}
