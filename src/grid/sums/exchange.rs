//! Exchange of partial sums between ranks: one message per neighbour and step.
//!
//! A rank that sums up a node with contributions of others has requested from their owners, once per plan,
//! the sums of the largest subtrees (see [`crate::grid::order`]) that these own alone. In each step an owner
//! adds up its arenas over these nodes and sends the sums of those that its particles touch.
use partition::comm::{Comm, NeighbourExchange, Pending, Traffic};
use partition::{MAX_LEVEL, Octant};
use rayon::prelude::*;

use super::contributions::{BlockSum, Irregular, Sources};
use super::node_fields::NodeFields;
use super::received::{Extent, ReceivedSums, TASK};
use crate::grid::arenas::Arenas;
use crate::grid::arenas::arena_schedule::Seam;
use crate::grid::constraints::moments::{self, Moments};
use crate::grid::mask::{bits, block_nodes};
use crate::grid::order::region::Regions;
use crate::grid::plan::GridPlan;
use crate::grid::plan::bins_by_block::NO_BIN;
use crate::grid::plan::pieces::Piece;
use crate::kernel::Row;

const ZERO: Row = Row([0.0; 4]);
const TAG: u16 = 11;

/// A sum that one neighbour needs of own bins.
#[derive(Clone, Copy, Debug)]
pub(super) struct SentPiece {
    /// The block.
    pub block: u32,
    /// Nodes that the neighbour needs.
    pub nodes: u64,
    /// Those of them whose first moments it needs.
    pub with_moments: u64,
    /// Keys of the bins, if not all that reach the block.
    keys: Option<(u64, u64)>,
}

/// Exchange of partial sums for one plan.
pub struct ArenaExchange<const D: usize> {
    exchange: NeighbourExchange,
    sent: Vec<Vec<SentPiece>>,
    received_from: Vec<std::ops::Range<usize>>,
}

impl<const D: usize> ArenaExchange<D> {
    /// Collective. Tells every neighbour which sums of its bins are needed here.
    pub fn new(comm: &Comm, plan: &GridPlan<D>) -> (Self, ReceivedSums<D>) {
        let mut requests: Vec<(usize, Vec<u64>)> = Vec::new();
        for piece in &plan.pieces {
            if requests.last().is_none_or(|(rank, _)| *rank != piece.rank) {
                requests.push((piece.rank, Vec::new()));
            }
            if let Some((_, words)) = requests.last_mut() {
                push_request(words, piece, plan);
            }
        }
        let (exchange, answers) = NeighbourExchange::by_requests(comm, requests, TAG);
        let ranks = exchange.neighbours();
        let mut sent: Vec<Vec<SentPiece>> = ranks.iter().map(|_| Vec::new()).collect();
        for (rank, words) in &answers {
            if let Ok(neighbour) = ranks.binary_search(rank) {
                sent[neighbour] = words.chunks_exact(5 + D).map(|words| read_request(words, plan)).collect();
            }
        }
        let received_from = ranks
            .iter()
            .map(|&rank| {
                let start = plan.pieces.partition_point(|piece| piece.rank < rank);
                start..plan.pieces.partition_point(|piece| piece.rank <= rank)
            })
            .collect();
        (Self { exchange, sent, received_from }, ReceivedSums::new(plan))
    }

    /// Ranks with which sums are exchanged.
    pub fn neighbours(&self) -> &[usize] {
        self.exchange.neighbours()
    }

    /// Own bins and blocks whose arenas or sums other ranks need.
    pub fn seam(&self, plan: &GridPlan<D>) -> Seam {
        // Of these blocks neighbours need sums of all own bins that reach some nodes.
        let mut is_asked = vec![false; plan.blocks.len()];
        for piece in self.sent.iter().flatten().filter(|piece| piece.keys.is_none()) {
            is_asked[piece.block as usize] = true;
        }
        Seam::new(plan, self.sent_bins(plan), is_asked)
    }

