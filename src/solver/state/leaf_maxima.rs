//! What the solver notes of each leaf's particles right after G2P, while they are in the cache: what refinement
//! criteria and splitting will ask for. Looking at them again later would cost more than all the rest of a regrid that
//! changes nothing.
use crate::adaptivity::resample::merge_backoff::Levels;
use crate::adaptivity::{Adaptivity, Kind};
use crate::kernel::domain;
use crate::particle::chunk::{Chunk, Layout};

/// Bounds on the particles of one leaf, before they migrate. One that changes leaf in that very step counts for the
/// leaf that it comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::solver) struct LeafMaxima<const D: usize> {
    /// Least and greatest velocity along each axis, 0 among them, m/s. Nodes would not do: those with next to no mass
    /// may be very fast.
    pub velocity: [[f64; D]; 2],
    /// Greatest plastic strain.
    pub plastic_strain: f64,
    /// Bound on the half width of any box, m.
    pub width: f64,
    /// Bound on the width of any box over its undeformed width.
    pub stretch: f64,
    /// Mean rate of the plastic strain in the last step, 1/s.
    pub plastic_rate: f64,
    /// What their tags say; `None` if nothing is known.
    pub levels: Option<Levels>,
}

impl<const D: usize> Default for LeafMaxima<D> {
    fn default() -> Self {
        Self {
            velocity: [[0.0; D]; 2],
            plastic_strain: 0.0,
            width: 0.0,
            stretch: 0.0,
            plastic_rate: 0.0,
            levels: None,
        }
    }
}

/// What to note.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::solver) struct Watch {
    /// Velocities and tags.
    velocity: bool,
    /// Greatest plastic strain.
    strain: bool,
    /// Widths of boxes.
    width: bool,
    /// Rate of the plastic strain.
    rate: bool,
}

impl Watch {
    /// What a job wants to know after a step of that number (the first is 1).
    pub(crate) fn after_step<const D: usize>(adaptivity: &Adaptivity<D>, step: u64) -> Self {
        let has = |wanted: fn(&Kind<D>) -> bool| adaptivity.criteria.iter().any(|c| wanted(&c.kind));
        // Files show the rate whenever they are written.
        let rate = has(|kind| matches!(kind, Kind::PlasticStrainRate));
        if !step.is_multiple_of(adaptivity.every) {
            return Self { rate, ..Self::default() };
        }
        let strain = has(|kind| matches!(kind, Kind::PlasticStrain));
        let width = adaptivity.split_stretch.is_some() || has(|kind| matches!(kind, Kind::Stretch));
        Self { velocity: true, strain, width, rate }
    }

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

    /// What follows from the state alone.
    pub(in crate::solver) fn look<const D: usize>(self, chunk: &Chunk<D>, maxima: &mut LeafMaxima<D>) {
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
            maxima.width = maxima.stretch * chunk.column(Layout::<D>::HALF).greatest();
        }
    }
}
