//! Bins, and how far the boxes of a leaf's particles reach: which bins a leaf feeds, and which leaves feed a
//! bin.
//!
//! The two answers come from different ranks and must agree. Both rest on `Reach`, which a rank can decide
//! from the leaves near the bin.
use std::cell::OnceCell;

use partition::{MAX_LEVEL, Octant, Region};
use rayon::prelude::*;

use super::ghost_layer::{Cover, KnownTree};
use crate::grid::mask::{box_offsets, offset, offset_count, shifted};

/// Bins of known leaf `leaf` inside itself: its own block first, then every block inside it, on the level of
/// a finer leaf that it touches, by level and curve position.
fn inner_bins<const D: usize>(tree: &KnownTree<D>, leaf: usize) -> Vec<Octant<D>> {
    let here = tree.leaves()[leaf];
    let mut finer: Vec<Octant<D>> =
        finer_neighbours(tree, here).flat_map(|other| blocks_beside(here, other)).collect();
    finer.sort_unstable_by_key(|bin: &Octant<D>| (bin.level, bin.key()));
    finer.dedup();
    finer.insert(0, here);
    finer
}

/// See [`own_bins`]; `inner` gives [`inner_bins`] of each leaf.
fn potential_bins<'a, const D: usize>(
    tree: &KnownTree<D>,
    leaf: usize,
    inner: impl Fn(usize) -> &'a [Octant<D>],
) -> Vec<Octant<D>> {
    let mut bins = inner(leaf).to_vec();
    let Some(reach) = Reach::of(tree, leaf) else { return bins };
    let mut outer = Vec::new();
    for other in leaves_around(tree, leaf) {
        if other != leaf && reach.region.overlaps(&tree.leaves()[other]) {
            outer.extend(inner(other).iter().copied().filter(|bin| reach.includes(bin)));
        }
    }
    outer.sort_unstable_by_key(|bin: &Octant<D>| (bin.level, bin.key()));
    outer.dedup();
    bins.extend(outer);
    bins
}

/// Bins that the particles of each own leaf can scatter to: first those inside it, then those of other leaves
/// that parts of its boxes can reach, by level and curve position.
pub fn own_bins<const D: usize>(tree: &KnownTree<D>) -> Vec<Vec<Octant<D>>> {
    let all = (0..tree.leaves().len()).into_par_iter().with_min_len(16);
    let inner: Vec<Vec<Octant<D>>> = all.map(|leaf| inner_bins(tree, leaf)).collect();
    let own = tree.own_leaves().into_par_iter().with_min_len(16);
    own.map(|leaf| potential_bins(tree, leaf, |other| &inner[other])).collect()
}

/// Known leaves in the octants of the leaf's size around it, itself included, as far as boxes can reach;
/// along the curve.
pub fn leaves_around<const D: usize>(tree: &KnownTree<D>, leaf: usize) -> Vec<usize> {
    let here = tree.leaves()[leaf];
    let mut around = Vec::new();
    for beside in box_offsets::<D>(tree.reach_in_leaves()).filter_map(|offset| shifted(here.coord, offset)) {
        match tree.cover(here.level, beside) {
            Cover::Outside => {}
            Cover::Leaf(other) => around.push(other),
            Cover::Finer(_) | Cover::Unknown => around.extend(tree.leaves_within(here.level, beside)),
        }
    }
    around.sort_unstable();
    around.dedup();
    around
}

/// Known finer leaves in the same-size neighbours of an octant.
fn finer_neighbours<const D: usize>(tree: &KnownTree<D>, here: Octant<D>) -> impl Iterator<Item = Octant<D>> {
    // Most leaves have none.
    (0..if tree.is_beside_finer(here.level, here.coord) { offset_count(D) } else { 0 })
        .filter_map(move |index| shifted(here.coord, offset::<D>(index)))
        .filter(move |&beside| beside != here.coord && tree.contains(here.level, beside))
        // Most neighbours are leaves of this size or larger, which is found quickly.
        .filter(move |&beside| !matches!(tree.cover(here.level, beside), Cover::Leaf(_)))
        .flat_map(move |beside| tree.leaves_within(here.level, beside))
        .map(move |other| tree.leaves()[other])
        .filter(move |other| other.level > here.level)
}

