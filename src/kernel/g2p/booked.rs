//! Sums over particles that G2P forms for the history, lane by lane.
use crate::material::SHOCK_SUMS;
use crate::simd::{LANES, Vector};

/// Sums over the particles of a leaf in a step.
#[derive(Clone, Copy, Debug)]
pub struct Booked<const D: usize> {
    /// Mass times the shift that keeps fluids in their volume, kg m.
    pub(super) ways: [[f64; LANES]; D],
    /// Work of artificial viscosity and the part of it that is heat of the material, J.
    pub(super) shocks: [[f64; LANES]; SHOCK_SUMS],
}

impl<const D: usize> Default for Booked<D> {
    fn default() -> Self {
        Self { ways: [[0.0; LANES]; D], shocks: [[0.0; LANES]; SHOCK_SUMS] }
    }
}

impl<const D: usize> Booked<D> {
    /// Mass times shift, over all lanes.
    pub fn shift(&self) -> [f64; D] {
        self.ways.map(|lanes| lanes.iter().sum())
    }

    /// Work and heat of artificial viscosity, J, over all lanes.
    pub fn shock(&self) -> [f64; SHOCK_SUMS] {
        self.shocks.map(|lanes| lanes.iter().sum())
    }
}

/// Adds values to a sum, lane by lane.
#[inline(always)]
pub(super) fn add<V: Vector>(sum: &mut [f64; LANES], values: V) {
    (V::load(sum) + values).store(sum);
}
