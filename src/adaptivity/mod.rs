//! Criteria for fine leaves, and the treatment of particles when leaves change.
//!
//! A criterion evaluates one occupied leaf and requests refinement, no coarsening, or nothing. The request
//! holds for the leaf and a buffer around it. A leaf is refined when any criterion requests it, and coarsened
//! when no criterion forbids it. The solver changes the tree (`solver/refinement/regrid.rs`).
//!
//! | file | what it holds |
//! |---|---|
//! | [`criteria`] | the criteria, one file each |
//! | `criterion` | level that a criterion requests for a leaf |
//! | `leaf_view` | view of a leaf for criteria |
//! | `leaf_maxima` | extrema of a leaf's particles that G2P records for criteria and splitting |
//! | `surroundings` | surroundings of leaves |
//! | [`resample`] | particles split and merge |
use self::criterion::Needs;
pub use self::criterion::{Criterion, Thresholds, Want};
pub(crate) use self::leaf_maxima::{LeafMaxima, Watch};
pub use self::leaf_view::Value;
use self::resample::Limits;
use crate::geometry::{Aabb, Shape, Side};

pub mod criteria;
mod criterion;
pub(crate) mod leaf_maxima;
pub(crate) mod leaf_view;
pub mod resample;
pub(crate) mod surroundings;

/// Dynamic refinement of a job.
#[derive(Clone, Debug)]
pub struct Adaptivity<const D: usize> {
    /// Steps from one regrid to the next.
    pub every: u64,
    /// Width of the layer around the leaves that a criterion requests, in leaves of the requested level.
    pub buffer: u32,
    /// Coarsest level of all leaves.
    pub base_level: u8,
    /// Regions in which leaves never get coarser than a level.
    pub regions: Vec<(Shape<D>, u8)>,
    /// The criteria.
    pub criteria: Vec<Criterion<D>>,
    /// Width of a box over that of an undeformed particle of its leaf's level above which particles split.
    pub split_stretch: Option<f64>,
    /// Width of the space of a particle, in cells of its leaf, above which it becomes two: see
    /// [`resample::Gap`].
    pub split_gap: Option<f64>,
    /// Limits on the differences of particles that merge; `None`: they never merge.
    pub merge: Option<Limits>,
    /// Half width of an undeformed particle of level 0 by body, m.
    pub nominal: Vec<f64>,
}

/// How elastic bodies hold together that are stretched (see `resample/halve.rs`).
#[derive(Clone, Debug, PartialEq)]
pub struct Cohesion {
    /// Half width of an undeformed particle of level 0 by body, m.
    pub nominal: Vec<f64>,
    /// Greatest ratio of the half width of a box to that of its undeformed whole.
    pub stretch: f64,
}

impl<const D: usize> Adaptivity<D> {
    /// Finest level that a leaf can have.
    pub fn finest_level(&self) -> u8 {
        let criteria = self.criteria.iter().map(|criterion| criterion.level);
        criteria.chain(self.regions.iter().map(|(_, level)| *level)).fold(self.base_level, u8::max)
    }

    /// Edges of finest leaves per metre where those of roots are `root_edge` (m).
    pub fn finest_edges_per_metre(&self, root_edge: f64) -> f64 {
        f64::from(1u32 << self.finest_level()) / root_edge
    }

    /// Whether the tree follows criteria; else particles alone follow the tree.
    pub fn is_refining(&self) -> bool {
        !self.criteria.is_empty()
    }

    /// Data found for the criteria alone.
    pub(crate) fn needs(&self) -> Needs {
        let each = self.criteria.iter().map(|criterion| criterion.indicator.needs());
        each.fold(Needs::default(), Needs::and)
    }

    /// Quantities to record of particles in the step of that number (the first is 1).
    pub(crate) fn watch(&self, step: u64) -> Watch {
        let needs = self.needs();
        // Output files show the rate at any step.
        let rate = needs.plastic_rate;
        if !step.is_multiple_of(self.every) {
            return Watch { rate, ..Watch::default() };
        }
        let width = self.split_stretch.is_some() || needs.stretch;
        Watch { velocity: true, strain: needs.plastic_strain, width, rate }
    }

    /// Level that a leaf with this box has in any case.
    pub fn least_level(&self, leaf_box: &Aabb<D>) -> u8 {
        least_level(self.base_level, self.regions.iter().map(|(shape, level)| (shape, *level)), leaf_box)
    }
}

/// Greatest level among `base` and those of the regions that a box meets.
pub fn least_level<'a, const D: usize>(
    base: u8,
    regions: impl Iterator<Item = (&'a Shape<D>, u8)>,
    leaf_box: &Aabb<D>,
) -> u8 {
    regions.fold(base, |least, (shape, level)| {
        let is_met = level > least && shape.classify(leaf_box) != Side::Outside;
        if is_met { level } else { least }
    })
}
