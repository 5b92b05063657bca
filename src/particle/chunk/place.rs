//! Revision of a chunk's content, and its place in memory.
use std::num::NonZeroU64;
use std::sync::atomic::{AtomicU64, Ordering};

use super::{Layout, TILE};

/// Number of the content of a chunk: as long as a chunk has the same revision, the particles that it had then
/// are unchanged, at the same indices. Appending keeps it, every other change ends it, and no two contents
/// share one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Revision(NonZeroU64);

impl Revision {
    pub(super) fn new() -> Option<Self> {
        static LAST: AtomicU64 = AtomicU64::new(0);
        NonZeroU64::new(LAST.fetch_add(1, Ordering::Relaxed) + 1).map(Self)
    }
}

/// Place of a chunk in memory: kernels prefetch the first lines of the next chunk while they work on this
/// one. Holds no borrow; an outdated address costs time and nothing else.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// Address of the first tile; 0 if there are no particles.
    pub tiles: usize,
    /// Address of the tags.
    pub tags: usize,
}

impl Place {
    /// Places of the tile and the tag of particle `p`.
    #[inline(always)]
    pub fn of_particle<const D: usize>(self, p: usize) -> Self {
        let tile = p / TILE * Layout::<D>::REALS * size_of::<[f64; TILE]>();
        Self { tiles: self.tiles + tile, tags: self.tags + p * size_of::<u64>() }
    }
}
