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
use partition::{Octant, Region};
use rustc_hash::{FxHashMap, FxHashSet};

use super::bin_reach::{SourceSearch, bin_container, interior, own_bins};
use super::ghost_layer::{Cover, KnownTree};
use crate::grid::constraints::parent_table::{
    ParentTable, children, coarser_at, parents, parity, place_beside,
};
use crate::grid::mask::{
    arena_overlap, box_offsets, lower_face, offset, offset_count, opposite, product, shifted,
};

/// Node sets of one block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeSets {
    /// Nodes whose velocity is needed.
    pub needs_velocity: u64,
    /// Nodes whose complete sum is needed.
    pub needs_sum: u64,
    /// Nodes that touch a coarser leaf: no degrees of freedom on this level.
    pub constrained: u64,
}

/// Result of one attempt to close the node sets over the known part of the tree.
pub struct Closure<const D: usize> {
    /// The needed blocks, in no particular order.
    pub blocks: Vec<(Octant<D>, NodeSets)>,
    /// Bins of each own leaf.
    pub bins: Vec<Vec<Octant<D>>>,
    /// Where the rank must learn the leaves before the sets can be trusted; empty when done.
    pub missing: Vec<Region<D>>,
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
    if level == 0 {
        return 0;
    }
    // Octants around the lower corner that have the same parent are covered by the same coarser leaf.
    let even = parity(coord) ^ ((1 << D) - 1);
    let mut mask = 0;
    for corner in (0..1usize << D).filter(|corner| corner & !even == 0) {
        let below: [bool; D] = std::array::from_fn(|axis| corner >> axis & 1 == 1);
        let Some(octant) = shifted(coord, below.map(|b| -i32::from(b))) else { continue };
        if let Cover::Leaf(_) = tree.cover(level - 1, octant.map(|c| c >> 1)) {
            mask |= lower_face::<D>(below);
        }
    }
    mask & nodes_in_domain(tree, level, coord)
}

/// Working state of one closure.
struct Builder<'a, const D: usize> {
    tree: &'a KnownTree<D>,
    overlaps: Vec<u64>,
    parents: &'static ParentTable,
    containers: FxHashMap<(u8, [u32; D]), bool>,
    levels: Vec<FxHashMap<[u32; D], NodeSets>>,
    restricted: FxHashMap<(u8, [u32; D]), u64>,
}

