//! 2:1 balance over faces, edges and corners.
//!
//! Leaves that touch differ by one level at most. Stated for octants that are not leaves: if `p` is
//! subdivided, then the parent of every neighbour of `p` (same level) is subdivided, because its children
//! touch the children of `p` or lie one level above them. The smallest balanced tree that contains a given
//! one is therefore found by adding subdivided octants until the rule holds. Each application leads one level
//! up, so that one sweep from fine to coarse completes a rank. Requests for octants of other ranks go to
//! their owners; ranks sweep again until none sends.

use std::collections::{BTreeMap, HashSet};

use crate::adapt::split_while;
use crate::{Comm, Forest, MAX_LEVEL, Octant};

impl<const D: usize> Forest<D> {
    /// Collective. Refines as little as possible so that leaves which share a face, an edge or a
    /// corner differ by at most one level. Returns whether anything changed on any rank.
    pub fn balance(&mut self, comm: &Comm) -> bool {
        let mut ripple = Ripple::new(self, comm.rank());
        loop {
            let outgoing = ripple.settle();
            if !comm.any(!outgoing.is_empty()) {
                break;
            }
            ripple.hear(comm.sparse_exchange(outgoing));
        }
        let added = ripple.added;
        let mut leaves = Vec::with_capacity(self.leaves.len() + added.len() * (Octant::<D>::CHILDREN - 1));
        for leaf in &self.leaves {
            split_while(*leaf, &mut |octant| added.contains(&octant.code()), &mut leaves);
        }
        self.change_tree(comm, leaves, !added.is_empty())
    }

    /// Collective. Whether [`Forest::balance`] would change nothing.
    pub fn is_balanced(&self, comm: &Comm) -> bool {
        let mut ripple = Ripple::new(self, comm.rank());
        let outgoing = ripple.settle();
        ripple.hear(comm.sparse_exchange(outgoing));
        !comm.any(!ripple.added.is_empty())
    }
}

/// The subdivided octants that a rank must add.
struct Ripple<'a, const D: usize> {
    forest: &'a Forest<D>,
    rank: usize,
    /// Codes of octants in leaves of this rank that must be subdivided.
    added: HashSet<u64>,
    /// By level: subdivided octants whose neighbours have not been checked.
    work: Vec<Vec<Octant<D>>>,
    /// Codes that have been sent.
    sent: HashSet<u64>,
    /// Codes to send, by owner.
    outgoing: BTreeMap<usize, Vec<u64>>,
}

impl<'a, const D: usize> Ripple<'a, D> {
    /// Starts with all subdivided octants that contain leaves of this rank.
    fn new(forest: &'a Forest<D>, rank: usize) -> Self {
        let mut work = vec![Vec::new(); usize::from(MAX_LEVEL)];
        let mut previous: Option<&Octant<D>> = None;
        for leaf in &forest.leaves {
            for level in (1..leaf.level).rev() {
                let ancestor = leaf.ancestor(level);
                if previous.is_some_and(|p| ancestor.contains(p)) {
                    break; // seen with the previous leaf, like all above it
                }
                work[usize::from(level)].push(ancestor);
            }
            previous = Some(leaf);
        }
        Ripple { forest, rank, added: HashSet::new(), work, sent: HashSet::new(), outgoing: BTreeMap::new() }
    }

    /// Applies the rule until it holds on this rank. Returns the requests to other ranks.
    fn settle(&mut self) -> Vec<(usize, Vec<u64>)> {
        for level in (1..self.work.len()).rev() {
            while let Some(octant) = self.work[level].pop() {
                self.spread(octant);
            }
        }
        std::mem::take(&mut self.outgoing).into_iter().collect()
    }

    /// Adds the requests of other ranks.
    fn hear(&mut self, received: Vec<(usize, Vec<u64>)>) {
        for code in received.into_iter().flat_map(|(_, codes)| codes) {
            self.require(Octant::from_code(code).expect("ranks send codes of octants"));
        }
    }

    /// Requires the parents of all neighbours of a subdivided octant. They are its own parent and
    /// those neighbours of the parent that lie on the octant's side along each axis.
    fn spread(&mut self, octant: Octant<D>) {
        let Some(parent) = octant.parent() else { return };
        let side = octant.child_id();
        for axes in 0..Octant::<D>::CHILDREN {
            let offset = std::array::from_fn(|a| match (axes >> a & 1, side >> a & 1) {
                (0, _) => 0,
                (_, 0) => -1,
                _ => 1,
            });
            if let Some(neighbour) = parent.neighbour(offset, &self.forest.brick) {
                self.require(neighbour);
            }
        }
    }

    /// Requires that `octant` is subdivided.
    fn require(&mut self, octant: Octant<D>) {
        let markers = &self.forest.markers;
        let (first, end) = (octant.key(), octant.key_end());
        if markers[self.rank] <= first && end <= markers[self.rank + 1] {
            let leaf = self.forest.find(first).expect("leaves cover the own range");
            if self.forest.leaves[leaf].level <= octant.level && self.added.insert(octant.code()) {
                self.work[usize::from(octant.level)].push(octant);
            }
            return;
        }
        // An octant with leaves of several ranks is subdivided already, and they all know it.
        let owner = self.forest.owner(first);
        if end <= markers[owner + 1] && self.sent.insert(octant.code()) {
            self.outgoing.entry(owner).or_default().push(octant.code());
        }
    }
}
