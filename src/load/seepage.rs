//! Steady seepage: water that flows through the pores of the ground between places where its head is held.
use crate::geometry::Shape;
use crate::quantity::{Quantity, in_job};

/// Heads that are held, and the ground between them.
#[derive(Clone, Debug)]
pub struct Seepage<const D: usize> {
    /// Where heads are held, in the order of the job; of two at one place the first holds.
    pub heads: Vec<HeldHead<D>>,
    /// Permeability by material, m/s.
    pub permeabilities: Vec<f64>,
    /// Time between solutions, s; infinite if heads are found at the start of stages only.
    pub every: f64,
}

/// A head that is held: free water, a well or a drain.
#[derive(Clone, Debug)]
pub struct HeldHead<const D: usize> {
    /// Name; part of the name of its column in the history.
    pub name: String,
    /// Where.
    pub region: HeldRegion<D>,
    /// Level of the water, m along the vertical.
    pub level: Quantity,
}

/// Where a head is held.
#[derive(Clone, Debug)]
pub enum HeldRegion<const D: usize> {
    /// On a face of the domain.
    Face {
        /// Its axis.
        axis: usize,
        /// 0: the lower one, 1: the upper one.
        side: usize,
    },
    /// In a shape, relative to the lower corner of the domain.
    Shape(Shape<D>),
}

impl<const D: usize> HeldHead<D> {
    /// Whether a point `x` (m from the lower corner of the domain, which ends at `extent`) lies where it is
    /// held, but for a rounding of `slack`, m.
    pub fn is_at(&self, x: &[f64; D], extent: &[f64; D], slack: f64) -> bool {
        match &self.region {
            HeldRegion::Face { axis, side: 0 } => x[*axis] <= slack,
            HeldRegion::Face { axis, .. } => x[*axis] >= extent[*axis] - slack,
            HeldRegion::Shape(shape) => shape.distance(x) <= slack,
        }
    }

    /// Level of its water at a point (m from the lower corner of the domain at `origin`) and a time (s), m.
    pub fn level_at(&self, origin: &[f64; D], x: &[f64; D], time: f64) -> f64 {
        self.level.at(in_job(origin, x), time)
    }
}