impl<const D: usize> Closure<D> {
    /// Not collective. Closes the node sets over the known tree; see [`Closure::missing`].
    pub fn compute(tree: &KnownTree<D>) -> Self {
        let mut builder = Builder {
            tree,
            overlaps: (0..offset_count(D)).map(|index| arena_overlap::<D>(offset(index))).collect(),
            parents: ParentTable::of::<D>(),
            containers: FxHashMap::default(),
            levels: vec![FxHashMap::default(); usize::from(tree.deepest()) + 1],
            restricted: FxHashMap::default(),
        };
        let bins = own_bins(tree);
        builder.touch_own_bins(&bins);
        let parents = builder.add_parents();
        builder.add_halo(bins.iter().flatten().copied().chain(parents));
        builder.add_children();
        let missing = builder.missing();
        let blocks = builder
            .levels
            .iter()
            .enumerate()
            .flat_map(|(level, blocks)| {
                blocks.iter().map(move |(&coord, &sets)| (Octant { level: level as u8, coord }, sets))
            })
            .collect();
        Self { blocks, bins, missing }
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
    fn touch_own_bins(&mut self, bins: &[Vec<Octant<D>>]) {
        let mut touched: FxHashSet<Octant<D>> = FxHashSet::default();
        for bins in bins {
            // Most bins beside level jumps are those of several leaves.
            for bin in bins.iter().filter(|bin| touched.insert(**bin)) {
                for index in 0..offset_count(D) {
                    let Some(coord) = shifted(bin.coord, offset::<D>(index)) else { continue };
                    let inside = self.overlaps[index] & nodes_in_domain(self.tree, bin.level, coord);
                    if inside != 0 {
                        self.sets(bin.level, coord).needs_velocity |= inside;
                    }
                }
            }
        }
    }

    /// Value nodes: the real nodes of blocks around some blocks, within the halo.
    fn add_halo(&mut self, blocks: impl Iterator<Item = Octant<D>>) {
        if self.tree.halo() == 0 || self.tree.ghost_len() == 0 && self.tree.is_whole() {
            return;
        }
        let mut added: FxHashSet<Octant<D>> = FxHashSet::default();
        for Octant { level, coord } in blocks {
            for offset in box_offsets::<D>(self.tree.halo()) {
                let Some(coord) = shifted(coord, offset) else { continue };
                if !added.insert(Octant { level, coord }) {
                    continue;
                }
                let real =
                    nodes_in_domain(self.tree, level, coord) & !constrained_nodes(self.tree, level, coord);
                if real != 0 {
                    self.sets(level, coord).needs_velocity |= real;
                }
            }
        }
    }

    /// Value nodes: parents of constrained value nodes, finest level first. Returns their blocks.
    fn add_parents(&mut self) -> Vec<Octant<D>> {
        let mut all = Vec::new();
        for level in (1..self.levels.len()).rev() {
            let blocks: Vec<([u32; D], u64)> = self.levels[level]
                .iter()
                .map(|(&coord, sets)| (coord, sets.needs_velocity & sets.constrained))
                .filter(|&(_, mask)| mask != 0)
                .collect();
            for (coord, mask) in blocks {
                for corner in 0..1u8 << D {
                    if self.parents.having(parity(coord), corner) & mask == 0 {
                        continue;
                    }
                    let coarse = coarser_at(coord, corner);
                    let parents = parents::<D>(place_beside(coord, coarse), mask);
                    self.sets(level as u8 - 1, coarse).needs_velocity |= parents;
                    all.push(Octant { level: level as u8 - 1, coord: coarse });
                }
            }
        }
        all
    }

    /// Sum nodes: real value nodes, and coarsest level first the constrained nodes that restrict into them.
    fn add_children(&mut self) {
        for level in 0..self.levels.len() as u8 {
            let blocks: Vec<([u32; D], u64)> = self.levels[level as usize]
                .iter_mut()
                .map(|(&coord, sets)| {
                    sets.needs_sum |= sets.needs_velocity & !sets.constrained;
                    (coord, sets.needs_sum)
                })
                .filter(|&(_, sum)| sum != 0)
                .collect();
            for (coord, sum) in blocks {
                if !self.tree.is_beside_finer(level, coord) {
                    continue;
                }
                for index in 0..offset_count(D) {
                    let Some(fine) = shifted(coord.map(|c| 2 * c), offset::<D>(index)) else { continue };
                    let children = children::<D>(index, sum);
                    if children == 0 {
                        continue;
                    }
                    let children = children & self.restricted(level + 1, fine);
                    if children != 0 {
                        self.sets(level + 1, fine).needs_sum |= children;
                    }
                }
            }
        }
    }

    /// Whether there is a bin of `level` at `coord`.
    fn is_bin(&mut self, level: u8, coord: [u32; D]) -> bool {
        let tree = self.tree;
        let is_bin = self.containers.entry((level, coord));
        *is_bin.or_insert_with(|| bin_container(tree, level, coord).is_some())
    }

    /// Constrained nodes of a block with contributions, which restriction adds to their parents.
    fn restricted(&mut self, level: u8, coord: [u32; D]) -> u64 {
        if let Some(&mask) = self.restricted.get(&(level, coord)) {
            return mask;
        }
        let known = self.levels.get(usize::from(level)).and_then(|blocks| blocks.get(&coord));
        let constrained = known.map(|sets| sets.constrained);
        let constrained = constrained.unwrap_or_else(|| constrained_nodes(self.tree, level, coord));
        let mask = if constrained == 0 { 0 } else { constrained & self.receives(level, coord) };
        self.restricted.insert((level, coord), mask);
        mask
    }

    /// Nodes of a block that can receive contributions: from bins of their level or by restriction.
    fn receives(&mut self, level: u8, coord: [u32; D]) -> u64 {
        let mut mask = 0;
        for index in 0..offset_count(D) {
            if let Some(bin) = shifted(coord, offset::<D>(index))
                && self.is_bin(level, bin)
            {
                mask |= self.overlaps[opposite(D, index)];
            }
        }
        if self.tree.is_beside_finer(level, coord) {
            for index in 0..offset_count(D) {
                let Some(fine) = shifted(coord.map(|c| 2 * c), offset::<D>(index)) else { continue };
                mask |= parents::<D>(index, self.restricted(level + 1, fine));
            }
        }
        mask & nodes_in_domain(self.tree, level, coord)
    }

    /// Regions whose leaves this rank needs and does not know.
    fn missing(&self) -> Vec<Region<D>> {
        if self.tree.is_whole() {
            return Vec::new();
        }
        let mut missing: Vec<Region<D>> = self.unknown_octants().iter().map(interior).collect();
        self.look_for_sources(&mut missing);
        missing
    }

    /// Octants within two blocks of a needed block, and within reach of own leaves, that are not known.
    ///
    /// A sum node receives from bins up to one block away, and whether such a bin exists depends on the
    /// leaves one block further; `coord ± 2` lies within one octant of the parent's neighbourhood.
    fn unknown_octants(&self) -> Vec<Octant<D>> {
        let mut checked: FxHashSet<(u8, [u32; D])> = FxHashSet::default();
        let mut unknown = Vec::new();
        let mut check = |level: u8, centre: [u32; D], reach: u32| {
            for offset in box_offsets::<D>(reach) {
                if let Some(coord) = shifted(centre, offset)
                    && checked.insert((level, coord))
                    && !self.tree.is_known(level, coord)
                {
                    unknown.push(Octant { level, coord });
                }
            }
        };
        for (level, blocks) in self.levels.iter().enumerate() {
            for &coord in blocks.keys() {
                match level {
                    0 => check(0, coord, 2),
                    _ => check(level as u8 - 1, coord.map(|c| c >> 1), 1),
                }
            }
        }
        let reach = self.tree.reach_in_leaves();
        if reach > 1 {
            for leaf in self.tree.own_leaves() {
                let here = self.tree.leaves()[leaf];
                check(here.level, here.coord, reach);
            }
        }
        unknown.sort_unstable_by_key(|octant| (octant.level, octant.coord));
        unknown
    }

    /// Finds the regions of all leaves that may feed the bins around sum nodes. In graded trees with boxes up
    /// to two cells wide they lie within two blocks of the sum node, where everything is known.
    fn look_for_sources(&self, missing: &mut Vec<Region<D>>) {
        if self.tree.sources_are_near() {
            return;
        }
        let mut looked: FxHashSet<(u8, [u32; D])> = FxHashSet::default();
        for (level, blocks) in self.levels.iter().enumerate() {
            let mut with_sums: Vec<[u32; D]> =
                blocks.iter().filter(|(_, sets)| sets.needs_sum != 0).map(|(&coord, _)| coord).collect();
            with_sums.sort_unstable();
            for coord in with_sums {
                for beside in box_offsets::<D>(1).filter_map(|offset| shifted(coord, offset)) {
                    let level = level as u8;
                    if looked.insert((level, beside)) && bin_container(self.tree, level, beside).is_some() {
                        let bin = Octant { level, coord: beside };
                        missing.extend(SourceSearch::of(self.tree, bin).missing);
                    }
                }
            }
        }
    }
}
