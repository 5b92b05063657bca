//! Fine leaves where the material flows: mean plastic strain rate of the particles in the last step, 1/s.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys};
use crate::adaptivity::criterion::{Criterion, Indicator, Needs, Thresholds};
use crate::adaptivity::leaf_view::{LeafView, Value};

/// Rates of plastic strain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Level of the leaves there.
    #[schemars(range(min = 1, max = 15))]
    pub level: u8,
    /// Value from which leaves are refined, 1/s.
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub refine: f64,
    /// Value from which fine leaves stay, 1/s; half of `refine` by default.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub coarsen: Option<f64>,
}

impl Keys for Parameters {
    fn criterion<const D: usize>(&self, _job: &mut dyn Job<D>) -> Option<Criterion<D>> {
        let thresholds = Thresholds::from_value(self.refine, self.coarsen.unwrap_or(0.5 * self.refine));
        Some(Criterion::new(self.level, thresholds, PlasticStrainRate))
    }
}

/// The mean rate of plastic strain.
#[derive(Debug)]
struct PlasticStrainRate;

impl<const D: usize> Indicator<D> for PlasticStrainRate {
    fn needs(&self) -> Needs {
        Needs { plastic_rate: true, ..Needs::default() }
    }

    fn value(&self, leaf: &LeafView<'_, D>, _thresholds: &Thresholds) -> Value {
        Value::of_leaf(leaf.maxima().plastic_rate)
    }

    fn describe(&self, thresholds: &Thresholds) -> String {
        thresholds.above("plastic strain rate", "1/s")
    }
}
