//! The distributed linear octree: construction and look-up.

use crate::check::{self, ForestError};
use crate::{Brick, Comm, MAX_LEVEL, Octant};

/// A tree over a brick of roots, distributed over ranks.
///
/// Each rank owns a contiguous segment of the leaves along the Morton curve (maybe none). Besides
/// its own leaves a rank stores one marker per rank and nothing else about the others.
///
/// A call changes the tree ([`Forest::adapt`], [`Forest::refine_where`], [`Forest::balance`]) or the
/// partition ([`Forest::partition`]), never both. If it changes anything on any rank, it raises the
/// [`Forest::revision`] on all.
#[derive(Clone, Debug)]
pub struct Forest<const D: usize> {
    pub(crate) brick: Brick<D>,
    /// Leaves of this rank in curve order.
    pub(crate) leaves: Vec<Octant<D>>,
    /// Key of each leaf, for binary searches.
    pub(crate) keys: Vec<u64>,
    /// Rank `r` owns the keys `markers[r]..markers[r + 1]`; an empty rank owns an empty range.
    pub(crate) markers: Vec<u64>,
    pub(crate) first_index: u64,
    pub(crate) global_len: u64,
    pub(crate) revision: u64,
}

impl<const D: usize> Forest<D> {
    /// Collective. All octants of `level` as leaves, in equal shares that keep families whole.
    ///
    /// # Panics
    /// If the brick is not valid or the level deeper than [`MAX_LEVEL`].
    pub fn uniform(comm: &Comm, brick: Brick<D>, level: u8) -> Self {
        assert!(brick.is_valid(), "{brick:?}");
        assert!(level <= MAX_LEVEL, "level {level} is deeper than {MAX_LEVEL}");
        let per_root_bits = D as u32 * u32::from(level);
        let total = brick.root_count() << per_root_bits;
        let leaf = |index: u64| {
            let root = brick.root_on_curve(index >> per_root_bits);
            let inside = index & ((1 << per_root_bits) - 1);
            let key = root.key() + (inside << (D as u32 * u32::from(MAX_LEVEL - level)));
            Octant::from_key(key, level)
        };
        // The same cuts as `partition` chooses for equal weights.
        let family = if level == 0 { 1 } else { Octant::<D>::CHILDREN as u128 };
        let ranks = comm.size() as u128;
        let cut = |rank: usize| {
            let ideal = rank as u128 * u128::from(total); // in units of 1 / ranks
            let below = ideal / (ranks * family);
            let rounded = below + u128::from(2 * (ideal - below * ranks * family) > ranks * family);
            (rounded * family) as u64
        };
        let marker = |rank: usize| match cut(rank) {
            index if index < total => leaf(index).key(),
            _ => Brick::<D>::KEY_END,
        };
        let own = cut(comm.rank())..cut(comm.rank() + 1);
        let leaves: Vec<_> = own.clone().map(leaf).collect();
        Forest {
            brick,
            keys: leaves.iter().map(Octant::key).collect(),
            leaves,
            markers: (0..=comm.size()).map(marker).collect(),
            first_index: own.start,
            global_len: total,
            revision: 0,
        }
    }

    /// Collective. The tree whose leaves, in curve order, are those of rank 0, then those of
    /// rank 1, and so on. Checks everything; the same error on all ranks.
    pub fn from_leaves(comm: &Comm, brick: Brick<D>, leaves: Vec<Octant<D>>) -> Result<Self, ForestError> {
        let markers = check::leaves(comm, &brick, &leaves)?;
        let mut forest = Forest {
            brick,
            leaves: vec![],
            keys: vec![],
            markers,
            first_index: 0,
            global_len: 0,
            revision: 0,
        };
        forest.set_leaves(comm, leaves);
        Ok(forest)
    }

    /// Not collective. Leaves of this rank, in curve order.
    pub fn leaves(&self) -> &[Octant<D>] {
        &self.leaves
    }

    /// Not collective. The brick of roots.
    pub fn brick(&self) -> &Brick<D> {
        &self.brick
    }

    /// Not collective. Number of changes of tree or partition so far; the same on all ranks. Data derived
    /// from the forest store the revision that they were built for.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Not collective. Number of leaves of all ranks.
    pub fn global_len(&self) -> u64 {
        self.global_len
    }

    /// Not collective. Position of this rank's first leaf along the whole curve.
    pub fn first_index(&self) -> u64 {
        self.first_index
    }

    /// Not collective. First key of each rank, and the end: rank `r` owns the leaves with keys
    /// `markers[r]..markers[r + 1]`.
    pub fn markers(&self) -> &[u64] {
        &self.markers
    }

    /// Not collective. The rank that owns the leaf with this finest octant.
    pub fn owner(&self, key: u64) -> usize {
        owner(&self.markers, key)
    }

    /// Not collective. The leaf of this rank that contains this finest octant, as index.
    pub fn find(&self, key: u64) -> Option<usize> {
        let index = self.keys.partition_point(|&first| first <= key).checked_sub(1)?;
        (key < self.leaves[index].key_end()).then_some(index)
    }

    /// Collective. Puts new leaves in place of the own ones; markers are set by the caller.
    pub(crate) fn set_leaves(&mut self, comm: &Comm, leaves: Vec<Octant<D>>) {
        self.keys = leaves.iter().map(Octant::key).collect();
        self.leaves = leaves;
        let own = self.leaves.len() as u64;
        let mut total = [own];
        comm.sum_u64(&mut total);
        self.global_len = total[0];
        self.first_index = comm.exclusive_sum_u64(own);
    }
}

/// The rank whose key range contains `key`.
pub(crate) fn owner(markers: &[u64], key: u64) -> usize {
    debug_assert!(key < markers[markers.len() - 1], "key {key} beyond the curve");
    // Of ranks with equal markers all but the last are empty.
    markers.partition_point(|&marker| marker <= key) - 1
}
