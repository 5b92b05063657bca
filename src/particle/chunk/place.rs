//! Which content a chunk has, and where it lies.
use std::num::NonZeroU64;
use std::sync::atomic::{AtomicU64, Ordering};

use super::{Layout, TILE};

/// Names what the first particles of a chunk hold: as long as a chunk has the revision that it once had,
/// these particles are what they were, where they were. Appending keeps it, every other change ends it, and
/// no two contents have the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Revision(NonZeroU64);

impl Revision {
    pub(super) fn new() -> Option<Self> {
        static LAST: AtomicU64 = AtomicU64::new(0);
        NonZeroU64::new(LAST.fetch_add(1, Ordering::Relaxed) + 1).map(Self)
    }
}

/// Where a chunk lies in memory: from the chunk that comes next, kernels fetch the first lines while they
/// are still at work on this one. Holds no borrow; an address that is no longer right costs time and nothing
/// else.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// Address of the first tile; 0 if there are no particles.
    pub tiles: usize,
    /// Address of the tags.
    pub tags: usize,
}

impl Place {
    /// Where the tile of particle `p` lies, and its tag.
    #[inline(always)]
    pub fn of_particle<const D: usize>(self, p: usize) -> Self {
        let tile = p / TILE * Layout::<D>::REALS * size_of::<[f64; TILE]>();
        Self { tiles: self.tiles + tile, tags: self.tags + p * size_of::<u64>() }
    }
}
