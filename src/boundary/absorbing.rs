//! Faces that absorb waves: dashpots that absorb waves as the material beyond the face would.
use crate::quantity::Quantity;

/// Material beyond the lower and the upper face along each axis; `None` where the face absorbs no waves.
pub type AbsorbingFaces<const D: usize> = [[Option<Box<Absorbing>>; 2]; D];

/// A face that absorbs waves (Lysmer and Kuhlemeyer 1969), with the pressure that holds the material at rest.
///
/// Beyond the face the material is unbounded: where the face moves with v, it pulls with `ρ c_p v_n` and
/// `ρ c_s v_t` per area. Waves at normal incidence are absorbed completely, others for the most part.
#[derive(Clone, Debug)]
pub struct Absorbing {
    /// Speed of compression waves, m/s.
    pub p_speed: f64,
    /// Speed of shear waves, m/s.
    pub s_speed: f64,
    /// Density at the face, kg/m³.
    pub density: f64,
    /// Pressure from beyond the face, Pa, at places in the job's coordinates.
    pub pressure: Quantity,
}

impl Absorbing {
    /// Changes the velocity (m/s) of a node on the face with normal `inward` along `axis` in a kick of length
    /// `dt` (s), at whose start it was `start`. `pressure` is the pressure at the node, Pa; `cell` is the
    /// edge of its cells, m.
    ///
    /// The node has the mass of half a cell, `m = ρ A h / 2`. Velocities are those at the middles of steps,
    /// between which stress acts, so the dashpot acts on the mean over the step. With the velocity at its end
    /// it would lag by half a step, as if a mass of `ρ c Δt / 2` per area were in front of it:
    /// `v_n = (v_n* - c_p Δt / h v_n⁰ ± 2 Δt p / (ρ h)) / (1 + c_p Δt / h)`,
    /// `v_t = (v_t* - c_s Δt / h v_t⁰) / (1 + c_s Δt / h)`. A node with less material stands for less area,
    /// so the result is the same.
    pub fn apply<const D: usize>(
        &self,
        velocity: &mut [f64; D],
        start: &[f64; D],
        (axis, inward): (usize, f64),
        pressure: f64,
        dt: f64,
        cell: f64,
    ) {
        let share = 2.0 * dt / cell;
        for (a, v) in velocity.iter_mut().enumerate() {
            let (speed, pushed) = match a == axis {
                true => (self.p_speed, *v + inward * share * pressure / self.density),
                false => (self.s_speed, *v),
            };
            let half = 0.5 * share * speed;
            *v = (pushed - half * start[a]) / (1.0 + half);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At rest under its pressure: the stress of the material gives the node the opposite impulse.
    #[test]
    fn pressure_holds_and_dashpots_take() {
        let face =
            Absorbing { p_speed: 100.0, s_speed: 50.0, density: 2000.0, pressure: Quantity::Constant(4e3) };
        let (dt, cell) = (1e-3, 0.5);
        // Stress -p over the area A gives p A dt outwards to the mass ρ A h / 2.
        let mut held = [-2.0 * dt * 4e3 / (2000.0 * cell), 0.0];
        face.apply(&mut held, &[0.0; 2], (0, 1.0), 4e3, dt, cell);
        assert!(held[0].abs() < 1e-18);
        // Without stress: v m at the end is v m at the start less the mean of the dashpot.
        let mut taken = [3.0, 1.0, 2.0];
        face.apply(&mut taken, &[3.0, 1.0, 2.0], (2, -1.0), 0.0, dt, cell);
        approx::assert_relative_eq!(taken[0], 3.0 * 0.9 / 1.1);
        approx::assert_relative_eq!(taken[1], 1.0 * 0.9 / 1.1);
        approx::assert_relative_eq!(taken[2], 2.0 * 0.8 / 1.2);
    }
}
