//! Moving leaves, and what belongs to them, to their new owners.

use std::ops::Range;

use crate::forest::owner;
use crate::weight::{self, CutAt, Cuts};
use crate::{Comm, Forest, Octant};

/// Which leaves a [`Forest::partition`] has moved, so that what belongs to them can follow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shipment {
    old_len: usize,
    new_len: usize,
    sends: Vec<(usize, Range<usize>)>,
    receives: Vec<(usize, Range<usize>)>,
    kept: (Range<usize>, Range<usize>),
    changed: bool,
}

impl<const D: usize> Forest<D> {
    /// Collective. Moves the cuts between ranks so that each gets an equal share of the weight, up
    /// to half a leaf or half a family, and moves the leaves accordingly. The tree stays.
    ///
    /// The new partition depends on the leaves, their `weights` and the number of ranks only, not
    /// on the present one. Ranks may end empty.
    ///
    /// # Panics
    /// If there is not one weight per leaf or the sum of all weights exceeds 64 bits.
    pub fn partition(&mut self, comm: &Comm, weights: &[u64], at: CutAt) -> Shipment {
        let cuts = self.plan_partition(comm, weights, at);
        self.partition_at(comm, cuts)
    }

    /// Collective. Where [`Forest::partition`] would cut the curve. Changes nothing, so that a caller can
    /// evaluate a new partition.
    ///
    /// # Panics
    /// As [`Forest::partition`].
    pub fn plan_partition(&self, comm: &Comm, weights: &[u64], at: CutAt) -> Cuts {
        weight::cuts(self, comm, weights, at)
    }

    /// Collective. Moves the cuts between ranks to the given places, and the leaves accordingly. The tree
    /// stays.
    ///
    /// # Panics
    /// If the forest has changed since the cuts were planned.
    pub fn partition_at(&mut self, comm: &Comm, cuts: Cuts) -> Shipment {
        assert_eq!(cuts.revision, self.revision, "cuts of an earlier forest");
        let markers = cuts.markers;
        let old_len = self.leaves.len();
        let rank = comm.rank();
        let mut sends = Vec::new();
        let mut kept_old = 0..0;
        let mut first = 0;
        while first < old_len {
            let to = owner(&markers, self.keys[first]);
            let end = first + self.keys[first..].partition_point(|&key| key < markers[to + 1]);
            if to == rank {
                kept_old = first..end;
            } else {
                sends.push((to, first..end));
            }
            first = end;
        }

        let codes = |range: &Range<usize>| self.leaves[range.clone()].iter().map(Octant::code).collect();
        let received = comm.sparse_exchange::<u64>(sends.iter().map(|(to, r)| (*to, codes(r))).collect());

        let mut leaves = Vec::new();
        let mut receives = Vec::with_capacity(received.len());
        let split = received.partition_point(|&(source, _)| source < rank);
        let mut append = |leaves: &mut Vec<Octant<D>>, part: &[(usize, Vec<u64>)]| {
            for (source, codes) in part {
                let first = leaves.len();
                leaves.extend(
                    codes.iter().map(|&c| Octant::from_code(c).expect("ranks send codes of octants")),
                );
                receives.push((*source, first..leaves.len()));
            }
        };
        append(&mut leaves, &received[..split]);
        let kept_new = leaves.len()..leaves.len() + kept_old.len();
        leaves.extend_from_slice(&self.leaves[kept_old.clone()]);
        append(&mut leaves, &received[split..]);

        // Cuts can move over keys without leaves or change while all leaves stay: compare leaves.
        let changed = comm.any(!sends.is_empty());
        let new_len = leaves.len();
        if changed {
            self.markers = markers;
            self.set_leaves(comm, leaves);
            self.revision += 1;
        }
        Shipment { old_len, new_len, sends, receives, kept: (kept_old, kept_new), changed }
    }
}

impl Shipment {
    /// Not collective. Whether any leaf of any rank moved; the same on all ranks.
    pub fn changed(&self) -> bool {
        self.changed
    }

    /// Not collective. `(rank, old leaves)` that left, sorted; `old leaves` are indices among the
    /// leaves before.
    pub fn sends(&self) -> &[(usize, Range<usize>)] {
        &self.sends
    }

    /// Not collective. `(rank, new leaves)` that arrived, sorted; `new leaves` are indices among
    /// the leaves after.
    pub fn receives(&self) -> &[(usize, Range<usize>)] {
        &self.receives
    }

    /// Not collective. The leaves that stayed, as indices `(before, after)`.
    pub fn kept(&self) -> (Range<usize>, Range<usize>) {
        self.kept.clone()
    }

    /// Collective. Moves one item per old leaf and returns one item per new leaf. Items of leaves that stay
    /// are not touched; those of leaves that leave are `append`ed to a message, freed, and made anew from
    /// their bytes. May be called any number of times, for different things.
    ///
    /// # Panics
    /// If there is not one item per old leaf.
    pub fn move_items<T>(
        &self,
        comm: &Comm,
        per_leaf: Vec<T>,
        append: impl Fn(&T, &mut Vec<u8>),
        from_bytes: impl Fn(&[u8]) -> T,
    ) -> Vec<T> {
        assert_eq!(per_leaf.len(), self.old_len, "one item per leaf");
        let (kept_old, kept_new) = self.kept();
        let mut kept = Vec::with_capacity(kept_old.len());
        let mut sends = self.sends.iter().peekable();
        let mut outgoing = Vec::with_capacity(self.sends.len());
        let mut items = per_leaf.into_iter().enumerate();
        while let Some((leaf, item)) = items.next() {
            if kept_old.contains(&leaf) {
                kept.push(item);
            } else if let Some((to, range)) = sends.next_if(|(_, range)| range.start == leaf) {
                let rest = items.by_ref().take(range.len() - 1).map(|(_, item)| item);
                outgoing.push((*to, pack(std::iter::once(item).chain(rest), range.len(), &append)));
            }
        }
        let received = comm.sparse_exchange(outgoing);
        assert!(
            received.iter().map(|(source, _)| source).eq(self.receives.iter().map(|(source, _)| source)),
            "items come from the ranks that sent leaves"
        );
        let mut result = Vec::with_capacity(self.new_len);
        for ((_, range), (_, bytes)) in self.receives.iter().zip(received) {
            if range.start >= kept_new.start {
                result.append(&mut kept);
            }
            unpack(&bytes, range.len(), &from_bytes, &mut result);
        }
        result.append(&mut kept);
        assert_eq!(result.len(), self.new_len, "one item per new leaf");
        result
    }
}

/// The lengths of the items in bytes, then their bytes.
fn pack<T>(items: impl Iterator<Item = T>, count: usize, append: impl Fn(&T, &mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = vec![0; 8 * count];
    for (number, item) in items.enumerate() {
        let start = bytes.len();
        append(&item, &mut bytes);
        let length = (bytes.len() - start) as u64;
        bytes[8 * number..][..8].copy_from_slice(&length.to_ne_bytes());
    }
    bytes
}

/// Inverse of [`pack`]: appends `count` items.
fn unpack<T>(bytes: &[u8], count: usize, from_bytes: impl Fn(&[u8]) -> T, items: &mut Vec<T>) {
    let (lengths, mut rest) = bytes.split_at(8 * count);
    for length in bytemuck::allocation::pod_collect_to_vec::<u8, u64>(lengths) {
        let (item, after) = rest.split_at(length as usize);
        items.push(from_bytes(item));
        rest = after;
    }
    assert!(rest.is_empty(), "items are as long as their lengths say");
}