    /// Per bin, whether it reaches a block of which some neighbour needs sums.
    fn sent_bins(&self, plan: &GridPlan<D>) -> Vec<bool> {
        let mut sent = vec![false; plan.bins.len()];
        let overlap = &Regions::of::<D>().overlap;
        for piece in self.sent.iter().flatten() {
            let inner = plan.bins_by_block.inner::<D>(piece.block as usize).iter().copied().zip(0u8..);
            let outer = plan.bins_by_block.outer(piece.block as usize).iter();
            let outer = outer.map(|outer| (outer.bin, outer.position));
            for (bin, position) in inner.filter(|(bin, _)| *bin != NO_BIN).chain(outer) {
                // Blocks are summed as a whole, pieces with keys by themselves.
                let is_sent = piece.keys.is_none_or(|(first, last)| {
                    let is_touched = overlap[position as usize] & piece.nodes != 0;
                    is_touched && (first..=last).contains(&plan.source_key(bin).0)
                });
                sent[bin as usize] |= is_sent;
            }
        }
        sent
    }

    /// Messages and bytes so far.
    pub fn traffic(&self) -> Traffic {
        self.exchange.traffic()
    }

    /// The pieces of own bins that each neighbour needs.
    pub(super) fn sent(&self) -> &[Vec<SentPiece>] {
        &self.sent
    }

    /// Not collective. The message to each neighbour: the sums of own arenas that it needs. `fields` have
    /// most of them, those of whole blocks; the others are added up here.
    pub fn pack(&self, plan: &GridPlan<D>, arenas: &Arenas<D>, fields: &NodeFields<D>) -> Vec<Vec<u8>> {
        let own = Sources { plan, arenas, received: None };
        let tasks: Vec<&[SentPiece]> = self.sent.iter().flat_map(|pieces| pieces.chunks(TASK)).collect();
        let sums = tasks.into_par_iter().map_init(Packing::default, |packing, pieces| {
            let mut extents = 0u64;
            let mut values = Vec::new();
            for (i, piece) in pieces.iter().enumerate() {
                let extent = match piece.keys {
                    None => pack(piece, plan, fields, &mut values),
                    Some(_) => packing.pack(piece, own, &mut values),
                };
                extents |= (extent as u64) << (2 * i);
            }
            (extents, values)
        });
        let sums: Vec<(u64, Vec<f64>)> = sums.collect();
        let mut sums = &sums[..];
        let message = |pieces: &Vec<SentPiece>| {
            let (own, rest) = sums.split_at(pieces.len().div_ceil(TASK));
            sums = rest;
            let mut message: Vec<u8> = Vec::new();
            own.iter()
                .for_each(|(extents, _)| message.extend_from_slice(&extents.to_ne_bytes()[..2 * TASK / 8]));
            own.iter().for_each(|(_, values)| message.extend_from_slice(bytemuck::cast_slice(values)));
            message
        };
        self.sent.iter().map(message).collect()
    }

    /// Collective over neighbours. Starts sending the messages packed.
    pub fn begin(&mut self, messages: Vec<Vec<u8>>) -> Pending {
        self.exchange.begin(messages)
    }

    /// Collective over neighbours. Waits for the neighbours' sums.
    pub fn finish(&self, pending: Pending, received: &mut ReceivedSums<D>) {
        for (message, pieces) in pending.finish().iter().zip(&self.received_from) {
            received.unpack(message, pieces.clone());
        }
    }
}

impl SentPiece {
    /// Sources of the sum of the piece: its block, and the bins that it asks for.
    pub(super) fn find<'a, const D: usize>(
        &self,
        own: Sources<'a, D>,
        scratch: &'a mut Irregular<D>,
    ) -> BlockSum<'a, D> {
        let keys = self.keys.map(|(first, last)| first..=last);
        BlockSum::find(own, scratch, self.block as usize, keys)
    }
}

/// Memory that a thread reuses from piece to piece.
struct Packing<const D: usize> {
    scratch: Irregular<D>,
    rows: Vec<Row>,
    /// First moments of the present block.
    moments: Vec<Row>,
}

