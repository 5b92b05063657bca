//! Level that a criterion requests for a leaf, by the value of its indicator there.
use std::sync::Arc;

use super::leaf_view::{LeafView, Value};
use crate::text::quantity;

/// Indicator of a criterion.
pub(crate) trait Indicator<const D: usize>: std::fmt::Debug + Send + Sync {
    /// Data that it needs beside particles, nodes and colliders.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// Its value in a leaf with particles.
    fn value(&self, leaf: &LeafView<'_, D>, thresholds: &Thresholds) -> Value;

    /// Description of where it requests fine leaves.
    fn describe(&self, thresholds: &Thresholds) -> String;

    /// Index of the collider around which it requests fine leaves, if it is such a criterion.
    fn collider(&self) -> Option<usize> {
        None
    }
}

/// Data found for indicators alone: extrema that G2P records while the particles are in the cache, and the
/// surroundings of leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Needs {
    /// Greatest plastic strain.
    pub plastic_strain: bool,
    /// Mean rate of the plastic strain.
    pub plastic_rate: bool,
    /// Bound on the stretch of boxes.
    pub stretch: bool,
    /// Whether leaves lie at a free surface.
    pub exposure: bool,
}

impl Needs {
    /// Union of two sets of needs.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            plastic_strain: self.plastic_strain || other.plastic_strain,
            plastic_rate: self.plastic_rate || other.plastic_rate,
            stretch: self.stretch || other.stretch,
            exposure: self.exposure || other.exposure,
        }
    }
}

/// Thresholds of an indicator for fine leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Value at which a leaf becomes finer.
    pub refine: f64,
    /// Value up to which a leaf may coarsen; between it and `refine` the leaf keeps its level.
    pub coarsen: f64,
    /// Whether small values request fine leaves, as distances do.
    pub is_distance: bool,
}

impl Thresholds {
    /// Thresholds of indicators that are 1 where leaves shall be fine and 0 elsewhere.
    pub(crate) const YES: Self = Self::from_value(1.0, 1.0);

    /// Leaves become finer from a value on, and stay fine from another on.
    pub(crate) const fn from_value(refine: f64, coarsen: f64) -> Self {
        Self { refine, coarsen, is_distance: false }
    }

    /// Leaves become finer within a distance, and stay fine within another, m.
    pub(crate) const fn within(refine: f64, coarsen: f64) -> Self {
        Self { refine, coarsen, is_distance: true }
    }

    /// Words for a distance from something.
    pub(crate) fn near(&self, what: &str) -> String {
        let [refine, coarsen] = [self.refine, self.coarsen].map(|value| quantity(value, "m"));
        format!("within {refine} of {what}, coarsening beyond {coarsen}")
    }

    /// Words for a value of something with a unit, which is empty for pure numbers.
    pub(crate) fn above(&self, what: &str, unit: &str) -> String {
        let [refine, coarsen] = [self.refine, self.coarsen].map(|value| quantity(value, unit));
        format!("{what} at least {refine}, coarsening below {coarsen}")
    }
}

/// One reason for fine leaves.
#[derive(Clone, Debug)]
pub struct Criterion<const D: usize> {
    /// Its indicator.
    pub(crate) indicator: Arc<dyn Indicator<D>>,
    /// Level that it requests.
    pub level: u8,
    /// Thresholds for that level.
    pub thresholds: Thresholds,
}

/// Request of a criterion for a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    /// Refinement to the criterion's level.
    Refine,
    /// No coarsening.
    Hold,
    /// No request: the leaf may coarsen.
    Nothing,
}

impl<const D: usize> Criterion<D> {
    /// Fine leaves of a level where an indicator has such values.
    pub(crate) fn new(level: u8, thresholds: Thresholds, indicator: impl Indicator<D> + 'static) -> Self {
        Self { indicator: Arc::new(indicator), level, thresholds }
    }

    /// Its value in a leaf with particles.
    pub(crate) fn value(&self, leaf: &LeafView<'_, D>) -> Value {
        self.indicator.value(leaf, &self.thresholds)
    }

    /// Description of where it requests fine leaves.
    pub fn describe(&self) -> String {
        self.indicator.describe(&self.thresholds)
    }

    /// Index of the collider around which it requests fine leaves, if it is such a criterion.
    pub fn collider(&self) -> Option<usize> {
        self.indicator.collider()
    }

    /// Request for a leaf with these values.
    pub fn want(&self, value: Value) -> Want {
        let Thresholds { refine, coarsen, is_distance } = self.thresholds;
        // With this sign, larger values are more urgent.
        let sign = if is_distance { -1.0 } else { 1.0 };
        if sign * value.leaf >= sign * refine {
            Want::Refine
        } else if sign * value.parent >= sign * coarsen {
            Want::Hold
        } else {
            Want::Nothing
        }
    }

    /// Level wanted for a leaf of `level` with these values; 0 if none. At most one level finer than the
    /// leaf: only the children show which of them need more.
    pub fn wanted_level(&self, value: Value, level: u8) -> u8 {
        match self.want(value) {
            Want::Refine => self.level.min(level + 1),
            Want::Hold => self.level.min(level),
            Want::Nothing => 0,
        }
    }

    /// Urgency of the value of a leaf, for display: 1 where refinement begins, larger where the value exceeds
    /// the threshold. Distances give 1 within the refinement distance and fall to 0 at twice that.
    pub fn urgency(&self, value: f64) -> f64 {
        let Thresholds { refine, is_distance, .. } = self.thresholds;
        match is_distance {
            true if value <= refine => 1.0,
            true if refine > 0.0 => (2.0 - value / refine).max(0.0),
            true => 0.0,
            false if refine > 0.0 => value / refine,
            false => f64::from(value >= refine),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::criteria::velocity_gradient::VelocityGradient;
    use super::*;

    #[test]
    fn hysteresis() {
        let shear = Criterion::<2>::new(4, Thresholds::from_value(10.0, 2.0), VelocityGradient);
        let same = |v: f64| Value { leaf: v, parent: v };
        assert_eq!([11.0, 10.0, 5.0, 1.0].map(|v| shear.wanted_level(same(v), 3)), [4, 4, 3, 0]);
        assert_eq!(shear.wanted_level(same(5.0), 6), 4);
        assert_eq!(shear.wanted_level(same(11.0), 1), 2);
        let near = Criterion::<2>::new(5, Thresholds::within(0.1, 0.3), VelocityGradient);
        assert_eq!([-1.0, 0.1, 0.2, 0.4].map(|v| near.wanted_level(same(v), 5)), [5, 5, 5, 0]);
        assert_eq!(near.wanted_level(same(0.2), 2), 2);
        assert_eq!(near.wanted_level(Value { leaf: 0.4, parent: 0.25 }, 5), 5);
        assert_eq!(near.urgency(0.05), 1.0);
    }
}
