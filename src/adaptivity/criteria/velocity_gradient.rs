//! Fine leaves where the velocity varies: root mean square over the leaf's nodes of the norm of the velocity
//! gradient, 1/s.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Job, Keys};
use crate::adaptivity::criterion::{Criterion, Indicator, Thresholds};
use crate::adaptivity::leaf_view::{LeafNodes, LeafView, Value};
use crate::grid::mask::{bits, product};

/// Gradients of the velocity.
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
        Some(Criterion::new(self.level, thresholds, VelocityGradient))
    }
}

/// The velocity gradient on the nodes of a leaf.
#[derive(Debug)]
pub(in crate::adaptivity) struct VelocityGradient;

impl<const D: usize> Indicator<D> for VelocityGradient {
    /// Over the leaf's real nodes, weighted with mass.
    fn value(&self, leaf: &LeafView<'_, D>, _thresholds: &Thresholds) -> Value {
        let Some(LeafNodes { rows, real, cell }) = leaf.nodes() else { return Value::of_leaf(0.0) };
        let per_cell = 1.0 / cell;
        let mut sum_of_axes = 0.0;
        for axis in 0..D {
            let (mut squares, mut weights) = ([0.0; 4], 0.0);
            // Nodes that have the next one along the axis in the block.
            let pairs = product::<D>(std::array::from_fn(|a| if a == axis { 0b0111 } else { 0b1111 }));
            let step = 1 << (2 * axis);
            for bit in bits(real & real >> step & pairs) {
                let (here, there) = (&rows[bit as usize].0, &rows[bit as usize + step].0);
                let weight = here[3].min(there[3]);
                for i in 0..4 {
                    let change = there[i] - here[i];
                    squares[i] = f64::mul_add(weight * change, change, squares[i]);
                }
                weights += weight;
            }
            if weights > 0.0 {
                sum_of_axes += squares[..D].iter().sum::<f64>() / weights;
            }
        }
        Value::of_leaf(sum_of_axes.sqrt() * per_cell)
    }

    fn describe(&self, thresholds: &Thresholds) -> String {
        thresholds.above("velocity gradient", "1/s")
    }
}
