//! Fine leaves where there is plastic strain: the greatest of a particle.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys};
use crate::adaptivity::criterion::{Criterion, Indicator, Needs, Thresholds};
use crate::adaptivity::leaf_view::{LeafView, Value};

/// Plastic strain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Level of the leaves there.
    #[schemars(range(min = 1, max = 15))]
    pub level: u8,
    /// Value from which leaves are refined.
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
    pub refine: f64,
    /// Value from which fine leaves stay; half of `refine` by default.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub coarsen: Option<f64>,
}

impl Keys for Parameters {
    fn criterion<const D: usize>(&self, _job: &mut dyn Job<D>) -> Option<Criterion<D>> {
        let thresholds = Thresholds::from_value(self.refine, self.coarsen.unwrap_or(0.5 * self.refine));
        Some(Criterion::new(self.level, thresholds, PlasticStrain))
    }
}

/// The greatest plastic strain.
#[derive(Debug)]
struct PlasticStrain;

impl<const D: usize> Indicator<D> for PlasticStrain {
    fn needs(&self) -> Needs {
        Needs { plastic_strain: true, ..Needs::default() }
    }

    fn value(&self, leaf: &LeafView<'_, D>, _thresholds: &Thresholds) -> Value {
        Value::of_leaf(leaf.maxima().plastic_strain)
    }

    fn describe(&self, thresholds: &Thresholds) -> String {
        thresholds.above("plastic strain", "")
    }
}