impl<const D: usize> Default for Packing<D> {
    fn default() -> Self {
        let nodes = block_nodes(D);
        Self { scratch: Irregular::default(), rows: vec![ZERO; nodes], moments: vec![ZERO; D * nodes] }
    }
}

impl<const D: usize> Packing<D> {
    /// Adds up a piece and appends it to a message.
    fn pack(&mut self, piece: &SentPiece, own: Sources<'_, D>, values: &mut Vec<f64>) -> Extent {
        let mut sum = piece.find(own, &mut self.scratch);
        let nodes = sum.own_nodes() & piece.nodes;
        sum.sum_rows(Regions::of::<D>().meeting::<D>(nodes), &mut self.rows);
        sum.sum_moments(nodes & piece.with_moments, &mut self.moments);
        let of_block = own.plan.blocks[piece.block as usize].with_moments;
        append::<D>(piece, nodes, &self.rows, (of_block, &self.moments), values)
    }
}

/// Appends a piece to a message whose sums `fields` have.
fn pack<const D: usize>(
    piece: &SentPiece,
    plan: &GridPlan<D>,
    fields: &NodeFields<D>,
    values: &mut Vec<f64>,
) -> Extent {
    let block = piece.block as usize;
    let nodes = fields.touched(block) & piece.nodes;
    let rows = &fields.rows[block * block_nodes(D)..][..block_nodes(D)];
    append::<D>(piece, nodes, rows, (plan.blocks[block].with_moments, fields.moments_of(plan, block)), values)
}

/// Appends the sums at `nodes` to a message, from the rows and the first moments of the block, with the nodes
/// that have such.
fn append<const D: usize>(
    piece: &SentPiece,
    nodes: u64,
    rows: &[Row],
    (of_block, moments): (u64, &[Row]),
    values: &mut Vec<f64>,
) -> Extent {
    if nodes == 0 {
        return Extent::None;
    }
    let is_all = nodes == piece.nodes;
    if !is_all {
        values.push(f64::from_bits(nodes));
    }
    for bit in bits(nodes) {
        let Row([x, y, z, mass]) = rows[bit as usize];
        if D == 3 {
            values.extend_from_slice(&[x, y, z, mass]);
        } else {
            values.extend_from_slice(&[x, y, mass]);
        }
    }
    for bit in bits(piece.with_moments & nodes) {
        let moments: Moments<D> = moments::read(moments, of_block, bit);
        moments.iter().for_each(|row| values.extend_from_slice(&row.0[..D]));
    }
    if is_all { Extent::All } else { Extent::Some }
}

fn push_request<const D: usize>(words: &mut Vec<u64>, piece: &Piece, plan: &GridPlan<D>) {
    let block = &plan.blocks[piece.block as usize];
    words.push(u64::from(block.level));
    words.extend(block.coord.map(u64::from));
    words.extend([piece.nodes, piece.with_moments, piece.first, piece.last]);
}

/// The piece that a neighbour asks for. Bins of this rank reach the nodes, so that it has their block.
fn read_request<const D: usize>(words: &[u64], plan: &GridPlan<D>) -> SentPiece {
    let level = words[0].min(u64::from(MAX_LEVEL)) as u8;
    let coord = std::array::from_fn(|axis| words[1 + axis] as u32);
    let [nodes, with_moments, first, last] = std::array::from_fn(|i| words[1 + D + i]);
    let place = |level: u8, coord: [u32; D]| (level, Octant { level, coord }.key(), coord);
    let found =
        plan.blocks.binary_search_by_key(&place(level, coord), |block| place(block.level, block.coord));
    debug_assert!(found.is_ok(), "a sum of nodes that no own bin reaches");
    let keys = (last != u64::MAX).then_some((first, last));
    match found {
        Ok(block) => SentPiece { block: block as u32, nodes, with_moments, keys },
        Err(_) => SentPiece { block: 0, nodes: 0, with_moments: 0, keys },
    }
}
