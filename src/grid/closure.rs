//! Which nodes a rank needs: the closure of the nodes its particles touch over constraints.
//!
//! Two sets of nodes per block:
//! - **value** nodes: a rank needs their velocity, because its bins touch them or because they are
//!   constraint parents (on any level) of nodes that it needs;
//! - **sum** nodes: a rank needs their complete sum over all bins, because they are real value nodes, or
//!   constrained nodes that restrict into such a node.
//!
//! A node that is needed at a seam is summed and updated by every rank that needs it, from the same
//! contributions in the same order; one exchange of arenas per step is then enough.
use std::collections::{BTreeMap, HashMap};

use partition::{MAX_LEVEL, Octant};

use super::constraint::{self, children_mask, parents_of};
use super::known::{Cover, KnownTree};
use super::mask::{arena_overlap, bits, lower_face, offset, offset_count, opposite, product, shifted};

/// Node sets of one block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeSets {
    /// Nodes whose velocity is needed.
    pub value: u64,
    /// Nodes whose complete sum is needed.
    pub sum: u64,
    /// Nodes that touch a coarser leaf: no degrees of freedom on this level.
    pub constrained: u64,
}

/// The blocks that a rank needs, by level and coordinate.
pub type NeededBlocks<const D: usize> = BTreeMap<(u8, [u32; D]), NodeSets>;

/// Result of one attempt to close the node sets over the known part of the tree.
pub struct Closure<const D: usize> {
    /// The needed blocks.
    pub blocks: NeededBlocks<D>,
    /// Octants about which the rank must learn before the sets can be trusted; empty when done.
    pub missing: Vec<Octant<D>>,
}

/// Bins of known leaf `leaf` inside itself: its own block first, then every block inside it, on the level of
/// a finer leaf that it touches, by level and curve position.
pub fn inner_bins<const D: usize>(tree: &KnownTree<D>, leaf: usize) -> Vec<Octant<D>> {
    let here = tree.leaves()[leaf];
    let mut finer = Vec::new();
    for beside in finer_neighbours(tree, here) {
        for other in tree.leaves_within(here.level, beside) {
            finer.extend(blocks_beside(here, tree.leaves()[other]));
        }
    }
    finer.sort_unstable_by_key(|bin: &Octant<D>| (bin.level, bin.key()));
    finer.dedup();
    finer.insert(0, here);
    finer
}

/// Bins that particles of known leaf `leaf` can scatter to: first those inside it, then those of other leaves
/// that parts of its boxes can reach, by level and curve position.
pub fn potential_bins<const D: usize>(tree: &KnownTree<D>, leaf: usize) -> Vec<Octant<D>> {
    let mut bins = inner_bins(tree, leaf);
    let Some(reach) = Reach::of(tree, leaf) else { return bins };
    let here = tree.leaves()[leaf];
    let mut outer = Vec::new();
    for index in 0..offset_count(D) {
        let Some(beside) = shifted(here.coord, offset::<D>(index)) else { continue };
        let others = match tree.cover(here.level, beside) {
            Cover::Leaf(other) if other != leaf => other..other + 1,
            Cover::Finer(_) => tree.leaves_within(here.level, beside),
            _ => continue,
        };
        for other in others.filter(|&other| reach.region.overlaps(&tree.leaves()[other])) {
            outer.extend(inner_bins(tree, other).into_iter().filter(|bin| reach.includes(tree, bin)));
        }
    }
    outer.sort_unstable_by_key(|bin: &Octant<D>| (bin.level, bin.key()));
    outer.dedup();
    bins.extend(outer);
    bins
}

/// The same-size neighbours of an octant that are subdivided.
fn finer_neighbours<const D: usize>(tree: &KnownTree<D>, here: Octant<D>) -> impl Iterator<Item = [u32; D]> {
    (0..offset_count(D)).filter_map(move |index| shifted(here.coord, offset::<D>(index))).filter(
        move |&beside| beside != here.coord && matches!(tree.cover(here.level, beside), Cover::Finer(_)),
    )
}

