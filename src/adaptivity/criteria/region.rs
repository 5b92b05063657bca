//! Fine leaves in and near a shape: distance of the leaf's box from it, m.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys, Way};
use crate::adaptivity::criterion::{Criterion, Indicator, Thresholds};
use crate::adaptivity::leaf_view::{LeafView, Value};
use crate::boundary::motion::Motion;
use crate::geometry::Shape;
use crate::geometry::written;

/// A region.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Level of the leaves there.
    #[schemars(range(min = 1, max = 15))]
    pub level: u8,
    /// Where, at the start of its motion.
    pub shape: written::Shape,
    /// Distance within which leaves are refined, m.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub distance: f64,
    /// Distance within which fine leaves stay, m; 1.5 times `distance` by default.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub coarsen: Option<f64>,
    /// Its motion: linear between rows, at rest before the first and after the last.
    #[serde(default)]
    pub motion: Vec<Way>,
}

impl Keys for Parameters {
    fn criterion<const D: usize>(&self, job: &mut dyn Job<D>) -> Option<Criterion<D>> {
        let (shape, motion) = (job.shape(&self.shape, "shape"), job.motion(&self.motion, "motion"));
        let thresholds = Thresholds::within(self.distance, self.coarsen.unwrap_or(1.5 * self.distance));
        Some(Criterion::new(self.level, thresholds, Region { shape: shape?, motion: motion? }))
    }
}

/// A shape that may move.
#[derive(Debug)]
struct Region<const D: usize> {
    /// The shape at the place where its motion begins.
    shape: Shape<D>,
    /// Its motion; turns do not count.
    motion: Motion<D>,
}

impl<const D: usize> Indicator<D> for Region<D> {
    fn value(&self, leaf: &LeafView<'_, D>, _thresholds: &Thresholds) -> Value {
        let (way, _) = self.motion.place(leaf.time());
        leaf.in_boxes(|octant_box| {
            let centre = octant_box.centre();
            let centre = std::array::from_fn(|axis| centre[axis] - way[axis]);
            self.shape.distance(&centre) - octant_box.half_diagonal()
        })
    }

    fn describe(&self, thresholds: &Thresholds) -> String {
        match self.motion {
            Motion::Fixed => thresholds.near("a region"),
            _ => thresholds.near("a region that moves"),
        }
    }
}
