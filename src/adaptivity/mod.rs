//! Where a job wants fine leaves, and what happens to particles when leaves change.
//!
//! A criterion looks at one occupied leaf and wants it fine, lets it stay as it is, or has no objection to
//! coarser ones. What it wants holds for the leaf and a buffer around it. A leaf is refined when any criterion
//! wants that, and coarsened when none objects. The solver finds the values and changes the tree
//! (`solver/refinement/regrid.rs`); nothing here knows of trees and ranks.
use self::resample::Limits;

pub mod resample;
use crate::boundary::motion::Motion;
use crate::geometry::{Aabb, Shape, Side};

/// Dynamic refinement as a job asks for it.
#[derive(Clone, Debug)]
pub struct Adaptivity<const D: usize> {
    /// Steps from one regrid to the next.
    pub every: u64,
    /// Width of the layer around what a criterion wants, in leaves of the wanted level.
    pub buffer: u32,
    /// Coarsest level of all leaves.
    pub base_level: u8,
    /// Regions in which leaves never get coarser than a level.
    pub regions: Vec<(Shape<D>, u8)>,
    /// The criteria.
    pub criteria: Vec<Criterion<D>>,
    /// Width of a box over that of an undeformed particle of its leaf's level above which particles split.
    pub split_stretch: Option<f64>,
    /// How different particles may be that merge; `None`: they never do.
    pub merge: Option<Limits>,
    /// Half width of an undeformed particle of level 0 by body, m.
    pub nominal: Vec<f64>,
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

/// One reason for fine leaves.
#[derive(Clone, Debug)]
pub struct Criterion<const D: usize> {
    /// What it looks at.
    pub kind: Kind<D>,
    /// Level that it wants.
    pub level: u8,
    /// Value at which a leaf becomes finer.
    pub refine: f64,
    /// Value between which and `refine` a leaf stays as it is. Distances count from above, all others from below.
    pub coarsen: f64,
}

/// What a criterion finds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// In the leaf.
    pub leaf: f64,
    /// In the leaf's parent, as far as it is known without the parent's other children. A leaf becomes coarser only
    /// if that would not make the parent finer again.
    pub parent: f64,
}

/// What a criterion looks at.
#[derive(Clone, Debug)]
pub enum Kind<const D: usize> {
    /// Distance of the leaf's box from a shape that may move, m.
    Region {
        /// The shape at the place where its motion begins.
        shape: Shape<D>,
        /// Its motion; turns do not count.
        motion: Motion<D>,
    },
    /// Distance of the leaf's box from a collider of this index, m.
    Collider(usize),
    /// 1 where nodes around the leaf have next to no mass.
    FreeSurface,
    /// Root mean square over the leaf's nodes of the norm of the velocity gradient, 1/s.
    VelocityGradient,
    /// Greatest plastic strain of a particle.
    PlasticStrain,
    /// Mean plastic strain rate of the particles in the last step, 1/s.
    PlasticStrainRate,
    /// Greatest width of a particle's box over its undeformed width.
    Stretch,
    /// 1 where there are particles of the material of this index.
    Material(u16),
}

/// What a criterion wants of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    /// The criterion's level.
    Refine,
    /// Not coarser than it is.
    Hold,
    /// Nothing.
    Nothing,
}

impl<const D: usize> Criterion<D> {
    /// Whether small values ask for refinement.
    fn is_distance(&self) -> bool {
        matches!(self.kind, Kind::Region { .. } | Kind::Collider(_))
    }

    /// What the values of a leaf ask for.
    pub fn want(&self, value: Value) -> Want {
        // A sign makes large values the urgent ones.
        let sign = if self.is_distance() { -1.0 } else { 1.0 };
        if sign * value.leaf >= sign * self.refine {
            Want::Refine
        } else if sign * value.parent >= sign * self.coarsen {
            Want::Hold
        } else {
            Want::Nothing
        }
    }

    /// Level wanted for a leaf of `level` with these values; 0 if none. One level finer than the leaf at most: only
    /// its children know which of them need more.
    pub fn wanted_level(&self, value: Value, level: u8) -> u8 {
        match self.want(value) {
            Want::Refine => self.level.min(level + 1),
            Want::Hold => self.level.min(level),
            Want::Nothing => 0,
        }
    }

    /// How urgent the value of a leaf is, for people: 1 where refinement begins, larger where there is more reason. Distances
    /// give 1 within the refinement distance and fall to 0 at twice that.
    pub fn urgency(&self, value: f64) -> f64 {
        match self.is_distance() {
            true if value <= self.refine => 1.0,
            true if self.refine > 0.0 => (2.0 - value / self.refine).max(0.0),
            true => 0.0,
            false if self.refine > 0.0 => value / self.refine,
            false => f64::from(value >= self.refine),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hysteresis() {
        let shear = Criterion::<2> { kind: Kind::VelocityGradient, level: 4, refine: 10.0, coarsen: 2.0 };
        let same = |v: f64| Value { leaf: v, parent: v };
        assert_eq!([11.0, 10.0, 5.0, 1.0].map(|v| shear.wanted_level(same(v), 3)), [4, 4, 3, 0]);
        assert_eq!(shear.wanted_level(same(5.0), 6), 4);
        assert_eq!(shear.wanted_level(same(11.0), 1), 2);
        let near = Criterion::<2> { kind: Kind::Collider(0), level: 5, refine: 0.1, coarsen: 0.3 };
        assert_eq!([-1.0, 0.1, 0.2, 0.4].map(|v| near.wanted_level(same(v), 5)), [5, 5, 5, 0]);
        assert_eq!(near.wanted_level(same(0.2), 2), 2);
        assert_eq!(near.wanted_level(Value { leaf: 0.4, parent: 0.25 }, 5), 5);
        assert_eq!(near.urgency(0.05), 1.0);
    }
}
