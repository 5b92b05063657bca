//! Fine leaves near a collider: distance of the leaf's box from it, m.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys};
use crate::adaptivity::criterion::{Criterion, Indicator, Thresholds};
use crate::adaptivity::leaf_view::{LeafView, Value};

/// The surroundings of a collider.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Level of the leaves there.
    #[schemars(range(min = 1, max = 15))]
    pub level: u8,
    /// Name of the collider.
    pub collider: String,
    /// Distance within which leaves are refined, m.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub distance: f64,
    /// Distance within which fine leaves stay, m; 1.5 times `distance` by default.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub coarsen: Option<f64>,
}

impl Keys for Parameters {
    fn criterion<const D: usize>(&self, job: &mut dyn Job<D>) -> Option<Criterion<D>> {
        let index = job.collider(&self.collider, "collider")?;
        let thresholds = Thresholds::within(self.distance, self.coarsen.unwrap_or(1.5 * self.distance));
        Some(Criterion::new(self.level, thresholds, NearCollider { index, name: self.collider.clone() }))
    }
}

/// A collider by its index.
#[derive(Debug)]
struct NearCollider {
    index: usize,
    name: String,
}

impl<const D: usize> Indicator<D> for NearCollider {
    fn value(&self, leaf: &LeafView<'_, D>, _thresholds: &Thresholds) -> Value {
        let (collider, state) = leaf.collider(self.index);
        leaf.in_boxes(|octant_box| collider.distance_to_box(octant_box, &state.pose))
    }

    fn describe(&self, thresholds: &Thresholds) -> String {
        thresholds.near(&format!("collider {}", self.name))
    }

    fn collider(&self) -> Option<usize> {
        Some(self.index)
    }
}