/// The blocks of `other`'s level that lie in `leaf` and touch `other`.
fn blocks_beside<const D: usize>(leaf: Octant<D>, other: Octant<D>) -> impl Iterator<Item = Octant<D>> {
    (0..offset_count(D)).filter_map(move |index| {
        let block = Octant { level: other.level, coord: shifted(other.coord, offset::<D>(index))? };
        let up = other.level - leaf.level;
        (block.coord.map(|c| c >> up) == leaf.coord).then_some(block)
    })
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
}

/// Where parts of the boxes of a leaf's particles can lie outside the leaf.
///
/// A box at most one own cell wide is cut into parts only if it overlaps a finer leaf; its parts then lie
/// within half a cell of its leaf and within a cell of the finer leaf. If boxes wider than a cell occur anywhere,
/// every leaf may have them, up to [`KnownTree::reach`] cells.
struct Reach<const D: usize> {
    leaf: Octant<D>,
    region: Extent<D>,
    any_box: bool,
}

impl<const D: usize> Reach<D> {
    /// `None` if all boxes of the leaf are transferred whole.
    fn of(tree: &KnownTree<D>, leaf: usize) -> Option<Self> {
        let leaf = tree.leaves()[leaf];
        let any_box = tree.reach() > 0;
        if !any_box && finer_neighbours(tree, leaf).next().is_none() {
            return None;
        }
        let half_cells = if any_box { 2 * tree.reach() } else { 1 };
        Some(Self { leaf, region: Extent::grown(&leaf, half_cells, leaf.level), any_box })
    }

    /// Whether a part can lie in the bin. Decided from leaves near both, so that every rank that needs the
    /// bin's sums decides alike.
    fn includes(&self, tree: &KnownTree<D>, bin: &Octant<D>) -> bool {
        if !self.region.overlaps(bin) {
            return false;
        }
        let near_bin = Extent::grown(bin, 2, self.leaf.level);
        self.any_box
            || finer_neighbours(tree, self.leaf).any(|beside| {
                tree.leaves_within(self.leaf.level, beside).any(|finer| {
                    let finer = &tree.leaves()[finer];
                    self.region.overlaps(finer) && near_bin.overlaps(finer)
                })
            })
    }
}

/// The known leaf that contains the bin of `level` at `coord`, if there is such a bin.
fn bin_container<const D: usize>(tree: &KnownTree<D>, level: u8, coord: [u32; D]) -> Option<usize> {
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
    let mut sources = vec![container];
    let mut consider = |leaf: usize| {
        if leaf != container && Reach::of(tree, leaf).is_some_and(|reach| reach.includes(tree, &bin)) {
            sources.push(leaf);
        }
    };
    for index in 0..offset_count(D) {
        let Some(beside) = shifted(coord, offset::<D>(index)) else { continue };
        match tree.cover(level, beside) {
            Cover::Leaf(leaf) => consider(leaf),
            Cover::Finer(_) => tree.leaves_within(level, beside).for_each(&mut consider),
            _ => {}
        }
    }
    // Leaves that are coarser than the bin reach further than to the blocks beside it.
    for coarse in tree.coarsest_reaching(level)..level {
        let up = level - coarse;
        for index in 0..offset_count(D) {
            if let Some(beside) = shifted(coord.map(|c| c >> up), offset::<D>(index))
                && let Cover::Leaf(leaf) = tree.cover(coarse, beside)
                && tree.leaves()[leaf].level == coarse
            {
                consider(leaf);
            }
        }
    }
    sources.sort_unstable();
    sources.dedup();
    sources
}

/// Nodes of the block of `level` at `coord` that lie in the domain; blocks one past the upper faces hold
/// the nodes on these faces.
pub fn nodes_in_domain<const D: usize>(tree: &KnownTree<D>, level: u8, coord: [u32; D]) -> u64 {
    product::<D>(std::array::from_fn(|axis| match coord[axis].cmp(&(tree.brick().roots[axis] << level)) {
        std::cmp::Ordering::Less => 0b1111,
        std::cmp::Ordering::Equal => 0b0001,
        std::cmp::Ordering::Greater => 0,
    }))
}

