//! Sums that a rank requests from others.
//!
//! For every region of every block whose sums it needs, a rank knows all bins that may contribute, own and
//! others. In the tree of their keys it finds the largest subtrees of one owner: these are the pieces that it
//! requests.
use partition::{MAX_LEVEL, Octant};
use rustc_hash::FxHashMap;

use super::bin_reach::bin_sources;
use super::bins_by_block::NO_BIN;
use super::block::Block;
use super::grid_plan::GridPlan;
use super::pieces::{NO_HOME, Part, Piece};
use crate::csr::Csr;
use crate::grid::mask::{box_offsets, offset, offset_count, shifted};
use crate::grid::order::each_subtree;
use crate::grid::order::region::Regions;

/// A bin that may contribute to a block.
struct Candidate {
    key: u64,
    tie: u64,
    rank: usize,
    position: u8,
    /// Whether the bin's block lies in its leaf.
    is_inner: bool,
}

impl<const D: usize> GridPlan<D> {
    /// Key of a bin in the order of sums, and its place among bins with the same.
    pub fn source_key(&self, bin: u32) -> (u64, u64) {
        let bin = &self.bins[bin as usize];
        source_key(&self.tree.leaves()[self.tree.first_own() + bin.leaf as usize], &bin.block)
    }

    /// Positions around a block that the leaf of an own bin covers or lies in, as bits.
    pub fn homes(&self, bin: u32, block: usize) -> u32 {
        let (bin, block) = (&self.bins[bin as usize], &self.blocks[block]);
        let leaf = &self.tree.leaves()[self.tree.first_own() + bin.leaf as usize];
        (0..D).fold((1 << offset_count(D)) - 1, |homes, axis| {
            let at = |coord: u32, level: u8| i64::from(coord) << (MAX_LEVEL - level);
            let (from, to) = (at(leaf.coord[axis], leaf.level), at(leaf.coord[axis] + 1, leaf.level));
            let edge = 1i64 << (MAX_LEVEL - block.level);
            let along = (0..3).filter(|&towards| {
                let beside = i64::from(block.coord[axis]) + towards as i64 - 1;
                beside * edge < to && from < (beside + 1) * edge
            });
            homes & along.fold(0, |set, towards| set | POSITIONS[axis][towards])
        })
    }

    /// Lists the pieces that this rank needs of others, by rank, and the sums that they enter.
    pub(super) fn list_pieces(&mut self, rank: usize) {
        let mut search = RemoteBins::default();
        // Pieces as they are found, and where they enter: block and part.
        let mut pieces: Vec<Piece> = Vec::new();
        let mut parts: Vec<(u32, Part)> = Vec::new();
        let mut candidates = Vec::new();
        // A rank that knows no leaves of others needs nothing of them.
        for block in 0..if self.tree.ghost_len() > 0 { self.blocks.len() } else { 0 } {
            candidates.clear();
            search.add_remote(self, rank, block, &mut candidates);
            if !candidates.is_empty() {
                self.add_own(rank, block, &mut candidates);
                candidates.sort_unstable_by_key(|candidate| (candidate.key, candidate.tie));
                self.cut_pieces(rank, block, &candidates, &mut pieces, &mut parts);
            }
        }
        // Both sides list the pieces of two ranks in the order found.
        let mut by_rank: Vec<u32> = (0..pieces.len() as u32).collect();
        by_rank.sort_by_key(|&piece| pieces[piece as usize].rank);
        let mut place = vec![0; pieces.len()];
        by_rank.iter().zip(0..).for_each(|(&piece, at)| place[piece as usize] = at);
        self.pieces = by_rank.iter().map(|&piece| pieces[piece as usize]).collect();
        let placed =
            |(block, part): &(u32, Part)| (*block, Part { piece: place[part.piece as usize], ..*part });
        self.parts = Csr::new(self.blocks.len(), parts.iter().map(placed));
    }

    /// Parts of pieces that enter the sum of a block.
    pub fn parts(&self, block: usize) -> &[Part] {
        self.parts.of(block)
    }

    /// Whether other ranks contribute to the sum of a block.
    pub fn is_seam(&self, block: usize) -> bool {
        !self.parts(block).is_empty()
    }

    /// Own bins that may contribute to a block.
    fn add_own(&self, rank: usize, block: usize, candidates: &mut Vec<Candidate>) {
        let inner = self.bins_by_block.inner::<D>(block).iter().copied().zip(0u8..);
        let inner = inner.filter(|(bin, _)| *bin != NO_BIN);
        let outer = self.bins_by_block.outer(block).iter().map(|outer| (outer.bin, outer.position));
        candidates.extend(inner.chain(outer).map(|(bin, position)| {
            let (key, tie) = self.source_key(bin);
            Candidate { key, tie, rank, position, is_inner: self.bins[bin as usize].is_inner }
        }));
    }

