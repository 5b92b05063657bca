//! A word of each leaf, from its owner to all ranks that know the leaf.
use partition::comm::{Comm, NeighbourExchange, Traffic};

use crate::grid::plan::ghost_layer::KnownTree;

const TAG: u16 = 13;

/// Exchange of a word per leaf for one plan.
pub(super) struct LeafWords {
    exchange: NeighbourExchange,
    /// Own leaves, as numbers among these, whose words each neighbour gets.
    sent: Vec<Vec<u32>>,
    /// Known leaves whose words each neighbour sends.
    received: Vec<Vec<u32>>,
}

impl LeafWords {
    /// Collective. Tells the owners of all ghost leaves that their words are needed here.
    pub(super) fn new<const D: usize>(comm: &Comm, tree: &KnownTree<D>) -> Self {
        let mut ghosts: Vec<(usize, u32)> = (0..tree.leaves().len())
            .filter(|&leaf| tree.local(leaf).is_none())
            .map(|leaf| (tree.owner(leaf), leaf as u32))
            .collect();
        ghosts.sort_unstable();
        let mut requests: Vec<(usize, Vec<u64>)> = Vec::new();
        for of_rank in ghosts.chunk_by(|a, b| a.0 == b.0) {
            let keys = of_rank.iter().map(|(_, leaf)| tree.leaves()[*leaf as usize].key());
            requests.push((of_rank[0].0, keys.collect()));
        }
        let (exchange, answers) = NeighbourExchange::by_requests(comm, requests, TAG);
        let ranks = exchange.neighbours();
        let mut sent: Vec<Vec<u32>> = vec![Vec::new(); ranks.len()];
        for (rank, keys) in &answers {
            if let Ok(neighbour) = ranks.binary_search(rank) {
                let own =
                    |key: &u64| tree.locate(*key).and_then(|leaf| tree.local(leaf)).map(|own| own as u32);
                sent[neighbour] = keys.iter().filter_map(own).collect();
            }
        }
        let of_rank = |rank: &usize| {
            let ghosts = ghosts.iter().filter(move |(owner, _)| owner == rank);
            ghosts.map(|(_, leaf)| *leaf).collect()
        };
        let received = ranks.iter().map(of_rank).collect();
        Self { exchange, sent, received }
    }

    /// Messages and bytes so far.
    pub(super) fn traffic(&self) -> Traffic {
        self.exchange.traffic()
    }

    /// Collective over neighbours. Fills `all` with the words of all known leaves, from those of the own
    /// leaves.
    pub(super) fn share<const D: usize>(&mut self, tree: &KnownTree<D>, own: &[u64], all: &mut Vec<u64>) {
        all.clear();
        all.resize(tree.leaves().len(), 0);
        all[tree.own_leaves()].copy_from_slice(own);
        let message = |leaves: &Vec<u32>| {
            let words: Vec<u64> = leaves.iter().map(|&leaf| own[leaf as usize]).collect();
            bytemuck::cast_slice::<u64, u8>(&words).to_vec()
        };
        let pending = self.exchange.begin(self.sent.iter().map(message).collect());
        for (message, leaves) in pending.finish().iter().zip(&self.received) {
            for (&leaf, word) in leaves.iter().zip(message.chunks_exact(size_of::<u64>())) {
                all[leaf as usize] = bytemuck::pod_read_unaligned(word);
            }
        }
    }
}
