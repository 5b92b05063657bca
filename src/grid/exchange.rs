//! Exchange of arenas between ranks: one message per neighbour and step.
use partition::Octant;
use partition::comm::{Comm, NeighbourExchange, Pending, Traffic};
use rustc_hash::FxHashMap;

use super::arena::{Arenas, Moments};
use super::fields::add_moments;
use super::mask::bits;
use super::plan::{GridPlan, ReceivedBin, ReceivedNodes, arena_index};
use super::window::Window;
use crate::kernel::Row;

const ZERO: Row = Row([0.0; 4]);
const TAG: u16 = 11;

/// An own bin and the nodes of it that one neighbour needs.
struct SentBin {
    bin: u32,
    /// `(offset number of the block, nodes, constrained nodes)`.
    parts: Vec<(u8, u64, u64)>,
}

/// Exchange of arenas for one plan.
pub struct ArenaExchange<const D: usize> {
    exchange: NeighbourExchange,
    sent: Vec<Vec<SentBin>>,
    received_from: Vec<std::ops::Range<usize>>,
}

/// Parts of other ranks' arenas, as needed by the sums here.
#[derive(Debug, Default)]
pub struct ReceivedArenas<const D: usize> {
    rows: Vec<Row>,
    moments: Vec<Moments<D>>,
    /// Nodes with values of each received bin; none if it is not occupied.
    windows: Vec<Window<D>>,
    parts: Vec<Vec<ReceivedPart>>,
}

#[derive(Clone, Copy, Debug)]
struct ReceivedPart {
    offset: u8,
    nodes: u64,
    constrained: u64,
    first_row: usize,
    first_moment: usize,
}

impl<const D: usize> ArenaExchange<D> {
    /// Collective. Tells every neighbour which nodes of its bins are needed here.
    pub fn new(comm: &Comm, plan: &GridPlan<D>) -> (Self, ReceivedArenas<D>) {
        let mut requests: Vec<(usize, Vec<u64>)> = Vec::new();
        for bin in &plan.received {
            if requests.last().is_none_or(|(rank, _)| *rank != bin.rank) {
                requests.push((bin.rank, Vec::new()));
            }
            if let Some((_, words)) = requests.last_mut() {
                push_request(words, bin, &plan.tree.leaves()[bin.leaf as usize]);
            }
        }
        let asked: Vec<usize> = requests.iter().map(|(rank, _)| *rank).collect();
        let answers = comm.sparse_exchange(requests);
        let mut ranks: Vec<usize> = answers.iter().map(|(rank, _)| *rank).chain(asked).collect();
        // A rank that is asked without asking back must hear of it, so that both list each other.
        let told = comm.sparse_exchange(ranks.iter().map(|&rank| (rank, vec![0u8])).collect());
        ranks.extend(told.iter().map(|(rank, _)| *rank));
        ranks.sort_unstable();
        ranks.dedup();
        let own = plan.own_bins();
        let mut sent: Vec<Vec<SentBin>> = ranks.iter().map(|_| Vec::new()).collect();
        for (rank, words) in &answers {
            if let Ok(neighbour) = ranks.binary_search(rank) {
                sent[neighbour] = read_requests(words, plan, &own);
            }
        }
        let received_from = ranks
            .iter()
            .map(|&rank| {
                let start = plan.received.partition_point(|bin| bin.rank < rank);
                start..plan.received.partition_point(|bin| bin.rank <= rank)
            })
            .collect();
        let exchange = NeighbourExchange::new(comm, ranks, TAG);
        (Self { exchange, sent, received_from }, ReceivedArenas::new(plan))
    }

    /// Ranks with which arenas are exchanged.
    pub fn neighbours(&self) -> &[usize] {
        self.exchange.neighbours()
    }

    /// Per bin of `bins` in all, whether some neighbour needs it.
    pub fn sent_bins(&self, bins: usize) -> Vec<bool> {
        let mut sent = vec![false; bins];
        self.sent.iter().flatten().for_each(|bin| sent[bin.bin as usize] = true);
        sent
    }

    /// Messages and bytes so far.
    pub fn traffic(&self) -> Traffic {
        self.exchange.traffic()
    }

    /// Collective over neighbours. Starts sending what they need of the own arenas.
    pub fn begin(&mut self, arenas: &Arenas<D>) -> Pending {
        let outgoing = self.sent.iter().map(|bins| pack(bins, arenas)).collect();
        self.exchange.begin(outgoing)
    }

    /// Collective over neighbours. Waits for the neighbours' arenas.
    pub fn finish(&self, pending: Pending, received: &mut ReceivedArenas<D>) {
        for (message, bins) in pending.finish().iter().zip(&self.received_from) {
            received.unpack(message, bins.clone());
        }
    }
}

impl<const D: usize> ReceivedArenas<D> {
    fn new(plan: &GridPlan<D>) -> Self {
        let (mut rows, mut moments) = (0, 0);
        let parts = plan
            .received
            .iter()
            .map(|bin| {
                let place = |&ReceivedNodes { offset, nodes, constrained, .. }: &ReceivedNodes| {
                    let (first_row, first_moment) = (rows, moments);
                    let part = ReceivedPart { offset, nodes, constrained, first_row, first_moment };
                    rows += nodes.count_ones() as usize;
                    moments += constrained.count_ones() as usize;
                    part
                };
                bin.parts.iter().map(place).collect()
            })
            .collect();
        Self {
            rows: vec![ZERO; rows],
            moments: vec![[ZERO; D]; moments],
            windows: vec![Window::EMPTY; plan.received.len()],
            parts,
        }
    }

