//! Dynamic refinement as it is written in a job file.
use super::common::yes;
use crate::adaptivity::criteria::Parameters as Criterion;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Dynamic refinement: the tree adapts to the material during the run, and particles split and merge with the
/// size of the cells. Leaves are never coarser than `tree.base_level` and the levels of `tree.regions`.
/// Without this table the tree stays as it is; with `tree.regions`, particles of coarse cells still split
/// where they come into finer ones, and merge where they are back among coarse ones.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Adaptivity {
    /// Steps between changes of the tree, with splits and merges.
    #[serde(default = "twenty")]
    #[schemars(range(min = 1, max = 100_000))]
    pub every_steps: u64,
    /// Width of the layer that is refined around what a criterion marks, in leaves of the level that it asks
    /// for. The distance that the material can travel until the next change of the tree is added to it.
    #[serde(default = "one")]
    #[schemars(range(max = 16))]
    pub buffer: u32,
    /// Stretch at which a particle splits: the width of its box over that of an undeformed particle of its
    /// leaf's level; only with `boxes = "volume"`.
    #[serde(default = "default_split")]
    #[schemars(range(max = 8.0), extend("exclusiveMinimum" = 1.0))]
    pub split_stretch: f64,
    /// Distance between neighbours, in cells, above which each of them splits in two along the line between
    /// them, to close gaps in thin flow; with 2, gaps in a deposit stay below a cell. Off by default. Torn
    /// material, whose volume has grown by half, does not split.
    #[serde(default)]
    #[schemars(range(min = 0.25, max = 8.0))]
    pub split_gap: Option<f64>,
    /// Merging of particles in leaves that are coarser than the particles.
    #[serde(default)]
    pub merge: Merge,
    /// Refinement criteria; where several apply, the finest level wins.
    #[serde(default)]
    pub criteria: Vec<Criterion>,
}

impl Default for Adaptivity {
    fn default() -> Self {
        Self {
            every_steps: twenty(),
            buffer: one(),
            split_stretch: default_split(),
            split_gap: None,
            merge: Merge::default(),
            criteria: Vec::new(),
        }
    }
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

/// Merging of particles: only particles with similar states merge.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Merge {
    /// Whether particles merge.
    #[serde(default = "yes")]
    pub enabled: bool,
    /// Largest deviation of a velocity from the affine fit to the group, over the wave speed.
    #[serde(default = "default_velocity")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub velocity: f64,
    /// Largest deviation from the mean elastic strain.
    #[serde(default = "default_strain")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub strain: f64,
    /// Largest deviation from the mean logarithm of the plastic volume ratio, a measure of how far the grains
    /// are apart.
    #[serde(default = "default_volume")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub volume: f64,
    /// Largest deviation from the mean plastic strain.
    #[serde(default = "default_plastic")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub plastic_strain: f64,
    /// Largest width of the merged box over that of an undeformed particle; below `split_stretch`.
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
