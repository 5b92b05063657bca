//! Leaves of any rank near given boxes.

use std::collections::{BTreeMap, BTreeSet};

use crate::{Brick, Comm, Forest, MAX_LEVEL, Octant};

/// A closed box on the finest lattice (units of `2^-MAX_LEVEL` root edges from the brick's lower
/// corner). It may have no volume; it is empty if `lo > hi` along an axis. Parts outside the brick
/// do not matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region<const D: usize> {
    /// Lower corner.
    pub lo: [u32; D],
    /// Upper corner, inclusive.
    pub hi: [u32; D],
}

impl<const D: usize> Region<D> {
    /// The closed box of an octant.
    pub fn of(octant: &Octant<D>) -> Self {
        Region { lo: octant.lower(), hi: octant.upper() }
    }

    /// Whether the region shares a point with the closed box of the octant.
    pub fn meets(&self, octant: &Octant<D>) -> bool {
        let (low, high) = (octant.lower(), octant.upper());
        (0..D).all(|a| self.lo[a] <= self.hi[a] && low[a] <= self.hi[a] && self.lo[a] <= high[a])
    }

    /// Octants that cover all leaves' shares of the region: of one level, at most two along each axis unless
    /// they are roots. Every leaf that intersects the region contains one of them, or lies in one and
    /// intersects the region there.
    fn cover(&self, brick: &Brick<D>) -> Vec<Octant<D>> {
        let size = brick.lattice_size();
        if (0..D).any(|a| self.lo[a] > self.hi[a] || self.lo[a] > size[a]) {
            return Vec::new();
        }
        // Finest octants that touch the closed box.
        let first: [u32; D] = std::array::from_fn(|a| self.lo[a].saturating_sub(1));
        let last: [u32; D] = std::array::from_fn(|a| self.hi[a].min(size[a] - 1));
        let narrow = |shift: u32| (0..D).all(|a| (last[a] >> shift) - (first[a] >> shift) <= 1);
        let max_shift = u32::from(MAX_LEVEL);
        let shift = (0..max_shift).find(|&s| narrow(s)).unwrap_or(max_shift);
        let level = MAX_LEVEL - shift as u8;
        let mut cover = vec![[0u32; D]];
        for a in 0..D {
            let along = (first[a] >> shift)..=(last[a] >> shift);
            cover = cover
                .iter()
                .flat_map(|coord| {
                    along.clone().map(move |c| {
                        let mut coord = *coord;
                        coord[a] = c;
                        coord
                    })
                })
                .collect();
        }
        cover.into_iter().map(|coord| Octant { level, coord }).collect()
    }
}

impl<const D: usize> Forest<D> {
    /// Collective. All leaves of any rank whose closed box intersects a query's closed box, with their
    /// owners; in curve order, each once. Each query goes only to the ranks that own leaves where it lies, so
    /// the cost does not grow with the size of the tree.
    pub fn leaves_in(&self, comm: &Comm, queries: &[Region<D>]) -> Vec<(Octant<D>, usize)> {
        let mut outgoing: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for query in queries {
            for owner in self.owners_of(query) {
                let message = outgoing.entry(owner).or_default();
                message.extend_from_slice(&query.lo);
                message.extend_from_slice(&query.hi);
            }
        }
        let asked = comm.sparse_exchange(outgoing.into_iter().collect());
        let mut found_for = vec![usize::MAX; self.leaves.len()];
        let mut answers = Vec::with_capacity(asked.len());
        for (source, message) in asked {
            let mut found = Vec::new();
            for query in message.chunks_exact(2 * D) {
                let query = Region {
                    lo: std::array::from_fn(|a| query[a]),
                    hi: std::array::from_fn(|a| query[D + a]),
                };
                self.own_leaves_in(&query, &mut |leaf| {
                    if found_for[leaf] != source {
                        found_for[leaf] = source;
                        found.push(leaf);
                    }
                });
            }
            found.sort_unstable();
            answers.push((source, found.iter().map(|&leaf| self.leaves[leaf].code()).collect()));
        }
        // Sources come sorted by rank, and the segments of ranks follow each other on the curve.
        let mut result = Vec::new();
        for (owner, codes) in comm.sparse_exchange::<u64>(answers) {
            let octant = |code| Octant::from_code(code).expect("ranks send codes of octants");
            result.extend(codes.into_iter().map(|code| (octant(code), owner)));
        }
        result
    }

