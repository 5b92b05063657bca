//! Fine leaves where there is a material: 1 where a particle is of it.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys};
use crate::adaptivity::criterion::{Criterion, Indicator, Thresholds};
use crate::adaptivity::leaf_view::{LeafView, Value};
use crate::particle::chunk::Tag;
use crate::text::excerpt;

/// Longest name that is printed, in characters.
const NAME: usize = 60;

/// A material.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Level of the leaves there.
    #[schemars(range(min = 1, max = 15))]
    pub level: u8,
    /// Name of the material.
    pub material: String,
}

impl Keys for Parameters {
    fn criterion<const D: usize>(&self, job: &mut dyn Job<D>) -> Option<Criterion<D>> {
        let index = job.material(&self.material, "material")? as u16;
        let indicator = OfMaterial { index, name: self.material.clone() };
        Some(Criterion::new(self.level, Thresholds::YES, indicator))
    }
}

/// A material by its index.
#[derive(Debug)]
struct OfMaterial {
    index: u16,
    name: String,
}

impl<const D: usize> Indicator<D> for OfMaterial {
    fn value(&self, leaf: &LeafView<'_, D>, _thresholds: &Thresholds) -> Value {
        Value::flag(leaf.chunk().tags().iter().any(|&tag| Tag::unpack(tag).material == self.index))
    }

    fn describe(&self, _thresholds: &Thresholds) -> String {
        format!("where there is {}", excerpt(&self.name, NAME))
    }
}
