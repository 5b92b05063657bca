//! Gravity, and the vertical that it gives.
use crate::quantity::Quantity;

/// Acceleration of gravity, which may change in time.
#[derive(Clone, Debug)]
pub struct Gravity<const D: usize> {
    /// Components, m/s².
    pub acceleration: [Quantity; D],
    /// Time from which the time of the components is counted, s.
    pub start: f64,
}

impl<const D: usize> Gravity<D> {
    /// The same at all times, m/s².
    pub fn constant(acceleration: [f64; D]) -> Self {
        Self { acceleration: acceleration.map(Quantity::Constant), start: 0.0 }
    }

    /// Acceleration at a time (s), m/s².
    pub fn at(&self, time: f64) -> [f64; D] {
        std::array::from_fn(|axis| self.acceleration[axis].at([0.0; 3], time - self.start))
    }
}

/// Which way is up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Up {
    /// The vertical axis.
    pub axis: usize,
    /// 1 along the axis, -1 against it.
    pub sign: f64,
}

impl Up {
    /// Against gravity, which lies along an axis.
    pub fn new(gravity: &[f64]) -> Self {
        let greatest = |&a: &usize, &b: &usize| gravity[a].abs().total_cmp(&gravity[b].abs());
        let axis = (0..gravity.len()).max_by(greatest).unwrap_or(0);
        Self { axis, sign: if gravity[axis] > 0.0 { -1.0 } else { 1.0 } }
    }
}
