//! Lists of the particles in each bin of one rank; `leaf_bins.rs` finds those of one leaf.
use rayon::prelude::*;

use super::box_widths::{BinMissing, BoxWidths};
use super::leaf_bins::{LeafBins, Scratch, Sorting};
use super::leaf_faces::{NearLeaf, near_leaf};
use crate::grid::plan::Bin;
use crate::grid::{GridPlan, Window};
use crate::kernel::SubBox;
use crate::particle::Chunk;
use crate::particle::group::{Group, Share};

/// Particle lists of the bins of one rank.
#[derive(Clone, Debug, Default)]
pub struct BinLists<const D: usize> {
    /// Of leaves beside finer ones, and of others that have needed lists. `None` for the others, which are
    /// neither read nor stored.
    leaves: Vec<Option<Box<LeafBins<D>>>>,
    sorted: Vec<bool>,
    bounds: Vec<NearLeaf<D>>,
    /// Leaves with particles, where lists are those of a group; empty where they are of all particles.
    has_members: Vec<bool>,
}

impl<const D: usize> BinLists<D> {
    /// Not collective. Lists for the bins of a plan.
    pub fn new(plan: &GridPlan<D>) -> Self {
        let own = plan.leaf_start.len() - 1;
        let first = plan.tree.first_own();
        let leaves = (0..own).map(|leaf| LeafBins::beside_finer(plan, first + leaf));
        let bounds = (0..own).map(|leaf| near_leaf(&plan.tree, first + leaf, plan.root_edge));
        let has_members = Vec::new();
        Self { leaves: leaves.collect(), sorted: vec![false; own], bounds: bounds.collect(), has_members }
    }

    /// Not collective. Sorts all particles, or those of a group.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan; the caller makes it collective.
    pub fn sort(
        &mut self,
        plan: &GridPlan<D>,
        chunks: &[Chunk<D>],
        widths: &impl BoxWidths<D>,
        group: Option<&Group<'_>>,
    ) -> Result<(), BinMissing> {
        if let Some(group) = group {
            return self.sort_group(plan, chunks, widths, group);
        }
        self.has_members.clear();
        let leaves = self.leaves.par_iter_mut().zip(&mut self.sorted).zip(&self.bounds).enumerate();
        // All leaves, also after a failure: no leaf may keep the lists of the step before.
        let sorted =
            leaves.with_min_len(8).map_init(Scratch::default, |scratch, (leaf, ((bins, sorted), own))| {
                let chunk = &chunks[leaf];
                // An empty leaf has nothing to list.
                let sorting = Sorting { plan, widths, leaf, own };
                *sorted = !chunk.is_empty() && may_need_lists(bins.as_deref(), chunk, &sorting);
                if *sorted {
                    let bins = bins.get_or_insert_with(|| Box::new(LeafBins::beside_others(plan, leaf)));
                    *sorted = bins.sort(chunk, &sorting, scratch)?;
                }
                Ok(())
            });
        sorted.reduce(|| Ok(()), Result::and)
    }

    /// Sorts the particles of a group. Leaves that it shares with others have lists.
    fn sort_group(
        &mut self,
        plan: &GridPlan<D>,
        chunks: &[Chunk<D>],
        widths: &impl BoxWidths<D>,
        group: &Group<'_>,
    ) -> Result<(), BinMissing> {
        self.has_members.resize(chunks.len(), false);
        let lists = self.leaves.par_iter_mut().zip(&mut self.sorted).zip(&mut self.has_members);
        let leaves = lists.zip(&self.bounds).enumerate().with_min_len(8);
        let sorted =
            leaves.map_init(Scratch::default, |scratch, (leaf, (((bins, sorted), has_members), own))| {
                let chunk = &chunks[leaf];
                let share = group.share(chunk);
                let sorting = Sorting { plan, widths, leaf, own };
                *has_members = share != Share::None;
                *sorted = *has_members
                    && (share == Share::Some || may_need_lists(bins.as_deref(), chunk, &sorting));
                if *sorted {
                    let bins = bins.get_or_insert_with(|| Box::new(LeafBins::beside_others(plan, leaf)));
                    *sorted = bins.sort_group(chunk, &sorting, scratch, group)?;
                }
                Ok(())
            });
        sorted.reduce(|| Ok(()), Result::and)
    }

    /// Whether any particle of an own leaf is in these lists.
    pub fn has_members(&self, leaf: usize) -> bool {
        is_in(&self.has_members, leaf)
    }

