//! Fine leaves where water seeps fast: the greatest gradient of the head about a particle.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys};
use crate::adaptivity::criterion::{Criterion, Indicator, Thresholds};
use crate::adaptivity::leaf_view::{LeafView, Value};

/// Gradient of the head.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Level of the leaves there.
    #[schemars(range(min = 1, max = 15))]
    pub level: u8,
    /// Gradient from which leaves are refined, m/m.
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub refine: f64,
    /// Gradient from which fine leaves stay, m/m; half of `refine` by default.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub coarsen: Option<f64>,
}

impl Keys for Parameters {
    fn criterion<const D: usize>(&self, job: &mut dyn Job<D>) -> Option<Criterion<D>> {
        job.seepage("kind")?;
        let thresholds = Thresholds::from_value(self.refine, self.coarsen.unwrap_or(0.5 * self.refine));
        Some(Criterion::new(self.level, thresholds, HeadGradient))
    }
}

/// The greatest gradient of the head about a particle.
#[derive(Debug)]
struct HeadGradient;

impl<const D: usize> Indicator<D> for HeadGradient {
    fn value(&self, leaf: &LeafView<'_, D>, _thresholds: &Thresholds) -> Value {
        Value::of_leaf(leaf.head_gradient())
    }

    fn describe(&self, thresholds: &Thresholds) -> String {
        thresholds.above("gradient of the head", "")
    }
}
