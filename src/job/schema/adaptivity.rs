//! Dynamic refinement as it is written in a job file.
use super::common::yes;
use crate::adaptivity::criteria::Parameters as Criterion;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Dynamic refinement: the tree follows the material, and particles split and merge with the size of cells. Leaves are
/// never coarser than `tree.base_level` and the levels of `tree.regions`. Without this table tree and particles keep
/// their sizes.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Adaptivity {
    /// Steps from one occasion for changing the tree, splitting and merging to the next.
    #[serde(default = "twenty")]
    #[schemars(range(min = 1, max = 100_000))]
    pub every_steps: u64,
    /// Width of the layer around what a criterion wants, in leaves of the wanted level. To this comes the way that
    /// the material can go until the tree changes next.
    #[serde(default = "one")]
    #[schemars(range(max = 16))]
    pub buffer: u32,
    /// Width of a particle's box over that of an undeformed particle of its leaf's level above which it splits; only
    /// with `boxes = "volume"`.
    #[serde(default = "default_split")]
    #[schemars(range(max = 8.0), extend("exclusiveMinimum" = 1.0))]
    pub split_stretch: f64,
    /// Distance of neighbours, in cells, above which particles become two each along the line on which they have drifted apart, so that thin
    /// flow keeps no gaps; 2 keeps those of a deposit below a cell. Without it no particle does. Material that is torn (its space has grown by half) is left alone.
    #[serde(default)]
    #[schemars(range(min = 0.25, max = 8.0))]
    pub split_gap: Option<f64>,
    /// Merging of particles in leaves coarser than they were made for.
    #[serde(default)]
    pub merge: Merge,
    /// Reasons for fine leaves; a leaf is as fine as the most demanding wants it.
    #[serde(default)]
    pub criteria: Vec<Criterion>,
}

fn twenty() -> u64 {
    20
}

fn one() -> u32 {
    1
}

fn default_split() -> f64 {
    1.8
}

/// Merging of particles: only those that are close in state become one.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Merge {
    /// Whether particles merge at all.
    #[serde(default = "yes")]
    pub enabled: bool,
    /// Greatest difference of a velocity from the affine field through those of the group, over the wave speed.
    #[serde(default = "default_velocity")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub velocity: f64,
    /// Greatest difference from the mean elastic strain.
    #[serde(default = "default_strain")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub strain: f64,
    /// Greatest difference from the mean logarithm of the plastic volume ratio: by how much some grains are further
    /// apart than others.
    #[serde(default = "default_volume")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub volume: f64,
    /// Greatest difference from the mean plastic strain.
    #[serde(default = "default_plastic")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub plastic_strain: f64,
    /// Greatest width of the merged box over that of an undeformed particle; below `split_stretch`.
    #[serde(default = "default_stretch")]
    #[schemars(range(max = 8.0), extend("exclusiveMinimum" = 1.0))]
    pub stretch: f64,
}

impl Default for Merge {
    fn default() -> Self {
        Self {
            enabled: true,
            velocity: default_velocity(),
            strain: default_strain(),
            volume: default_volume(),
            plastic_strain: default_plastic(),
            stretch: default_stretch(),
        }
    }
}

fn default_velocity() -> f64 {
    0.005
}

fn default_strain() -> f64 {
    0.02
}

fn default_volume() -> f64 {
    0.1
}

fn default_plastic() -> f64 {
    0.2
}

fn default_stretch() -> f64 {
    1.5
}
