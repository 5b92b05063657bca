//! Widths of boxes, as sorting needs them.
use super::bins::BoxWidths;
use super::leaf_bins::values;
use crate::kernel::simd::Lanes;
use crate::kernel::{BoxPolicy, Scheme, domain};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Tag};

/// Half widths as the kernels compute them.
pub(super) struct Widths<'a, const D: usize> {
    pub scheme: Scheme<'a>,
    /// Upper corner of the domain, m.
    pub extent: [f64; D],
}

impl<const D: usize> BoxWidths<D> for Widths<'_, D> {
    fn of_batch(&self, chunk: &Chunk<D>, particles: &[u32], cell: f64) -> [Lanes; D] {
        domain::full_half_widths_of(chunk, particles, cell, &self.extent, &self.scheme)
    }

    fn bounds(&self, chunk: &Chunk<D>, first: usize) -> Lanes {
        let half = || values(chunk, Layout::<D>::HALF, first);
        match self.scheme.boxes {
            BoxPolicy::Fixed => half(),
            BoxPolicy::Volume { max_stretch, .. } => half() * max_stretch,
            BoxPolicy::Cell => Lanes::new(std::array::from_fn(|lane| {
                let level = chunk.tags().get(first + lane).map_or(0, |&tag| Tag::unpack(tag).level);
                0.5 * self.scheme.root_cell / f64::from(1u32 << level)
            })),
        }
    }

    fn read_ahead(&self, chunk: &Chunk<D>, first: usize) {
        domain::read_ahead::<D>(chunk.place(), first);
    }

    fn bound(&self, chunk: &Chunk<D>) -> f64 {
        width_bound(chunk, &self.scheme)
    }
}

/// A bound on the half widths of all boxes that the particles of a chunk can have, m.
pub(super) fn width_bound<const D: usize>(chunk: &Chunk<D>, scheme: &Scheme<'_>) -> f64 {
    match scheme.boxes {
        BoxPolicy::Fixed => chunk.greatest_half(),
        BoxPolicy::Volume { max_stretch, .. } => max_stretch * chunk.greatest_half(),
        BoxPolicy::Cell => {
            let coarsest = chunk.tags().iter().map(|&tag| Tag::unpack(tag).level).min();
            coarsest.map_or(0.0, |level| 0.5 * scheme.root_cell / f64::from(1u32 << level))
        }
    }
}
