//! Surroundings of leaves, found once per tree, and the masses of the nodes there.
use partition::comm::Comm;
use partition::{Forest, Octant, Region};
use rayon::prelude::*;

use crate::grid::mask::{arena_overlap, bits, block_nodes, offset, offset_count, product, shifted};
use crate::grid::plan::NO_BLOCK;
use crate::grid::plan::ghost_layer::{Cover, KnownTree};
use crate::grid::{GridPlan, NodeFields};
use crate::particle::Chunk;

/// Share of the greatest node mass nearby below which a node counts as free of material. A full node in a
/// corner of three walls has an eighth.
const NEXT_TO_NOTHING: f64 = 0.1;

/// The surroundings of each own leaf, for one tree and partition.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surroundings {
    /// Revision of the forest that this is for.
    revision: Option<u64>,
    /// Own leaves that touch leaf i: `touching[start[i]..start[i + 1]]`.
    touching: Vec<u32>,
    start: Vec<u32>,
    /// Whether leaves of other ranks may touch the leaf.
    at_seam: Vec<bool>,
    /// Which of the blocks around the leaf's own bin (a bit by offset number) are leaves of its level.
    of_level: Vec<u32>,
}

impl Surroundings {
    /// Not collective. Recomputes everything if the tree or the partition has changed; the plan is that of
    /// the forest.
    pub(crate) fn update<const D: usize>(&mut self, forest: &Forest<D>, plan: &GridPlan<D>) {
        if self.revision == Some(forest.revision()) {
            return;
        }
        debug_assert_eq!(plan.revision, forest.revision());
        let leaves = forest.leaves().par_iter().with_min_len(16);
        let each: Vec<Around> = leaves.map(|leaf| Around::of(forest, &plan.tree, leaf)).collect();
        self.start = vec![0];
        self.touching.clear();
        for around in &each {
            self.touching.extend(&around.touching);
            self.start.push(self.touching.len() as u32);
        }
        self.at_seam = each.iter().map(|around| around.at_seam).collect();
        self.of_level = each.iter().map(|around| around.of_level).collect();
        self.revision = Some(forest.revision());
    }

    /// Own leaves that touch an own leaf, itself included.
    pub(crate) fn touching(&self, leaf: usize) -> &[u32] {
        &self.touching[self.start[leaf] as usize..self.start[leaf + 1] as usize]
    }

    /// Collective. Whether each own leaf touches one without particles.
    pub(crate) fn beside_empty<const D: usize>(
        &self,
        forest: &Forest<D>,
        comm: &Comm,
        chunks: &[Chunk<D>],
    ) -> Vec<bool> {
        let mut beside = vec![false; chunks.len()];
        let mut requests: Vec<(Region<D>, u32)> = Vec::new();
        for leaf in (0..chunks.len()).filter(|&leaf| chunks[leaf].is_empty()) {
            self.touching(leaf).iter().for_each(|&other| beside[other as usize] = true);
            if self.at_seam[leaf] {
                requests.push((Region::of(&forest.leaves()[leaf]), 0));
            }
        }
        if comm.size() > 1 {
            for (region, _) in forest.to_owners(comm, &requests) {
                forest.own_leaves_in(&region, &mut |leaf| beside[leaf] = true);
            }
        }
        beside
    }