/// Constrained nodes of a block: those that touch a leaf coarser than `level`. An unknown neighbourhood
/// counts as not coarser; [`Closure::compute`] reports it as missing.
pub fn constrained_nodes<const D: usize>(tree: &KnownTree<D>, level: u8, coord: [u32; D]) -> u64 {
    let mut mask = 0;
    for corner in 0..1usize << D {
        let below: [bool; D] = std::array::from_fn(|axis| corner >> axis & 1 == 1);
        let Some(octant) = shifted(coord, below.map(|b| -i32::from(b))) else { continue };
        if let Cover::Leaf(leaf) = tree.cover(level, octant)
            && tree.leaves()[leaf].level < level
        {
            mask |= lower_face::<D>(below);
        }
    }
    mask & nodes_in_domain(tree, level, coord)
}

/// Working state of one closure.
struct Builder<'a, const D: usize> {
    tree: &'a KnownTree<D>,
    overlaps: Vec<u64>,
    levels: Vec<HashMap<[u32; D], NodeSets>>,
    received: HashMap<(u8, [u32; D]), u64>,
}

impl<const D: usize> Closure<D> {
    /// Not collective. Closes the node sets over the known tree; see [`Closure::missing`].
    pub fn compute(tree: &KnownTree<D>) -> Self {
        let deepest = tree.leaves().iter().map(|leaf| leaf.level).max().unwrap_or(0);
        let mut builder = Builder {
            tree,
            overlaps: (0..offset_count(D)).map(|index| arena_overlap::<D>(offset(index))).collect(),
            levels: vec![HashMap::new(); deepest as usize + 1],
            received: HashMap::new(),
        };
        builder.touch_own_bins();
        builder.add_parents();
        builder.add_children();
        let missing = builder.missing();
        let blocks = builder
            .levels
            .iter()
            .enumerate()
            .flat_map(|(level, blocks)| {
                blocks.iter().map(move |(&coord, &sets)| ((level as u8, coord), sets))
            })
            .collect();
        Self { blocks, missing }
    }
}

