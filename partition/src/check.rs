//! Validity of a forest, and its checksum.

use crate::{Brick, Comm, Disagreement, Forest, Octant};

/// Why leaves are not a tree, or a forest is not consistent. The same on all ranks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ForestError {
    /// The number of roots along some axis is out of range.
    #[error("a brick needs between 1 and 64 roots along each axis")]
    Brick,
    /// The leaves of one rank are not sorted, overlap or lie outside, or its tables are stale.
    #[error("{0}")]
    OneRank(#[from] Disagreement),
    /// A rank begins before the end of the last leaf of the ranks before it.
    #[error("the leaves of rank {rank} overlap or precede those of a lower rank")]
    Seam {
        /// The rank that begins too early.
        rank: usize,
    },
    /// The leaves do not cover the brick.
    #[error("the leaves cover {covered} of {volume} finest octants")]
    Incomplete {
        /// Finest octants in all leaves.
        covered: u64,
        /// Finest octants in the brick.
        volume: u64,
    },
    /// Ranks disagree about the brick, the markers, the count or the revision.
    #[error("ranks store different bricks, markers, counts or revisions")]
    Differ,
}

/// Fault in the forest of one rank; its text becomes that of a [`Disagreement`].
#[derive(Clone, Copy, Debug, thiserror::Error)]
enum Fault {
    #[error("leaf {0} lies outside the brick or is too deep")]
    Outside(usize),
    #[error("leaf {0} overlaps or precedes the leaf before it")]
    Order(usize),
    #[error("the stored key of leaf {0} is wrong")]
    Key(usize),
    #[error("the markers do not match the leaves")]
    Markers,
    #[error("the stored numbers of leaves are wrong")]
    Count,
}

/// Collective. Checks that the leaves of all ranks are a complete tree; returns the markers.
pub(crate) fn leaves<const D: usize>(
    comm: &Comm,
    brick: &Brick<D>,
    leaves: &[Octant<D>],
) -> Result<Vec<u64>, ForestError> {
    if comm.any(!brick.is_valid()) {
        return Err(ForestError::Brick);
    }
    comm.agree(own_leaves(brick, leaves))?;
    let first = leaves.first().map_or(u64::MAX, Octant::key);
    let end = leaves.last().map_or(0, Octant::key_end);
    let ranges = comm.all_gather_u64(&[first, end]);
    let mut reached = 0;
    let mut markers = vec![Brick::<D>::KEY_END; comm.size() + 1];
    for (rank, range) in ranges.chunks_exact(2).enumerate() {
        if range[1] > 0 {
            if range[0] < reached {
                return Err(ForestError::Seam { rank });
            }
            reached = range[1];
            markers[rank] = range[0];
        }
    }
    // An empty rank begins where the next one does.
    for rank in (0..comm.size()).rev() {
        if ranges[2 * rank + 1] == 0 {
            markers[rank] = markers[rank + 1];
        }
    }
    let mut covered = [leaves.iter().map(Octant::volume).sum::<u64>()];
    comm.sum_u64(&mut covered);
    if covered[0] != brick.volume() {
        return Err(ForestError::Incomplete { covered: covered[0], volume: brick.volume() });
    }
    Ok(markers)
}

/// Leaves of one rank: in the brick, sorted, disjoint.
fn own_leaves<const D: usize>(brick: &Brick<D>, leaves: &[Octant<D>]) -> Result<(), Fault> {
    let mut reached = 0;
    for (index, leaf) in leaves.iter().enumerate() {
        if !brick.contains(leaf) {
            return Err(Fault::Outside(index));
        }
        if leaf.key() < reached {
            return Err(Fault::Order(index));
        }
        reached = leaf.key_end();
    }
    Ok(())
}

impl<const D: usize> Forest<D> {
    /// Collective. Checks that the leaves of all ranks are a complete tree in curve order, that
    /// markers, counts and keys belong to them, and that all ranks store the same.
    pub fn is_valid(&self, comm: &Comm) -> Result<(), ForestError> {
        let mut common = self.markers.iter().fold(self.revision, |hash, &m| mix(hash ^ m));
        common =
            self.brick.roots.iter().fold(mix(common ^ self.global_len), |hash, &n| mix(hash ^ u64::from(n)));
        let (mut low, mut high) = ([common], [common]);
        comm.min_u64(&mut low);
        comm.max_u64(&mut high);
        if low != high {
            return Err(ForestError::Differ);
        }
        let markers = leaves(comm, &self.brick, &self.leaves)?;
        comm.agree(self.own_tables(&markers))?;
        let own = self.leaves.len() as u64;
        let mut total = [own];
        comm.sum_u64(&mut total);
        let first = comm.exclusive_sum_u64(own);
        let count_holds = total[0] == self.global_len && first == self.first_index;
        comm.agree(if count_holds { Ok(()) } else { Err(Fault::Count) })?;
        Ok(())
    }

    fn own_tables(&self, markers: &[u64]) -> Result<(), Fault> {
        if self.markers != markers {
            return Err(Fault::Markers);
        }
        if self.keys.len() != self.leaves.len() {
            return Err(Fault::Key(self.keys.len().min(self.leaves.len())));
        }
        match (0..self.keys.len()).find(|&i| self.keys[i] != self.leaves[i].key()) {
            Some(index) => Err(Fault::Key(index)),
            None => Ok(()),
        }
    }

    /// Collective. A number that depends on the brick and the leaves, but not on the partition:
    /// equal trees have equal checksums on any number of ranks.
    pub fn checksum(&self, comm: &Comm) -> u64 {
        // A sum, so that the order in which ranks are combined does not matter. Unlike a sum of plain keys it
        // does not hide differences, since each code is mixed first and occurs once.
        let own = self.leaves.iter().fold(0u64, |sum, leaf| sum.wrapping_add(mix(leaf.code())));
        let sum = comm.wrapping_sum_u64(own);
        self.brick.roots.iter().fold(mix(sum ^ D as u64), |hash, &n| mix(hash ^ u64::from(n)))
    }
}

/// Spreads every input bit over all output bits (a bijection: xor-shifts and odd factors).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}
