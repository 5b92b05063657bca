//! Refining and coarsening.

use std::ops::Range;

use crate::{Comm, Forest, MAX_LEVEL, Octant};

/// Fate of a leaf in the next change of the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// Leave it.
    #[default]
    Keep,
    /// Replace it by its children. A leaf of [`MAX_LEVEL`] is kept.
    Refine,
    /// Replace it and its siblings by their parent, if all of them are leaves of this rank and
    /// marked so. Otherwise it is kept.
    Coarsen,
}

impl<const D: usize> Forest<D> {
    /// Collective. Changes the tree by one level where marked, not the partition. Returns whether
    /// anything changed on any rank.
    ///
    /// After [`Forest::partition`] between families and [`Forest::uniform`] every family of leaves is on one
    /// rank, so that the result does not depend on the number of ranks. The result need not be balanced.
    ///
    /// # Panics
    /// If there is not one mark per leaf.
    pub fn adapt(&mut self, comm: &Comm, marks: &[Mark]) -> bool {
        assert_eq!(marks.len(), self.leaves.len(), "one mark per leaf");
        let mut leaves = Vec::with_capacity(self.leaves.len());
        let mut changed = false;
        let mut i = 0;
        while i < marks.len() {
            let leaf = self.leaves[i];
            if let Some(parent) = self.coarsening_family(i, marks) {
                leaves.push(parent);
                changed = true;
                i += Octant::<D>::CHILDREN;
                continue;
            }
            if marks[i] == Mark::Refine && leaf.level < MAX_LEVEL {
                leaves.extend((0..Octant::<D>::CHILDREN).map(|c| leaf.child(c)));
                changed = true;
            } else {
                leaves.push(leaf);
            }
            i += 1;
        }
        self.change_tree(comm, leaves, changed)
    }

    /// Collective. Refines leaves for which `wanted` holds, then their children for which it
    /// holds, and so on down to [`MAX_LEVEL`]. Returns whether anything changed on any rank.
    pub fn refine_where(&mut self, comm: &Comm, mut wanted: impl FnMut(&Octant<D>) -> bool) -> bool {
        let mut leaves = Vec::with_capacity(self.leaves.len());
        for leaf in &self.leaves {
            split_while(*leaf, &mut wanted, &mut leaves);
        }
        let changed = leaves.len() != self.leaves.len();
        self.change_tree(comm, leaves, changed)
    }

    /// The parent of the family that begins at leaf `i`, if all its members are to be coarsened.
    fn coarsening_family(&self, i: usize, marks: &[Mark]) -> Option<Octant<D>> {
        let members = i..i + Octant::<D>::CHILDREN;
        let family = self.leaves.get(members.clone())?;
        let parent = family[0].parent()?;
        let whole = family.iter().enumerate().all(|(c, leaf)| *leaf == parent.child(c));
        (whole && marks[members].iter().all(|&m| m == Mark::Coarsen)).then_some(parent)
    }

    /// Collective. Puts changed leaves in place. They cover the same keys, so markers stay.
    pub(crate) fn change_tree(&mut self, comm: &Comm, leaves: Vec<Octant<D>>, changed: bool) -> bool {
        let any = comm.any(changed);
        if any {
            self.set_leaves(comm, leaves);
            self.revision += 1;
        }
        any
    }
}

/// Appends `octant`, or its descendants as far as `wanted` asks for, in curve order.
pub(crate) fn split_while<const D: usize>(
    octant: Octant<D>,
    wanted: &mut impl FnMut(&Octant<D>) -> bool,
    leaves: &mut Vec<Octant<D>>,
) {
    if octant.level < MAX_LEVEL && wanted(&octant) {
        for c in 0..Octant::<D>::CHILDREN {
            split_while(octant.child(c), wanted, leaves);
        }
    } else {
        leaves.push(octant);
    }
}

/// Not collective. Matches the leaves of one rank before and after its tree changed: the smallest
/// groups `(old, new)` of leaves that cover the same octant, in curve order. A leaf that stayed is
/// `(i..i + 1, j..j + 1)`, a refined one has several new, a coarsened family several old.
///
/// # Panics
/// If the two do not cover the same part of the curve.
pub fn correspondence<const D: usize>(
    old: &[Octant<D>],
    new: &[Octant<D>],
) -> Vec<(Range<usize>, Range<usize>)> {
    let mut groups = Vec::with_capacity(old.len().min(new.len()));
    let (mut i, mut j) = (0, 0);
    while i < old.len() && j < new.len() {
        let (first_old, first_new) = (i, j);
        let around = if old[i].level <= new[j].level { old[i] } else { new[j] };
        i += old[i..].iter().take_while(|leaf| around.contains(leaf)).count();
        j += new[j..].iter().take_while(|leaf| around.contains(leaf)).count();
        assert!(i > first_old && j > first_new, "leaves of different parts of the curve");
        groups.push((first_old..i, first_new..j));
    }
    assert!(i == old.len() && j == new.len(), "leaves of different parts of the curve");
    groups
}
