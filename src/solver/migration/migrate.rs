//! Migration of particles between leaves, and with them between ranks.
//!
//! Arrivals are appended to a leaf in the order of their source leaves along the curve, then in the order in
//! which `depart.rs` took them out. Ranks hold contiguous segments of the curve, so appending the messages of
//! lower ranks, then the own moves, then the messages of higher ranks gives that order on every partition.
use partition::comm::{Comm, NeighbourExchange, Traffic};
use rayon::prelude::*;

use super::crossings::{Crossings, FaceRules};
use super::depart::{Borders, Departed, outside};
use super::error::MigrateError;
use super::records::append_all;
use crate::adaptivity::resample::cell_fit::{Resampling, Splits};
use crate::grid::{GridPlan, KnownTree};
use crate::particle::chunk::Chunk;

const TAG: u16 = 12;

/// Moves particles to the leaves that contain them.
pub struct Migration<const D: usize> {
    exchange: NeighbourExchange,
    pub(in crate::solver) borders: Borders<D>,
}

/// Particles that left their leaf in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// To another leaf of the same rank.
    pub local: u64,
    /// To another rank.
    pub sent: u64,
}

impl<const D: usize> Migration<D> {
    /// Not collective. `neighbours` must be those of the plan's arena exchange; particles have up to
    /// `carried` columns of what they carry for loads.
    pub(in crate::solver) fn new(
        comm: &Comm,
        plan: &GridPlan<D>,
        neighbours: Vec<usize>,
        rules: FaceRules<D>,
        carried: usize,
    ) -> Self {
        Self {
            exchange: NeighbourExchange::new(comm, neighbours, TAG),
            borders: Borders::new(plan, rules, carried),
        }
    }

    /// Messages and bytes so far.
    pub fn traffic(&self) -> Traffic {
        self.exchange.traffic()
    }

    /// Collective over neighbours. Moves every particle into the leaf that contains it; see
    /// [`Borders::depart`] and [`Migration::arrive`]. Particles of other leaves than `may_stray` says must be
    /// in theirs.
    ///
    /// # Errors
    /// As those of [`Migration::arrive`].
    pub(in crate::solver) fn migrate(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        resampling: Option<&Resampling<'_, D>>,
        may_stray: impl Fn(usize) -> bool + Sync,
        splits: &mut Vec<Splits>,
        crossings: &mut Crossings,
    ) -> Result<Moved, MigrateError> {
        let borders = &self.borders;
        let leaves = chunks.par_iter_mut().enumerate().with_min_len(4);
        let departed = leaves.filter(|(leaf, _)| may_stray(*leaf)).map(|(leaf, chunk)| {
            let outside = outside(chunk, borders.of_leaf(leaf));
            borders.depart(tree, leaf, chunk, (&outside, &[]), resampling)
        });
        let departed = departed.collect();
        self.arrive(tree, chunks, departed, splits, crossings)
    }

    /// Collective over neighbours. Moves particles (per own leaf, ascending) into the leaves that contain the
    /// places given with them, which must be in or next to their leaf; their positions do not change.
    pub(in crate::solver) fn gather(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        wanted: &[Vec<(u32, [f64; D])>],
    ) -> Result<Moved, MigrateError> {
        let borders = &self.borders;
        let leaves = chunks.par_iter_mut().zip(wanted).enumerate().with_min_len(32);
        let departed = leaves.map(|(leaf, (chunk, wanted))| {
            let leavers =
                wanted.iter().filter_map(|&(p, place)| Some((p, borders.elsewhere(tree, leaf, place)?)));
            borders.take(chunk, &leavers.collect::<Vec<_>>())
        });
        let departed = departed.collect();
        // None of them leaves the domain.
        self.arrive(tree, chunks, departed, &mut Vec::new(), &mut Crossings::default())
    }

    /// Collective over neighbours. Appends the particles that have departed, here and on other ranks, to the
    /// own leaves that hold them now. Appends the splits on the way to `splits`, and counts particles that
    /// crossed faces of the domain in `crossings`.
    ///
    /// # Errors
    /// [`MigrateError`] on the rank that found it; the caller makes it collective. The exchange is completed
    /// in any case.
    pub(in crate::solver) fn arrive(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        mut departed: Vec<Departed>,
        splits: &mut Vec<Splits>,
        crossings: &mut Crossings,
    ) -> Result<Moved, MigrateError> {
        let mut error = None;
        let mut moved = Moved::default();
        for departed in &mut departed {
            crossings.book(&departed.crossed);
            splits.extend(departed.splits.take());
            error = error.or(departed.error.take());
        }
        let neighbours = self.exchange.neighbours();
        let mut outgoing: Vec<Vec<u8>> = neighbours.iter().map(|_| Vec::new()).collect();
        let mut own: Vec<(u32, &[u64])> = Vec::new();
        let words = self.borders.record_words();
        for record in departed.iter().flat_map(|leaf| leaf.records.chunks_exact(words)) {
            let to = record[0] as usize;
            if let Some(local) = tree.local(to) {
                own.push((local as u32, record));
                moved.local += 1;
            } else if let Ok(neighbour) = neighbours.binary_search(&tree.owner(to)) {
                let message = &mut outgoing[neighbour];
                // The other rank has its own numbers of leaves.
                message.extend_from_slice(&tree.leaves()[to].key().to_ne_bytes());
                message.extend_from_slice(bytemuck::cast_slice(&record[1..]));
                moved.sent += 1;
            } else {
                error.get_or_insert_with(|| self.borders.stray(record));
            }
        }
        let pending = self.exchange.begin(outgoing);
        let rank = chunks.first().map_or(0, |_| tree.owner(tree.first_own()));
        let messages: Vec<Vec<u64>> =
            pending.finish().iter().map(|bytes| bytemuck::allocation::pod_collect_to_vec(bytes)).collect();
        let (before, after) =
            messages.split_at(self.exchange.neighbours().partition_point(|&neighbour| neighbour < rank));
        let arrivals: Vec<(u32, &[u64])> =
            of_messages(before, tree, words).chain(own).chain(of_messages(after, tree, words)).collect();
        append_all(chunks, &arrivals);
        error.map_or(Ok(moved), Err)
    }
}

/// Own leaf and record, of so many words, of each particle in messages from other ranks.
fn of_messages<'a, const D: usize>(
    messages: &'a [Vec<u64>],
    tree: &'a KnownTree<D>,
    words: usize,
) -> impl Iterator<Item = (u32, &'a [u64])> {
    let records = messages.iter().flat_map(move |message| message.chunks_exact(words));
    records.filter_map(|record| {
        let leaf = tree.locate(record[0]).and_then(|known| tree.local(known))?;
        Some((leaf as u32, record))
    })
}
