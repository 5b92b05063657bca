//! Sorting the particles of a leaf into its bins.
//!
//! A particle scatters on the finest level that its box overlaps, into the arena of the block of that level
//! that contains its centre. In most leaves that is the leaf's own block for all particles; beside finer
//! leaves each particle's box is held against those leaves.
use rayon::prelude::*;

use super::migrate::leaf_box;
use crate::grid::mask::{offset, offset_count, shifted};
use crate::grid::{Cover, GridPlan};
use crate::particle::chunk::Chunk;

/// A finer leaf that touches a leaf.
#[derive(Clone, Debug)]
struct FinerLeaf<const D: usize> {
    level: u8,
    lower: [f64; D],
    upper: [f64; D],
}

/// One own leaf with finer leaves around it.
#[derive(Clone, Debug)]
struct SortedLeaf<const D: usize> {
    leaf: usize,
    lower: [f64; D],
    upper: [f64; D],
    finer: Vec<FinerLeaf<D>>,
    /// Particles of each bin of the leaf, in canonical order.
    lists: Vec<Vec<u32>>,
}

/// Particle lists of the bins of one rank.
#[derive(Clone, Debug, Default)]
pub struct BinLists<const D: usize> {
    sorted: Vec<SortedLeaf<D>>,
    /// Per own leaf, its place in `sorted`, or `u32::MAX` when all its particles share one bin.
    place: Vec<u32>,
}

/// A box that is wider than a cell of the level on which it has to be transferred.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the box of particle {id} reaches a bin that its leaf does not have")]
pub struct BinMissing {
    /// Identifier of the particle.
    pub id: u64,
}

/// The particles of one bin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Members<'a> {
    /// All particles of the leaf.
    All,
    /// These particles of the leaf, ascending.
    List(&'a [u32]),
}

impl<const D: usize> BinLists<D> {
    /// Not collective. Lists for the bins of a plan.
    pub fn new(plan: &GridPlan<D>) -> Self {
        let mut lists = Self { sorted: Vec::new(), place: Vec::new() };
        for leaf in 0..plan.leaf_start.len() - 1 {
            let bins = plan.leaf_bins(leaf);
            if bins.len() == 1 {
                lists.place.push(u32::MAX);
                continue;
            }
            lists.place.push(lists.sorted.len() as u32);
            let known = plan.tree.first_own() + leaf;
            let (lower, upper) = leaf_box(&plan.tree.leaves()[known], plan.root_edge);
            let finer = finer_leaves(plan, known);
            lists.sorted.push(SortedLeaf { leaf, lower, upper, finer, lists: vec![Vec::new(); bins.len()] });
        }
        lists
    }

    /// Not collective. Sorts all particles; `half_widths(chunk, cell, out)` lists the half widths of the boxes
    /// of a chunk in a leaf with cells of edge `cell`.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan; the caller makes it collective.
    pub fn sort(
        &mut self,
        plan: &GridPlan<D>,
        chunks: &[Chunk<D>],
        half_widths: impl Fn(&Chunk<D>, f64, &mut Vec<[f64; D]>) + Sync,
    ) -> Result<(), BinMissing> {
        self.sorted.par_iter_mut().try_for_each_init(Vec::new, |halves, sorted| {
            let bins = &plan.bins[plan.leaf_bins(sorted.leaf)];
            let own_level = bins[0].block.level;
            let chunk = &chunks[sorted.leaf];
            sorted.lists.iter_mut().for_each(Vec::clear);
            half_widths(chunk, plan.cell(own_level), halves);
            for (p, &half) in halves.iter().enumerate() {
                let centre = chunk.position(p);
                let level = sorted.finest_level(own_level, centre, half);
                let bin = if level == own_level {
                    Some(0)
                } else {
                    let block_edge = plan.cell(level) * 4.0;
                    let coord: [u32; D] = std::array::from_fn(|axis| {
                        // Rounding may put a centre on the leaf's face into the block beyond it.
                        let first = bins[0].block.coord[axis] << (level - own_level);
                        let last = first + (1 << (level - own_level)) - 1;
                        ((centre[axis] / block_edge) as u32).clamp(first, last)
                    });
                    bins.iter().position(|bin| bin.block.level == level && bin.block.coord == coord)
                };
                let bin = bin.ok_or(BinMissing { id: chunk.ids()[p] })?;
                sorted.lists[bin].push(p as u32);
            }
            Ok(())
        })
    }

    /// Particles of bin number `bin` (counted within the leaf) of own leaf `leaf`.
    pub fn members(&self, leaf: usize, bin: usize) -> Members<'_> {
        match self.place[leaf] {
            u32::MAX => Members::All,
            place => Members::List(&self.sorted[place as usize].lists[bin]),
        }
    }
}

impl<const D: usize> SortedLeaf<D> {
    /// Finest level among the leaf and the finer leaves that the open box overlaps.
    fn finest_level(&self, own: u8, centre: [f64; D], half: [f64; D]) -> u8 {
        let lo: [f64; D] = std::array::from_fn(|axis| centre[axis] - half[axis]);
        let hi: [f64; D] = std::array::from_fn(|axis| centre[axis] + half[axis]);
        if (0..D).all(|axis| lo[axis] >= self.lower[axis] && hi[axis] <= self.upper[axis]) {
            return own;
        }
        self.finer
            .iter()
            .filter(|leaf| (0..D).all(|axis| lo[axis] < leaf.upper[axis] && hi[axis] > leaf.lower[axis]))
            .map(|leaf| leaf.level)
            .max()
            .unwrap_or(own)
    }
}

fn finer_leaves<const D: usize>(plan: &GridPlan<D>, known: usize) -> Vec<FinerLeaf<D>> {
    let tree = &plan.tree;
    let here = tree.leaves()[known];
    let mut finer = Vec::new();
    for index in 0..offset_count(D) {
        let Some(beside) = shifted(here.coord, offset::<D>(index)) else { continue };
        if beside == here.coord || !matches!(tree.cover(here.level, beside), Cover::Finer(_)) {
            continue;
        }
        for other in tree.leaves_within(here.level, beside) {
            let leaf = tree.leaves()[other];
            if here.touches(&leaf) {
                let (lower, upper) = leaf_box(&leaf, plan.root_edge);
                finer.push(FinerLeaf { level: leaf.level, lower, upper });
            }
        }
    }
    finer
}