impl<const D: usize> Builder<'_, D> {
    fn sets(&mut self, level: u8, coord: [u32; D]) -> &mut NodeSets {
        let tree = self.tree;
        self.levels[level as usize].entry(coord).or_insert_with(|| NodeSets {
            constrained: constrained_nodes(tree, level, coord),
            ..NodeSets::default()
        })
    }

    /// Value nodes: all nodes in the arenas of the own leaves' bins.
    fn touch_own_bins(&mut self) {
        let first = self.tree.first_own();
        for leaf in (first..).take_while(|&leaf| self.tree.local(leaf).is_some()) {
            for bin in potential_bins(self.tree, leaf) {
                for index in 0..offset_count(D) {
                    let Some(coord) = shifted(bin.coord, offset::<D>(index)) else { continue };
                    let inside = self.overlaps[index] & nodes_in_domain(self.tree, bin.level, coord);
                    if inside != 0 {
                        self.sets(bin.level, coord).value |= inside;
                    }
                }
            }
        }
    }

    /// Value nodes: parents of constrained value nodes, finest level first.
    fn add_parents(&mut self) {
        for level in (1..self.levels.len()).rev() {
            let blocks: Vec<([u32; D], u64)> = self.levels[level]
                .iter()
                .map(|(&coord, sets)| (coord, sets.value & sets.constrained))
                .filter(|&(_, mask)| mask != 0)
                .collect();
            for (coord, mask) in blocks {
                for bit in bits(mask) {
                    for parent in parents_of::<D>(constraint::node_coord(coord, bit)) {
                        let (block, bit) = constraint::block_and_bit(parent.node);
                        self.sets(level as u8 - 1, block).value |= 1 << bit;
                    }
                }
            }
        }
    }

    /// Sum nodes: real value nodes, and coarsest level first the constrained nodes that restrict into them.
    fn add_children(&mut self) {
        for level in 0..self.levels.len() as u8 {
            let blocks: Vec<([u32; D], u64)> = self.levels[level as usize]
                .iter_mut()
                .map(|(&coord, sets)| {
                    sets.sum |= sets.value & !sets.constrained;
                    (coord, sets.sum)
                })
                .filter(|&(_, sum)| sum != 0)
                .collect();
            for (coord, sum) in blocks {
                if !self.is_finer_around(level, coord) {
                    continue;
                }
                for index in 0..offset_count(D) {
                    let Some(fine) = shifted(coord.map(|c| 2 * c), offset::<D>(index)) else { continue };
                    let children = children_mask::<D>(coord, sum, fine)
                        & constrained_nodes(self.tree, level + 1, fine)
                        & self.receives(level + 1, fine);
                    if children != 0 {
                        self.sets(level + 1, fine).sum |= children;
                    }
                }
            }
        }
    }

    /// True when an octant in the neighbourhood `coord + {-1, 0, 1}^D` is subdivided.
    fn is_finer_around(&self, level: u8, coord: [u32; D]) -> bool {
        (0..offset_count(D)).any(|index| {
            shifted(coord, offset::<D>(index))
                .is_some_and(|beside| matches!(self.tree.cover(level, beside), Cover::Finer(_)))
        })
    }

    /// Nodes of a block that can receive something: from bins of their level or by restriction.
    fn receives(&mut self, level: u8, coord: [u32; D]) -> u64 {
        if let Some(&mask) = self.received.get(&(level, coord)) {
            return mask;
        }
        let mut mask = 0;
        for index in 0..offset_count(D) {
            if let Some(bin) = shifted(coord, offset::<D>(index))
                && bin_container(self.tree, level, bin).is_some()
            {
                mask |= self.overlaps[opposite(D, index)];
            }
        }
        if self.is_finer_around(level, coord) {
            for index in 0..offset_count(D) {
                let Some(fine) = shifted(coord.map(|c| 2 * c), offset::<D>(index)) else { continue };
                let from = constrained_nodes(self.tree, level + 1, fine) & self.receives(level + 1, fine);
                for bit in bits(from) {
                    for parent in parents_of::<D>(constraint::node_coord(fine, bit)) {
                        let (block, bit) = constraint::block_and_bit(parent.node);
                        if block == coord {
                            mask |= 1 << bit;
                        }
                    }
                }
            }
        }
        mask &= nodes_in_domain(self.tree, level, coord);
        self.received.insert((level, coord), mask);
        mask
    }

    /// Octants within two blocks of a needed block that are not known.
    ///
    /// A sum node receives from bins up to one block away, and whether such a bin exists depends on the
    /// leaves one block further; `coord ± 2` lies within one octant of the parent's neighbourhood.
    fn missing(&self) -> Vec<Octant<D>> {
        let mut checked: HashMap<(u8, [u32; D]), bool> = HashMap::new();
        let mut missing = Vec::new();
        for (level, blocks) in self.levels.iter().enumerate() {
            let (level, reach) = match level {
                0 => (0, 2i32),
                _ => (level as u8 - 1, 1),
            };
            let shift = u32::from(level > 0 || reach == 1);
            for &coord in blocks.keys() {
                let centre = coord.map(|c| c >> shift);
                for offset in box_offsets::<D>(reach) {
                    let Some(octant) = shifted(centre, offset) else { continue };
                    let known =
                        *checked.entry((level, octant)).or_insert_with(|| self.tree.is_known(level, octant));
                    if !known {
                        missing.push(Octant { level, coord: octant });
                        checked.insert((level, octant), true);
                    }
                }
            }
        }
        missing.sort_unstable_by_key(|octant| (octant.level, octant.coord));
        missing
    }
}

/// All offsets in `{-reach, …, reach}^D`.
fn box_offsets<const D: usize>(reach: i32) -> impl Iterator<Item = [i32; D]> {
    let edge = (2 * reach + 1) as usize;
    (0..edge.pow(D as u32))
        .map(move |index| std::array::from_fn(|axis| (index / edge.pow(axis as u32) % edge) as i32 - reach))
}