/// The blocks of `other`'s level that lie in `leaf` and touch `other`.
fn blocks_beside<const D: usize>(leaf: Octant<D>, other: Octant<D>) -> impl Iterator<Item = Octant<D>> {
    (0..offset_count(D)).filter_map(move |index| {
        let block = Octant { level: other.level, coord: shifted(other.coord, offset::<D>(index))? };
        let up = other.level - leaf.level;
        (block.coord.map(|c| c >> up) == leaf.coord).then_some(block)
    })
}

/// The known leaf that contains the bin of `level` at `coord`, if there is such a bin.
pub fn bin_container<const D: usize>(tree: &KnownTree<D>, level: u8, coord: [u32; D]) -> Option<usize> {
    let Cover::Leaf(leaf) = tree.cover(level, coord) else { return None };
    if tree.leaves()[leaf].level == level {
        return Some(leaf);
    }
    let touches_leaf_of_level = (0..offset_count(D)).any(|index| {
        shifted(coord, offset::<D>(index)).is_some_and(|beside| match tree.cover(level, beside) {
            Cover::Leaf(other) => tree.leaves()[other].level == level,
            _ => false,
        })
    });
    touches_leaf_of_level.then_some(leaf)
}

/// Known leaves whose particles can scatter to the bin of `level` at `coord`, along the curve.
pub fn bin_sources<const D: usize>(tree: &KnownTree<D>, level: u8, coord: [u32; D]) -> Vec<usize> {
    let Some(container) = bin_container(tree, level, coord) else { return Vec::new() };
    let bin = Octant { level, coord };
    let mut sources = SourceSearch::of(tree, bin).near;
    sources.sort_unstable();
    sources.dedup();
    sources.retain(|&leaf| leaf == container || Reach::around(tree, leaf).includes(&bin));
    sources
}

/// An open box in units of an eighth of the finest lattice.
#[derive(Clone, Copy)]
struct Extent<const D: usize> {
    lower: [i64; D],
    upper: [i64; D],
}

/// Bits of an eighth of the finest lattice.
const EIGHTH: u8 = 3;

impl<const D: usize> Extent<D> {
    /// The box of an octant, grown by `half_cells` half cells of `level`.
    fn grown(octant: &Octant<D>, half_cells: u32, level: u8) -> Self {
        let shift = MAX_LEVEL - octant.level + EIGHTH;
        let growth = i64::from(half_cells) << (MAX_LEVEL - level);
        Self {
            lower: octant.coord.map(|c| (i64::from(c) << shift) - growth),
            upper: octant.coord.map(|c| (i64::from(c + 1) << shift) + growth),
        }
    }

    fn overlaps(&self, octant: &Octant<D>) -> bool {
        let shift = MAX_LEVEL - octant.level + EIGHTH;
        (0..D).all(|axis| {
            let lower = i64::from(octant.coord[axis]) << shift;
            lower < self.upper[axis] && lower + (1i64 << shift) > self.lower[axis]
        })
    }

    /// The share of this box in an octant, on the finest lattice, without the octant's surface.
    fn within(&self, octant: &Octant<D>) -> Region<D> {
        let inner = interior(octant);
        Region {
            lo: std::array::from_fn(|a| (self.lower[a].max(0) >> EIGHTH).max(i64::from(inner.lo[a])) as u32),
            hi: std::array::from_fn(|a| {
                ((self.upper[a] + (1 << EIGHTH) - 1) >> EIGHTH).min(i64::from(inner.hi[a])) as u32
            }),
        }
    }
}

/// Half width of the widest boxes that may be transferred in parts, in half cells of their leaf.
fn half_cells<const D: usize>(tree: &KnownTree<D>) -> u32 {
    (2 * tree.reach()).max(1)
}

/// Region outside a leaf in which parts of its particles' boxes can lie.
///
/// A box at most one own cell wide is cut into parts only if it overlaps a finer leaf; its parts then lie
/// within half a cell of its leaf and within a cell of the finer leaf. If boxes wider than a cell occur
/// anywhere, every leaf may have them, up to [`KnownTree::reach`] cells.
struct Reach<'a, const D: usize> {
    tree: &'a KnownTree<D>,
    leaf: Octant<D>,
    region: Extent<D>,
    any_box: bool,
    /// Finer leaves in the region; found at the first use.
    finer: OnceCell<Vec<Octant<D>>>,
}

