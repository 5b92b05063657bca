//! What a rank holds of the tree and sends of its grid, and what of that other ranks need at least.
use std::collections::HashMap;

use partition::Octant;
use partition::comm::Comm;

use super::arena::Arenas;
use super::mask::{offset, shifted};
use super::plan::GridPlan;

/// Counts of one rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Own leaves.
    pub leaves: u64,
    /// Leaves of other ranks that it knows.
    pub ghost_leaves: u64,
    /// Ranks with which it exchanges messages in a step.
    pub neighbours: u64,
    /// Bytes that it sent in the last exchange of arenas.
    pub arena_bytes: u64,
    /// Bytes of the nodes behind these, see [`surface_bytes`].
    pub surface_bytes: u64,
    /// Heap bytes of plan, arenas and node fields.
    pub grid_bytes: u64,
}

/// Nodes of a block that one receiver needs: all, and those with first moments.
#[derive(Clone, Copy, Default)]
struct Needed {
    rows: u64,
    moments: u64,
}

/// Collective. Bytes that the surface between partitions needs: for every pair of ranks, the distinct nodes that the
/// sender's particles touch and the receiver sums, each once, with momentum and mass, and with first moments where the
/// node is constrained. An exchange that keeps the order of sums sends a node once for every bin that
/// touches it, so at least this.
pub fn surface_bytes<const D: usize>(comm: &Comm, plan: &GridPlan<D>, arenas: &Arenas<D>) -> u64 {
    let mut questions: Vec<(usize, Vec<u64>)> = Vec::new();
    for bin in &plan.received {
        if questions.last().is_none_or(|(rank, _)| *rank != bin.rank) {
            questions.push((bin.rank, Vec::new()));
        }
        let Some((_, words)) = questions.last_mut() else { continue };
        let leaf = plan.tree.leaves()[bin.leaf as usize];
        words.extend([leaf.key(), u64::from(bin.block.level), bin.parts.len() as u64]);
        words.extend(bin.block.coord.map(u64::from));
        words
            .extend(bin.parts.iter().flat_map(|part| [u64::from(part.offset), part.nodes, part.constrained]));
    }
    let bins = plan.own_bins();
    let own = |leaf, block| bins.get(&(leaf, block)).copied();
    let asked = comm.sparse_exchange(questions);
    asked.iter().map(|(_, words)| bytes_for(words, plan, own, arenas)).sum()
}

/// Bytes for one receiver, which asks for parts of bins.
fn bytes_for<const D: usize>(
    words: &[u64],
    plan: &GridPlan<D>,
    own: impl Fn(u32, Octant<D>) -> Option<u32>,
    arenas: &Arenas<D>,
) -> u64 {
    let mut needed: HashMap<Octant<D>, Needed> = HashMap::new();
    let mut rest = words;
    while let [key, level, count, tail @ ..] = rest {
        let (coord, tail) = tail.split_at(D);
        let (parts, tail) = tail.split_at(3 * *count as usize);
        rest = tail;
        let block = Octant { level: *level as u8, coord: std::array::from_fn(|axis| coord[axis] as u32) };
        let leaf = plan.tree.locate(*key).unwrap_or_default() as u32;
        let Some(arena) = own(leaf, block).and_then(|bin| arenas.get(bin)) else { continue };
        for part in parts.chunks_exact(3) {
            let (towards, nodes, constrained) = (part[0] as usize, part[1], part[2]);
            let Some(coord) = shifted(block.coord, offset::<D>(towards)) else { continue };
            let touched = arena.window.nodes_of(towards);
            let entry = needed.entry(Octant { level: block.level, coord }).or_default();
            entry.rows |= nodes & touched;
            if arena.moments.is_some() {
                entry.moments |= constrained & touched;
            }
        }
    }
    let (row, moments) = (8 * (D as u64 + 1), 8 * (D * D) as u64);
    let bytes = |needed: &Needed| {
        row * u64::from(needed.rows.count_ones()) + moments * u64::from(needed.moments.count_ones())
    };
    needed.values().map(bytes).sum()
}