    /// Whether any real node in the arena of a leaf's own bin is free of material. Only nodes on the leaf and
    /// on leaves of its level count: the lattice goes on over finer leaves, but material there has its mass
    /// on finer nodes.
    pub(crate) fn is_exposed<const D: usize>(
        &self,
        leaf: usize,
        plan: &GridPlan<D>,
        fields: &NodeFields<D>,
        masses: &[MassRange],
    ) -> bool {
        let around = &plan.bins[plan.leaf_start[leaf] as usize].around;
        let of_level = self.of_level[leaf];
        let blocks = || {
            let numbers = around.iter().enumerate().take(offset_count(D));
            numbers.filter(|&(_, &number)| number != NO_BLOCK)
        };
        let range_of = |index: usize, number: u32, mask: u64| {
            let block = &plan.blocks[number as usize];
            let on_leaf = if of_level >> index & 1 == 1 { u64::MAX } else { on_leaf::<D>(index) };
            MassRange::of::<D>(fields, number, block.real_nodes() & mask & on_leaf)
        };
        // Most leaves have as much mass on all nodes of all blocks around, the nodes beyond the arena
        // included.
        let wide =
            blocks().fold(MassRange::NONE, |range, (index, &number)| match of_level >> index & 1 == 1 {
                true => range.with(masses[number as usize]),
                false => range.with(range_of(index, number, arena_overlap::<D>(offset(index)))),
            });
        if !wide.has_gap() {
            return false;
        }
        let mut range = MassRange::NONE;
        blocks().any(|(index, &number)| {
            range = range.with(range_of(index, number, arena_overlap::<D>(offset(index))));
            range.has_gap()
        })
    }
}

/// Nodes of the block at an offset that lie on the leaf itself: on its upper faces, where the block begins.
fn on_leaf<const D: usize>(index: usize) -> u64 {
    product::<D>(offset::<D>(index).map(|beside| match beside {
        0 => 0b1111,
        1 => 0b0001,
        _ => 0,
    }))
}

/// Entry of one leaf in [`Surroundings`].
struct Around {
    touching: Vec<u32>,
    at_seam: bool,
    of_level: u32,
}

impl Around {
    fn of<const D: usize>(forest: &Forest<D>, tree: &KnownTree<D>, leaf: &Octant<D>) -> Self {
        let mut around = Self { touching: Vec::with_capacity(offset_count(D)), at_seam: false, of_level: 0 };
        let mut any_finer = false;
        for index in 0..offset_count(D) {
            let Some(coord) = shifted(leaf.coord, offset::<D>(index)) else { continue };
            match tree.cover(leaf.level, coord) {
                Cover::Outside => {}
                Cover::Leaf(other) => {
                    around.of_level |= u32::from(tree.leaves()[other].level == leaf.level) << index;
                    match tree.local(other) {
                        Some(own) => around.touching.push(own as u32),
                        None => around.at_seam = true,
                    }
                }
                Cover::Finer(_) | Cover::Unknown => {
                    any_finer = true;
                    around.at_seam |= !tree.is_own(&Octant { level: leaf.level, coord });
                }
            }
        }
        if any_finer {
            // Of finer leaves only those that touch count.
            around.touching.clear();
            forest.own_leaves_in(&Region::of(leaf), &mut |other| around.touching.push(other as u32));
        }
        around.touching.sort_unstable();
        around.touching.dedup();
        around
    }
}

/// Least and greatest mass of some nodes, kg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MassRange {
    least: f64,
    greatest: f64,
}

impl MassRange {
    const NONE: Self = Self { least: f64::INFINITY, greatest: 0.0 };

    fn with(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), greatest: self.greatest.max(other.greatest) }
    }

    /// Whether some of the nodes are free of material. Further nodes cannot make it false.
    fn has_gap(self) -> bool {
        self.least < NEXT_TO_NOTHING * self.greatest
    }

    fn of<const D: usize>(fields: &NodeFields<D>, block: u32, nodes: u64) -> Self {
        if !fields.may_hold(block as usize) {
            // Reading rows that were never written would make the system allocate pages for them.
            return if nodes == 0 { Self::NONE } else { Self { least: 0.0, greatest: 0.0 } };
        }
        let rows = &fields.rows[block as usize * block_nodes(D)..][..block_nodes(D)];
        bits(nodes).fold(Self::NONE, |range, bit| {
            let mass = rows[bit as usize].0[3];
            range.with(Self { least: mass, greatest: mass })
        })
    }

    /// Ranges of all real nodes of each block.
    pub(crate) fn of_blocks<const D: usize>(plan: &GridPlan<D>, fields: &NodeFields<D>) -> Vec<Self> {
        let blocks = plan.blocks.par_iter().enumerate().with_min_len(64);
        blocks.map(|(number, block)| Self::of::<D>(fields, number as u32, block.real_nodes())).collect()
    }
}
