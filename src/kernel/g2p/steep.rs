//! Velocity gradients that are too steep for a step.
//!
//! Where a body has torn, elastic particles are alone in their cells. As one crosses a node its B stays, but
//! D falls to the second moment of its box, so that `∇v = B D⁻¹` grows. With `Δt |∇v| > 1` the factor
//! `1 + Δt ∇v` turns its strain inside out, by more in each step, until b is no number. The Courant number
//! keeps neighbours below such rates, but where bodies meet far above their speed of sound. So rates of
//! elastic particles, and their affine matrix with them, are at most [`MOST`] in a step; momentum stays as
//! it is.
use crate::simd::{Vector, VectorMask};

/// Greatest component of `Δt ∇v`.
const MOST: f64 = 0.5;

/// Rates of a batch, 1/s.
pub(super) struct Rate<V, const D: usize> {
    /// Velocity gradient.
    pub gradient: [[V; D]; D],
    /// Rate that its diagonal gets for the strain beside its own.
    pub added: V,
    /// Rate along the hoop; 0 but in axisymmetry.
    pub hoop: V,
}

impl<V: Vector, const D: usize> Rate<V, D> {
    /// Cuts rates that are too steep for a step of so many seconds. Returns the share that remains; none if
    /// all does. `flows` has a bit for each lane whose material flows, and keeps all.
    #[inline(always)]
    pub(super) fn limit(&mut self, step: V, flows: impl Fn() -> u32) -> Option<V> {
        let mut greatest = (self.hoop + self.added).abs();
        for (i, row) in self.gradient.iter().enumerate() {
            for (k, &rate) in row.iter().enumerate() {
                let rate = if i == k { rate + self.added } else { rate };
                greatest = rate.abs().max(greatest);
            }
        }
        let greatest = greatest * step;
        if !V::splat(MOST).lt(greatest).any() {
            return None;
        }
        let kept = (V::splat(MOST) / greatest).min(V::splat(1.0));
        let kept = V::Mask::from_bits(flows()).select(V::splat(1.0), kept);
        self.gradient = self.gradient.map(|row| row.map(|rate| rate * kept));
        (self.added, self.hoop) = (self.added * kept, self.hoop * kept);
        Some(kept)
    }

    /// The rates of the strain: with what is added to them.
    #[inline(always)]
    pub(super) fn add(&mut self, is_ring: bool) {
        (0..D).for_each(|i| self.gradient[i][i] += self.added);
        if is_ring {
            self.hoop += self.added;
        }
    }

    /// Rate of the volume.
    #[inline(always)]
    pub(super) fn trace(&self) -> V {
        (1..D).fold(self.gradient[0][0], |sum, i| sum + self.gradient[i][i]) + self.hoop
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LANES, Lanes};

    /// Share that remains of rates in a step of 1e-3 s, by lane, with a bit for each lane that flows.
    fn kept(gradient: [[f64; 2]; 2], [added, hoop]: [f64; 2], flows: u32) -> Option<[f64; LANES]> {
        let gradient = gradient.map(|row| row.map(Lanes::splat));
        let mut rate = Rate { gradient, added: Lanes::splat(added), hoop: Lanes::splat(hoop) };
        rate.limit(Lanes::splat(1e-3), || flows).map(Lanes::to_array)
    }

    /// No component moves more than half a unit in a step, the sum with what the strain gets included.
    #[test]
    fn rates_are_at_most_half_a_unit_in_a_step() {
        assert_eq!(kept([[499.0, -300.0], [20.0, 0.0]], [0.0; 2], 0), None);
        for (gradient, more) in [
            ([[0.0, -1000.0], [20.0, 0.0]], [0.0; 2]),
            ([[400.0, 0.0], [0.0, 0.0]], [600.0, 0.0]),
            ([[-400.0, 0.0], [0.0, 0.0]], [0.0, 1000.0]),
        ] {
            assert_eq!(kept(gradient, more, 0), Some([0.5; LANES]));
        }
    }

    /// Materials that flow keep their rates: their strain has bounds of its own.
    #[test]
    fn materials_that_flow_keep_their_rates() {
        let kept = kept([[0.0, -1000.0], [0.0, 0.0]], [0.0; 2], 0b101).expect("some are cut");
        assert_eq!(kept[..4], [1.0, 0.5, 1.0, 0.5]);
    }
}