    /// Whether a received bin is occupied.
    pub(super) fn is_occupied(&self, bin: u32) -> bool {
        self.windows[bin as usize] != Window::EMPTY
    }

    /// Adds part number `part` of a received arena to its block.
    pub(super) fn add(&self, bin: u32, part: u32, rows: &mut [Row], moments: Option<&mut [Moments<D>]>) {
        let part = self.parts[bin as usize][part as usize];
        let inside = self.windows[bin as usize].nodes_of(part.offset as usize);
        for (bit, from) in bits(part.nodes & inside).zip(&self.rows[part.first_row..]) {
            for lane in 0..4 {
                rows[bit as usize].0[lane] += from.0[lane];
            }
        }
        if let Some(moments) = moments {
            let constrained = bits(part.constrained & inside);
            for (bit, from) in constrained.zip(&self.moments[part.first_moment..]) {
                add_moments(&mut moments[bit as usize], from);
            }
        }
    }

    fn unpack(&mut self, message: &[u8], bins: std::ops::Range<usize>) {
        let words = bins.len().div_ceil(64);
        let (bitmap, values) = message.split_at(8 * words);
        let mut values = values.chunks_exact(8).map(|b| f64::from_ne_bytes(std::array::from_fn(|i| b[i])));
        let mut next = || values.next().unwrap_or(f64::NAN);
        for (number, bin) in bins.enumerate() {
            if bitmap[number / 8] >> (number % 8) & 1 == 0 {
                self.windows[bin] = Window::EMPTY;
                continue;
            }
            let window = Window::from_bits(next().to_bits());
            self.windows[bin] = window;
            for part in &self.parts[bin] {
                let inside = window.nodes_of(part.offset as usize);
                let rows = (part.nodes & inside).count_ones() as usize;
                for row in &mut self.rows[part.first_row..][..rows] {
                    for lane in 0..D {
                        row.0[lane] = next();
                    }
                    row.0[3] = next();
                }
                let moments = (part.constrained & inside).count_ones() as usize;
                for moments in &mut self.moments[part.first_moment..][..moments] {
                    for row in moments.iter_mut() {
                        for lane in 0..D {
                            row.0[lane] = next();
                        }
                    }
                }
            }
        }
    }
}

/// Message to one neighbour: a bitmap of the occupied bins, then of each its window and the rows and moments
/// in it.
fn pack<const D: usize>(bins: &[SentBin], arenas: &Arenas<D>) -> Vec<u8> {
    let mut bitmap = vec![0u8; 8 * bins.len().div_ceil(64)];
    let mut values: Vec<f64> = Vec::new();
    for (number, sent) in bins.iter().enumerate() {
        let Some(arena) = arenas.get(sent.bin) else { continue };
        bitmap[number / 8] |= 1 << (number % 8);
        values.push(f64::from_bits(arena.window.to_bits()));
        for &(offset, nodes, constrained) in &sent.parts {
            let inside = arena.window.nodes_of(offset as usize);
            for bit in bits(nodes & inside) {
                let row = &arena.rows[arena_index::<D>(offset as usize, bit)].0;
                values.extend_from_slice(&row[..D]);
                values.push(row[3]);
            }
            if let Some(moments) = arena.moments {
                for bit in bits(constrained & inside) {
                    let moments = moments.at(offset as usize, bit);
                    moments.iter().for_each(|row| values.extend_from_slice(&row.0[..D]));
                }
            }
        }
    }
    bitmap.extend_from_slice(bytemuck::cast_slice(&values));
    bitmap
}

fn push_request<const D: usize>(words: &mut Vec<u64>, bin: &ReceivedBin<D>, leaf: &Octant<D>) {
    words.push(leaf.key());
    words.push(u64::from(bin.block.level) << 32 | bin.parts.len() as u64);
    words.extend(bin.block.coord.map(u64::from));
    for part in &bin.parts {
        words.extend([u64::from(part.offset), part.nodes, part.constrained]);
    }
}

fn read_requests<const D: usize>(
    words: &[u64],
    plan: &GridPlan<D>,
    own: &FxHashMap<(u32, Octant<D>), u32>,
) -> Vec<SentBin> {
    let mut sent = Vec::new();
    let mut at = 0;
    while at < words.len() {
        let leaf = plan.tree.locate(words[at]).unwrap_or_default() as u32;
        let (level, count) = ((words[at + 1] >> 32) as u8, words[at + 1] as u32 as usize);
        let coord = std::array::from_fn(|axis| words[at + 2 + axis] as u32);
        let parts =
            words[at + 2 + D..][..3 * count].chunks_exact(3).map(|p| (p[0] as u8, p[1], p[2])).collect();
        at += 2 + D + 3 * count;
        sent.push(SentBin { bin: own[&(leaf, Octant { level, coord })], parts });
    }
    sent
}
