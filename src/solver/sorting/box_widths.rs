//! Widths of the boxes that are sorted into bins.
use crate::particle::Chunk;
use crate::simd::Lanes;

/// Half widths of the boxes of a chunk, and their bound.
pub trait BoxWidths<const D: usize>: Sync {
    /// Half widths of the boxes of up to `LANES` particles in a leaf with cells of edge `cell`, m; lanes
    /// behind the last are undefined.
    fn of_batch(&self, chunk: &Chunk<D>, particles: &[u32], cell: f64) -> [Lanes; D];
    /// Bounds on the half widths of `LANES` particles from `first` on, m; lanes behind the last particle are
    /// undefined.
    fn bounds(&self, chunk: &Chunk<D>, first: usize) -> Lanes;
    /// Prefetches the data that [`BoxWidths::of_batch`] reads of the `LANES` particles from `first` on.
    fn read_ahead(&self, _chunk: &Chunk<D>, _first: usize) {}
    /// A bound on all half widths in a chunk, m.
    fn bound(&self, chunk: &Chunk<D>) -> f64;
    /// Whether the kernels find the same half widths from the particles' state. If not, they get every box as
    /// parts, a narrow one as its only part.
    fn are_known_to_kernels(&self) -> bool {
        true
    }
}

/// A part of a box falls outside the bins of its leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the box of particle {id} reaches beyond the bins of its leaf")]
pub struct BinMissing {
    /// Identifier of the particle.
    pub id: u64,
}
