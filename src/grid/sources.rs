//! Which bins enter the sums of a rank, and in which order.
use partition::Octant;
use rustc_hash::FxHashMap;

use super::mask::{arena_overlap, box_offsets, offset, offset_count, opposite, shifted};
use super::plan::{BinId, GridPlan, ReceivedBin, ReceivedNodes, Source};
use super::reach::bin_sources;

impl<const D: usize> GridPlan<D> {
    /// Lists the bins of other ranks that enter sums here, with the nodes needed of each.
    pub(super) fn list_received(&mut self, rank: usize) {
        // (source leaf, bin, part)
        let mut needed: Vec<(u32, Octant<D>, ReceivedNodes)> = Vec::new();
        let mut feeding: FxHashMap<Octant<D>, Vec<usize>> = FxHashMap::default();
        let mut is_inner: FxHashMap<Octant<D>, bool> = FxHashMap::default();
        for (index, block) in self.blocks.iter().enumerate().filter(|(_, block)| block.sum != 0) {
            for towards in 0..offset_count(D) {
                let Some(coord) = shifted(block.coord, offset::<D>(towards)) else { continue };
                let seen_from_bin = opposite(D, towards);
                let nodes = block.sum & arena_overlap::<D>(offset(seen_from_bin));
                if nodes == 0 {
                    continue;
                }
                let bin = Octant { level: block.level, coord };
                let remote = feeding.entry(bin).or_insert_with(|| {
                    let start = bin.ancestor(self.tree.coarsest_reaching(bin.level));
                    if *is_inner.entry(start).or_insert_with(|| self.is_inner(&start)) {
                        return Vec::new();
                    }
                    let mut leaves = bin_sources(&self.tree, bin.level, bin.coord);
                    leaves.retain(|&leaf| self.tree.owner(leaf) != rank);
                    leaves
                });
                let constrained = nodes & block.constrained;
                let offset = seen_from_bin as u8;
                let part = ReceivedNodes { block: index as u32, offset, nodes, constrained };
                needed.extend(remote.iter().map(|&leaf| (leaf as u32, bin, part)));
            }
        }
        needed.sort_unstable_by_key(|(leaf, bin, part)| (*leaf, bin.level, bin.key(), part.offset));
        for (leaf, block, part) in needed {
            match self.received.last_mut() {
                Some(last) if (last.leaf, last.block) == (leaf, block) => last.parts.push(part),
                _ => {
                    let rank = self.tree.owner(leaf as usize);
                    self.received.push(ReceivedBin { rank, leaf, block, parts: vec![part] });
                }
            }
        }
    }

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

    /// Puts own and received bins into canonical order.
    pub(super) fn list_sources(&mut self) {
        let first = self.tree.first_own() as u32;
        let own = self.bins.iter().zip(0..);
        let own = own.map(|(bin, number)| (first + bin.leaf, bin.block, Source::Own(BinId(number))));
        let received = self.received.iter().zip(0..);
        let received = received.map(|(bin, number)| (bin.leaf, bin.block, Source::Received(number)));
        let mut sources: Vec<(u32, Octant<D>, Source)> = own.chain(received).collect();
        sources.sort_unstable_by_key(|(leaf, block, _)| (*leaf, block.level, block.key()));
        self.sources = sources.into_iter().map(|(_, _, source)| source).collect();
    }
}