    /// Collective. Hands each request, a region with a value, to all ranks that own leaves which intersect
    /// the region. Returns the requests that concern leaves of this rank: by sending rank, then in its order.
    pub fn to_owners(&self, comm: &Comm, requests: &[(Region<D>, u32)]) -> Vec<(Region<D>, u32)> {
        let mut outgoing: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for (region, value) in requests {
            for owner in self.owners_of(region) {
                let message = outgoing.entry(owner).or_default();
                message.extend_from_slice(&region.lo);
                message.extend_from_slice(&region.hi);
                message.push(*value);
            }
        }
        let received = comm.sparse_exchange(outgoing.into_iter().collect());
        let words = received.iter().flat_map(|(_, message)| message.chunks_exact(2 * D + 1));
        words
            .map(|words| {
                let region = Region {
                    lo: std::array::from_fn(|a| words[a]),
                    hi: std::array::from_fn(|a| words[D + a]),
                };
                (region, words[2 * D])
            })
            .collect()
    }

    /// Not collective. Calls `found` with the index of each leaf of this rank that intersects the region,
    /// each once, in no particular order.
    pub fn own_leaves_in(&self, region: &Region<D>, found: &mut impl FnMut(usize)) {
        // Leaves larger than an octant of the cover, which may contain several of those.
        let mut large = Vec::new();
        for octant in region.cover(&self.brick) {
            let first = self.keys.partition_point(|&key| key < octant.key());
            let end = first + self.keys[first..].partition_point(|&key| key < octant.key_end());
            // A leaf around the octant begins at its key or before; several octants may share it.
            let around = if first < end && self.leaves[first].contains(&octant) {
                Some(first)
            } else {
                first.checked_sub(1).filter(|&i| first == end && self.leaves[i].contains(&octant))
            };
            match around {
                Some(leaf) if large.contains(&leaf) => {}
                Some(leaf) => {
                    if region.meets(&self.leaves[leaf]) {
                        found(leaf);
                    }
                    if self.leaves[leaf].level < octant.level {
                        large.push(leaf);
                    }
                }
                None => self.descend(region, &octant, first, end, found),
            }
        }
    }

    /// Reports the leaves `first..end`, all strictly inside `octant`, that intersect the region.
    fn descend(
        &self,
        region: &Region<D>,
        octant: &Octant<D>,
        first: usize,
        end: usize,
        found: &mut impl FnMut(usize),
    ) {
        // For a handful of leaves, testing each is quicker than more bisection.
        if end - first <= 2 * Octant::<D>::CHILDREN || octant.level == MAX_LEVEL {
            (first..end).filter(|&i| region.meets(&self.leaves[i])).for_each(found);
            return;
        }
        let mut child_first = first;
        for c in 0..Octant::<D>::CHILDREN {
            let child = octant.child(c);
            let child_end =
                child_first + self.keys[child_first..end].partition_point(|&key| key < child.key_end());
            if child_end > child_first && region.meets(&child) {
                self.descend(region, &child, child_first, child_end, found);
            }
            child_first = child_end;
        }
    }

    /// The ranks that own leaves which intersect the region.
    fn owners_of(&self, region: &Region<D>) -> BTreeSet<usize> {
        let mut owners = BTreeSet::new();
        let mut open = region.cover(&self.brick);
        while let Some(octant) = open.pop() {
            if !region.meets(&octant) {
                continue;
            }
            let first = self.owner(octant.key());
            if self.markers[first + 1] >= octant.key_end() {
                owners.insert(first);
            } else {
                // A finest octant has one key and so one owner: there is a child.
                open.extend((0..Octant::<D>::CHILDREN).map(|c| octant.child(c)));
            }
        }
        owners
    }
}