    /// The lists of each own leaf, for the advance of its particles.
    pub(in crate::solver) fn by_leaf(&mut self) -> impl IndexedParallelIterator<Item = OfLeaf<'_, D>> {
        let leaves = self.leaves.par_iter_mut().zip(&self.sorted).zip(&self.bounds).enumerate();
        let has_members = &self.has_members;
        leaves.map(|(leaf, ((bins, &sorted), own))| OfLeaf {
            bins: bins.as_deref_mut(),
            sorted,
            own,
            has_members: is_in(has_members, leaf),
        })
    }

    /// Not collective. Gives every part the D of its whole box. `of_parts(bin, chunk, parts, each)` calls
    /// `each` with the number of a part and its D.
    pub fn spread_parts(
        &mut self,
        plan: &GridPlan<D>,
        chunks: &[Chunk<D>],
        of_parts: impl Fn(&Bin<D>, &Chunk<D>, &[SubBox<D>], &mut dyn FnMut(usize, [f64; D])) + Sync,
    ) {
        let leaves = self.leaves.par_iter_mut().zip(&self.sorted).enumerate().with_min_len(8);
        let lists = leaves.filter_map(|(leaf, (bins, &sorted))| {
            let bins = bins.as_deref_mut().filter(|bins| sorted && !bins.cut.is_empty())?;
            Some((leaf, bins))
        });
        lists.for_each(|(leaf, bins)| {
            let mut totals = vec![[0.0; D]; bins.cut.len()];
            for (members, bin) in bins.members.iter().zip(&plan.bins[plan.leaf_bins(leaf)]) {
                of_parts(bin, &chunks[leaf], &members.parts, &mut |part, spread| {
                    let part = &members.parts[part];
                    let total = &mut totals[part.slot as usize];
                    for axis in 0..D {
                        total[axis] = part.fraction.mul_add(spread[axis], total[axis]);
                    }
                });
            }
            let parts = bins.members.iter_mut().flat_map(|members| &mut members.parts);
            parts.for_each(|part| part.spread = totals[part.slot as usize]);
        });
    }

    /// The bins that have members, in order, with the nodes that these touch.
    pub fn occupied(
        &self,
        plan: &GridPlan<D>,
        chunks: &[Chunk<D>],
    ) -> impl Iterator<Item = (usize, Window<D>)> {
        let leaves = chunks.iter().enumerate();
        let leaves = leaves.filter(|(leaf, chunk)| !chunk.is_empty() && self.has_members(*leaf));
        leaves.flat_map(move |(leaf, _)| {
            let first = plan.leaf_bins(leaf).start;
            let bins = self.of_leaf(leaf);
            let is_occupied = move |number: usize| bins.is_none_or(|bins| !bins.members[number].is_empty());
            let numbers = (0..bins.map_or(1, |bins| bins.members.len())).filter(move |&n| is_occupied(n));
            numbers.map(move |number| {
                (first + number, bins.map_or(Window::FULL, |bins| bins.members[number].window))
            })
        })
    }

    /// Whether a leaf finer than own leaf `leaf` lies within `distance` (m) of a point in it, measured along
    /// the axes.
    pub fn is_finer_within(&self, leaf: usize, x: &[f64; D], distance: f64) -> bool {
        let is_near = |near: &NearLeaf<D>| {
            (0..D).all(|a| x[a] > near.lower[a] - distance && x[a] < near.upper[a] + distance)
        };
        self.leaves[leaf].as_deref().is_some_and(|bins| bins.finer.iter().any(is_near))
    }

    /// The bins of own leaf `leaf`, or `None` if all its particles are whole in its own bin.
    pub fn of_leaf(&self, leaf: usize) -> Option<&LeafBins<D>> {
        self.leaves[leaf].as_deref().filter(|_| self.sorted[leaf])
    }
}

/// Whether an own leaf has members, from a list of all such leaves that is empty where all have.
fn is_in(has_members: &[bool], leaf: usize) -> bool {
    has_members.get(leaf).copied().unwrap_or(true)
}

/// The lists of one own leaf.
pub(in crate::solver) struct OfLeaf<'a, const D: usize> {
    bins: Option<&'a mut LeafBins<D>>,
    sorted: bool,
    own: &'a NearLeaf<D>,
    /// Whether any particle of the leaf is in them.
    pub(in crate::solver) has_members: bool,
}

impl<const D: usize> OfLeaf<'_, D> {
    /// As [`BinLists::of_leaf`].
    pub(crate) fn lists(&self) -> Option<&LeafBins<D>> {
        self.bins.as_deref().filter(|_| self.sorted)
    }

    /// Begins the next sort when the particles of own leaf `leaf` have advanced and those outside it are
    /// gone: their data are still in the cache.
    pub(crate) fn presort(
        self,
        plan: &GridPlan<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        widths: &impl BoxWidths<D>,
        scratch: &mut Scratch,
    ) {
        let Self { bins, own, .. } = self;
        let sorting = Sorting { plan, widths, leaf, own };
        if let Some(bins) = bins
            && may_need_lists(Some(bins), chunk, &sorting)
        {
            bins.presort(chunk, &sorting, scratch);
        }
    }
}

/// Whether particles of a leaf may belong elsewhere than whole in its own bin. `bins` are those of the leaf,
/// if it has any.
fn may_need_lists<const D: usize>(
    bins: Option<&LeafBins<D>>,
    chunk: &Chunk<D>,
    sorting: &Sorting<'_, D, impl BoxWidths<D>>,
) -> bool {
    let &Sorting { plan, widths, own, .. } = sorting;
    let given = !widths.are_known_to_kernels();
    given || bins.is_some_and(LeafBins::is_beside_finer) || widths.bound(chunk) > 0.5 * plan.cell(own.level)
}