impl<'a, const D: usize> Reach<'a, D> {
    /// `None` if all boxes of the leaf are transferred whole.
    fn of(tree: &'a KnownTree<D>, leaf: usize) -> Option<Self> {
        let reach = Self::around(tree, leaf);
        (reach.any_box || !reach.finer().is_empty()).then_some(reach)
    }

    fn finer(&self) -> &[Octant<D>] {
        self.finer.get_or_init(|| {
            let around = finer_neighbours(self.tree, self.leaf);
            around.filter(|finer| self.region.overlaps(finer)).collect()
        })
    }

    /// As [`Reach::of`], but not empty for leaves whose boxes are transferred whole.
    fn around(tree: &'a KnownTree<D>, leaf: usize) -> Self {
        let leaf = tree.leaves()[leaf];
        let region = Extent::grown(&leaf, half_cells(tree), leaf.level);
        Self { tree, leaf, region, any_box: tree.reach() > 0, finer: OnceCell::new() }
    }

    /// Whether a part can lie in the bin. Decided from leaves at most one block away from the bin, which
    /// every rank knows that needs the bin's sums. Beyond two levels a cell of the leaf is wider than a block
    /// of the bin; since the bin lies beside a leaf of its level, there is then a finer leaf near enough
    /// anyway.
    fn includes(&self, bin: &Octant<D>) -> bool {
        if !self.region.overlaps(bin) {
            return false;
        }
        if self.any_box || bin.level > self.leaf.level + 2 {
            return true;
        }
        let near_bin = Extent::grown(bin, 2, self.leaf.level);
        self.finer().iter().any(|finer| near_bin.overlaps(finer))
    }
}

/// Leaves near enough to a bin that their boxes may reach it.
pub struct SourceSearch<'a, const D: usize> {
    tree: &'a KnownTree<D>,
    bin: Octant<D>,
    half_cells: u32,
    /// The known ones; some may appear twice.
    pub near: Vec<usize>,
    /// Regions in which there may be others.
    pub missing: Vec<Region<D>>,
}

impl<'a, const D: usize> SourceSearch<'a, D> {
    /// Descends the tree near the bin, from the coarsest octants that may be leaves with such boxes.
    pub fn of(tree: &'a KnownTree<D>, bin: Octant<D>) -> Self {
        let mut search =
            Self { tree, bin, half_cells: half_cells(tree), near: Vec::new(), missing: Vec::new() };
        let start = bin.ancestor(tree.coarsest_reaching(bin.level));
        for offset in box_offsets::<D>(tree.reach_in_leaves()) {
            if let Some(coord) = shifted(start.coord, offset) {
                search.visit(Octant { level: start.level, coord });
            }
        }
        search
    }

    fn visit(&mut self, octant: Octant<D>) {
        let reach = Extent::grown(&octant, self.half_cells, octant.level);
        if !self.tree.contains(octant.level, octant.coord) || !reach.overlaps(&self.bin) {
            return;
        }
        let is_finer = match self.tree.locate(octant.key()) {
            Some(leaf) if self.tree.leaves()[leaf].level <= octant.level => {
                self.near.push(leaf);
                false
            }
            Some(_) => true,
            None => {
                self.ask(&octant);
                self.tree.is_finer_within(octant.level, octant.coord)
            }
        };
        if is_finer && octant.level < MAX_LEVEL {
            (0..Octant::<D>::CHILDREN).for_each(|child| self.visit(octant.child(child)));
        }
    }

    /// Adds the leaves of the octant that may reach the bin, or requests them, and for the leaf at its lower
    /// corner, which shows whether the octant is a leaf. The rest of a large octant is not requested.
    fn ask(&mut self, octant: &Octant<D>) {
        let lo = octant.lower();
        self.missing.push(Region { lo, hi: lo.map(|x| x + 1) });
        self.missing.push(Extent::grown(&self.bin, self.half_cells, octant.level).within(octant));
    }
}

/// The region of an octant without its surface, so that only leaves that overlap it answer.
pub fn interior<const D: usize>(octant: &Octant<D>) -> Region<D> {
    let shift = MAX_LEVEL - octant.level;
    let lo = octant.coord.map(|c| c << shift);
    // An octant of the finest level has no interior; its whole box then asks for neighbours as well.
    if shift == 0 {
        return Region { lo, hi: octant.coord.map(|c| c + 1) };
    }
    Region { lo: lo.map(|c| c + 1), hi: octant.coord.map(|c| ((c + 1) << shift) - 1) }
}
