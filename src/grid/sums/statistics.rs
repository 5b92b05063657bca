//! Sizes of tree and grid on a rank, bytes that it sends, and the least bytes that other ranks need.
use rustc_hash::FxHashMap;

use super::contributions::{Irregular, Sources};
use super::exchange::ArenaExchange;
use crate::grid::arenas::Arenas;
use crate::grid::plan::GridPlan;

/// Counts of one rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Own leaves.
    pub leaves: u64,
    /// Leaves of other ranks that it knows.
    pub ghost_leaves: u64,
    /// Ranks with which it exchanges messages in a step.
    pub neighbours: u64,
    /// Bytes that it sent in the last exchange of sums.
    pub arena_bytes: u64,
    /// Bytes of the nodes behind these, see [`surface_bytes`].
    pub surface_bytes: u64,
    /// Heap bytes of plan, arenas and node fields.
    pub grid_bytes: u64,
}

/// Nodes of a block that one receiver needs, and those whose first moments it needs.
#[derive(Clone, Copy)]
struct Needed {
    rows: u64,
    moments: u64,
}

/// Not collective. Bytes that the surface between partitions needs: for every pair of ranks, the distinct
/// nodes that the sender's particles touch and the receiver sums, each once, with momentum and mass, and with
/// the first moments that it has. An exchange that keeps the order of sums sends a node once for every
/// subtree of one owner in that order, so at least this.
pub fn surface_bytes<const D: usize>(
    exchange: &ArenaExchange<D>,
    plan: &GridPlan<D>,
    arenas: &Arenas<D>,
) -> u64 {
    let own = Sources { plan, arenas, received: None };
    let mut scratch = Irregular::default();
    let mut total = 0;
    for pieces in exchange.sent() {
        let mut needed: FxHashMap<u32, Needed> = FxHashMap::default();
        for piece in pieces {
            let nodes = piece.find(own, &mut scratch).own_nodes() & piece.nodes;
            let block = needed.entry(piece.block).or_insert(Needed { rows: 0, moments: 0 });
            block.rows |= nodes;
            block.moments |= piece.with_moments & nodes;
        }
        let (row, moments) = (8 * (D as u64 + 1), 8 * (D * D) as u64);
        let bytes = |needed: &Needed| {
            row * u64::from(needed.rows.count_ones()) + moments * u64::from(needed.moments.count_ones())
        };
        total += needed.values().map(bytes).sum::<u64>();
    }
    total
}
