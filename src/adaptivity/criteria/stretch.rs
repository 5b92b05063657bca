//! Fine leaves where boxes are stretched: greatest width of a particle's box over its undeformed width.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys};
use crate::adaptivity::criterion::{Criterion, Indicator, Needs, Thresholds};
use crate::adaptivity::leaf_view::{LeafView, Value};
use crate::particle::halvings;

/// Stretch of boxes.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Level of the leaves there.
    #[schemars(range(min = 1, max = 15))]
    pub level: u8,
    /// Width over undeformed width from which leaves are refined.
    #[schemars(range(max = 1e3), extend("exclusiveMinimum" = 1.0))]
    pub refine: f64,
    /// Value from which fine leaves stay; half way from 1 to `refine` by default.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub coarsen: Option<f64>,
}

impl Keys for Parameters {
    fn criterion<const D: usize>(&self, _job: &mut dyn Job<D>) -> Option<Criterion<D>> {
        let coarsen = self.coarsen.unwrap_or(0.5 + 0.5 * self.refine);
        Some(Criterion::new(self.level, Thresholds::from_value(self.refine, coarsen), Stretch))
    }
}

/// The greatest stretch.
#[derive(Debug)]
struct Stretch;

impl<const D: usize> Indicator<D> for Stretch {
    fn needs(&self) -> Needs {
        Needs { stretch: true, ..Needs::default() }
    }

    fn value(&self, leaf: &LeafView<'_, D>, thresholds: &Thresholds) -> Value {
        let bound = leaf.maxima().stretch;
        // Only leaves that may reach the thresholds are examined closely.
        if bound < thresholds.coarsen {
            return Value::of_leaf(bound);
        }
        let halves = leaf.half_widths();
        let undeformed = leaf.undeformed();
        let undeformed = undeformed.iter().zip(leaf.chunk().tags());
        let stretches = halves.iter().zip(undeformed).flat_map(|(half, (own, &tag))| {
            let shape = halvings::shape::<D>(tag);
            (0..D).map(move |axis| half[axis] / (own * shape[axis]))
        });
        Value::of_leaf(stretches.fold(0.0, f64::max))
    }

    fn describe(&self, thresholds: &Thresholds) -> String {
        thresholds.above("stretch of particles", "")
    }
}
