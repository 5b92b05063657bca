//! Fine leaves at free surfaces: 1 where nodes around the leaf have next to no mass.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys};
use crate::adaptivity::criterion::{Criterion, Indicator, Needs, Thresholds};
use crate::adaptivity::leaf_view::{LeafView, Value};

/// Free surfaces.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Level of the leaves there.
    #[schemars(range(min = 1, max = 15))]
    pub level: u8,
}

impl Keys for Parameters {
    fn criterion<const D: usize>(&self, _job: &mut dyn Job<D>) -> Option<Criterion<D>> {
        Some(Criterion::new(self.level, Thresholds::YES, FreeSurface))
    }
}

/// Whether a leaf lies at a free surface.
#[derive(Debug)]
struct FreeSurface;

impl<const D: usize> Indicator<D> for FreeSurface {
    fn needs(&self) -> Needs {
        Needs { exposure: true, ..Needs::default() }
    }

    fn value(&self, leaf: &LeafView<'_, D>, _thresholds: &Thresholds) -> Value {
        Value::flag(leaf.is_exposed())
    }

    fn describe(&self, _thresholds: &Thresholds) -> String {
        "at free surfaces".into()
    }
}