    /// Divides the contributions to a block into pieces of other ranks.
    fn cut_pieces(
        &self,
        rank: usize,
        block: usize,
        candidates: &[Candidate],
        pieces: &mut Vec<Piece>,
        parts: &mut Vec<(u32, Part)>,
    ) {
        let regions = Regions::of::<D>();
        let Block { needs_sum: sum, chained, .. } = self.blocks[block];
        let known = pieces.len();
        let mut found: Vec<(usize, u64, u64, u8)> = Vec::new();
        for region in 0..offset_count(D) {
            let nodes = regions.nodes[region] & sum;
            if nodes == 0 {
                continue;
            }
            let reaches = |candidate: &&Candidate| regions.positions[region] >> candidate.position & 1 == 1;
            let here: Vec<&Candidate> = candidates.iter().filter(reaches).collect();
            found.clear();
            let mut own = 0;
            each_subtree(&here, &|candidate| candidate.key, &|candidate| candidate.rank, &mut |subtree| {
                let [first, ..] = subtree else { return };
                if first.rank == rank {
                    own += 1;
                } else {
                    let home = subtree.iter().find(|candidate| candidate.is_inner);
                    let home = home.map_or(NO_HOME, |candidate| candidate.position);
                    found.push((first.rank, first.key, subtree[subtree.len() - 1].key, home));
                }
            });
            for &(owner, first, last, home) in &found {
                let is_all = found.iter().filter(|(other, ..)| *other == owner).count() == 1;
                let (from, to) = if is_all { (0, u64::MAX) } else { (first, last) };
                let is_same = |piece: &Piece| (piece.rank, piece.first, piece.last) == (owner, from, to);
                let piece = known + pieces[known..].iter().position(is_same).unwrap_or(pieces.len() - known);
                if piece == pieces.len() {
                    let block = block as u32;
                    pieces.push(Piece {
                        rank: owner,
                        block,
                        nodes: 0,
                        with_moments: 0,
                        first: from,
                        last: to,
                    });
                }
                pieces[piece].nodes |= nodes;
                pieces[piece].with_moments |= chained & nodes;
                let is_only = found.len() == 1 && own <= 1;
                let (block, region, piece) = (block as u32, region as u8, piece as u32);
                parts.push((block, Part { region, piece, key: first, home, is_only }));
            }
        }
    }
}

/// By axis, positions with offset -1, 0 and 1 along it, as bits.
const POSITIONS: [[u32; 3]; 3] = [
    [0o111_111_111, 0o222_222_222, 0o444_444_444],
    [0o007_007_007, 0o070_070_070, 0o700_700_700],
    [0o777, 0o777 << 9, 0o777 << 18],
];

/// Key of a bin of `leaf` in the order of sums, and its place among bins with the same: where its block lies,
/// or, if that is outside, where the leaf lies. So the contributions of a leaf are adjacent, and so are those
/// of a rank.
fn source_key<const D: usize>(leaf: &Octant<D>, block: &Octant<D>) -> (u64, u64) {
    let place = block.key();
    (if leaf.contains(block) { place } else { leaf.key() }, place)
}

/// Search for bins of other ranks; caches its results.
#[derive(Default)]
struct RemoteBins<const D: usize> {
    remote: FxHashMap<Octant<D>, Vec<usize>>,
    is_inner: FxHashMap<Octant<D>, bool>,
}

impl<const D: usize> RemoteBins<D> {
    /// Bins of other ranks that may contribute to the sums of a block.
    fn add_remote(&mut self, plan: &GridPlan<D>, rank: usize, block: usize, candidates: &mut Vec<Candidate>) {
        let (tree, block) = (&plan.tree, &plan.blocks[block]);
        let regions = Regions::of::<D>();
        for position in 0..offset_count(D) {
            if block.needs_sum & regions.overlap[position] == 0 {
                continue;
            }
            let Some(coord) = shifted(block.coord, offset::<D>(position)) else { continue };
            let bin = Octant { level: block.level, coord };
            let leaves = self.remote.entry(bin).or_insert_with(|| {
                let start = bin.ancestor(tree.coarsest_reaching(bin.level));
                if *self.is_inner.entry(start).or_insert_with(|| plan.is_inner(&start)) {
                    return Vec::new();
                }
                let mut leaves = bin_sources(tree, bin.level, bin.coord);
                leaves.retain(|&leaf| tree.owner(leaf) != rank);
                leaves
            });
            candidates.extend(leaves.iter().map(|&leaf| {
                let (key, tie) = source_key(&tree.leaves()[leaf], &bin);
                let is_inner = tree.leaves()[leaf].contains(&bin);
                Candidate { key, tie, rank: tree.owner(leaf), position: position as u8, is_inner }
            }));
        }
    }
}

impl<const D: usize> GridPlan<D> {
    /// Whether all leaves that may feed bins inside `start` are own leaves.
    fn is_inner(&self, start: &Octant<D>) -> bool {
        let mut around = box_offsets::<D>(self.tree.reach_in_leaves());
        around.all(|offset| {
            shifted(start.coord, offset).is_none_or(|coord| {
                let beside = Octant { level: start.level, coord };
                !self.tree.contains(start.level, coord) || self.tree.is_own(&beside)
            })
        })
    }
}
