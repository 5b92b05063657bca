//! Extrema of each leaf's particles for refinement criteria and splitting. The solver records them right
//! after G2P, while the particles are in the cache: reading the particles again later would cost more than
//! all the rest of a regrid that changes nothing.
use super::resample::merge_backoff::Levels;
use crate::kernel::domain;
use crate::particle::chunk::{Chunk, Layout};

/// Bounds on the particles of one leaf, before they migrate. A particle that changes leaf in this step counts
/// for the leaf that it comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LeafMaxima<const D: usize> {
    /// Least and greatest velocity along each axis, 0 among them, m/s. Velocities of nodes are unsuitable:
    /// nodes of little mass may be very fast.
    pub velocity: [[f64; D]; 2],
    /// Greatest plastic strain.
    pub plastic_strain: f64,
    /// Bound on the half width of any box, m.
    pub width: f64,
    /// Bound on the width of any box over its undeformed width.
    pub stretch: f64,
    /// Bound on the half width (m) of boxes of elastic particles that are stretched (see
    /// `resample/halve.rs`).
    pub elastic_width: f64,
    /// Mean rate of the plastic strain in the last step, 1/s.
    pub plastic_rate: f64,
    /// Levels in their tags; `None` if unknown.
    pub levels: Option<Levels>,
}

impl<const D: usize> Default for LeafMaxima<D> {
    fn default() -> Self {
        Self {
            velocity: [[0.0; D]; 2],
            plastic_strain: 0.0,
            width: 0.0,
            stretch: 0.0,
            elastic_width: 0.0,
            plastic_rate: 0.0,
            levels: None,
        }
    }
}

/// Quantities to record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Watch {
    /// Velocities and tags.
    pub velocity: bool,
    /// Greatest plastic strain.
    pub strain: bool,
    /// Widths of boxes.
    pub width: bool,
    /// Rate of the plastic strain.
    pub rate: bool,
}

impl Watch {
    /// To be called before the leaf's particles advance.
    pub(crate) fn before<const D: usize>(self, chunk: &Chunk<D>, maxima: &mut LeafMaxima<D>) {
        if self.rate {
            maxima.plastic_rate = chunk.column(Layout::<D>::PLASTIC_STRAIN).sum();
        }
    }

    /// To be called after the leaf's particles have advanced by `dt` (s).
    pub(crate) fn after<const D: usize>(self, chunk: &Chunk<D>, dt: f64, maxima: &mut LeafMaxima<D>) {
        if self.rate {
            let gain = chunk.column(Layout::<D>::PLASTIC_STRAIN).sum() - maxima.plastic_rate;
            maxima.plastic_rate = gain / (dt * chunk.len().max(1) as f64);
        }
        self.look(chunk, maxima);
    }

    /// Records the quantities that follow from the state alone.
    pub(crate) fn look<const D: usize>(self, chunk: &Chunk<D>, maxima: &mut LeafMaxima<D>) {
        if self.velocity {
            let ranges: [[f64; 2]; D] =
                std::array::from_fn(|axis| chunk.column(Layout::<D>::VELOCITY + axis).range());
            maxima.velocity = std::array::from_fn(|side| ranges.map(|range| range[side]));
            maxima.levels = Some(Levels::of(chunk.tags()));
        }
        if self.strain {
            maxima.plastic_strain = chunk.column(Layout::<D>::PLASTIC_STRAIN).greatest();
        }
        if self.width {
            maxima.stretch = domain::greatest_stretch(chunk);
            maxima.width = maxima.stretch * domain::greatest_undeformed(chunk);
        }
    }
}
