//! Particles change leaves, and with them ranks.
//!
//! The last particles of a leaf fill the gaps of those that left. Arrivals are appended to a leaf in the order of their source leaves along the curve, then in the order
//! they had there. Ranks hold contiguous segments of the curve, so appending the messages of lower ranks,
//! then the own moves, then the messages of higher ranks gives that order on every partition.
use partition::comm::{Comm, NeighbourExchange, Traffic};
use partition::{MAX_LEVEL, Octant};
use rayon::prelude::*;

use super::leaf_bins::positions;
use super::records::{append_all, push_record, record_words};
use super::resample::{Resampling, Splits};
use crate::boundary::Leaving;
use crate::grid::{GridPlan, KnownTree};
use crate::kernel::leavers;
use crate::kernel::simd::LANES;
use crate::particle::chunk::{Chunk, Layout};

const TAG: u16 = 12;

/// Why particles could not be migrated.
#[derive(Debug, thiserror::Error)]
pub enum MigrateError {
    /// A particle has left the domain and the job does not allow it.
    #[error(
        "particle {id} left the domain at {position:?} m (relative to its lower corner); \
         `boundaries.leaving` says what to do with such particles"
    )]
    Left {
        /// Identifier of the particle.
        id: u64,
        /// Position relative to the domain's lower corner, m.
        position: Vec<f64>,
    },
    /// A particle moved beyond the leaves around its own in one step, or its position is not finite.
    #[error("particle {id} moved too far in one step, to {position:?} m; the run has become unstable")]
    TooFar {
        /// Identifier of the particle.
        id: u64,
        /// Position relative to the domain's lower corner, m.
        position: Vec<f64>,
    },
}

/// Where a particle goes.
enum Destination {
    Stay,
    Leaf(u32),
    Gone,
}

/// Moves particles to the leaves that contain them.
pub struct Migration<const D: usize> {
    exchange: NeighbourExchange,
    pub(super) borders: Borders<D>,
}

/// The boxes of the own leaves, and what happens to particles outside them.
pub struct Borders<const D: usize> {
    boxes: Vec<([f64; D], [f64; D])>,
    rule: Rule,
}

/// How the destination of a particle is found.
#[derive(Clone, Copy)]
struct Rule {
    leaving: Leaving,
    root_edge: f64,
}

/// Particles that left their leaf in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// To another leaf of the same rank.
    pub local: u64,
    /// To another rank.
    pub sent: u64,
    /// Out of the domain, and removed.
    pub deleted: u64,
}

/// What has been taken out of one leaf.
#[derive(Debug, Default)]
pub(super) struct Departed {
    /// Records of the particles that go to other leaves, in their order.
    records: Vec<u64>,
    /// Number of particles out of the domain.
    deleted: u64,
    /// Why nothing was taken out.
    error: Option<MigrateError>,
    /// Splits of those that enter finer leaves.
    splits: Option<Splits>,
}

impl Departed {
    /// Whether there is anything to tell.
    pub fn is_any(&self) -> bool {
        !self.records.is_empty() || self.deleted > 0 || self.error.is_some() || self.splits.is_some()
    }

    /// Takes particles, ascending, out of a chunk.
    fn take<const D: usize>(chunk: &mut Chunk<D>, leavers: &[(u32, Destination)]) -> Self {
        let mut departed = Self::default();
        if leavers.is_empty() {
            return departed;
        }
        departed.records.reserve_exact(leavers.len() * record_words::<D>());
        for (p, destination) in leavers {
            match *destination {
                Destination::Leaf(to) => {
                    push_record(&mut departed.records, u64::from(to), chunk, *p as usize);
                }
                Destination::Gone => departed.deleted += 1,
                Destination::Stay => {}
            }
        }
        let gone: Vec<u32> = leavers.iter().map(|&(p, _)| p).collect();
        chunk.remove(&gone);
        departed
    }
}

impl<const D: usize> Borders<D> {
    /// Lower and upper corner of an own leaf, m.
    pub(super) fn of_leaf(&self, leaf: usize) -> &([f64; D], [f64; D]) {
        &self.boxes[leaf]
    }

    /// Not collective. Takes out of an own leaf the particles `outside` its box (ascending) that belong to another or to
    /// none. With `resampling`, particles that enter a leaf finer than they were made for become their children before.
    pub(super) fn depart(
        &self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        outside: &[u32],
        resampling: Option<&Resampling<'_, D>>,
    ) -> Departed {
        if outside.is_empty() {
            return Departed::default();
        }
        let known = tree.first_own() + leaf;
        let bounds = self.of_leaf(leaf);
        let (leavers, splits) = self.rule.leavers_resampled(tree, known, chunk, bounds, outside, resampling);
        let departed = match leavers {
            Ok(leavers) => Departed::take(chunk, &leavers),
            Err(error) => Departed { error: Some(error), ..Departed::default() },
        };
        Departed { splits: resampling.map(|_| splits), ..departed }
    }
}

impl<const D: usize> Migration<D> {
    /// Not collective. `neighbours` must be those of the plan's arena exchange.
    pub fn new(comm: &Comm, plan: &GridPlan<D>, neighbours: Vec<usize>, leaving: Leaving) -> Self {
        let own = plan.tree.first_own()..plan.tree.first_own() + plan.leaf_start.len() - 1;
        let boxes = plan.tree.leaves()[own].iter().map(|leaf| leaf_box(leaf, plan.root_edge)).collect();
        let exchange = NeighbourExchange::new(comm, neighbours, TAG);
        Self { exchange, borders: Borders { boxes, rule: Rule { leaving, root_edge: plan.root_edge } } }
    }

    /// Messages and bytes so far.
    pub fn traffic(&self) -> Traffic {
        self.exchange.traffic()
    }

    /// Collective over neighbours. Moves every particle into the leaf that contains it; see [`Borders::depart`] and
    /// [`Migration::arrive`].
    ///
    /// # Errors
    /// As those of [`Migration::arrive`].
    pub(super) fn migrate(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        resampling: Option<&Resampling<'_, D>>,
        splits: &mut Vec<Splits>,
    ) -> Result<Moved, MigrateError> {
        let borders = &self.borders;
        let leaves = chunks.par_iter_mut().enumerate().with_min_len(4);
        let departed = leaves.map(|(leaf, chunk)| {
            let outside = outside(chunk, borders.of_leaf(leaf));
            borders.depart(tree, leaf, chunk, &outside, resampling)
        });
        let departed = departed.collect();
        self.arrive(tree, chunks, departed, splits)
    }

    /// Collective over neighbours. Moves particles (per own leaf, ascending) into the leaves that contain the places given
    /// with them, which must be in or next to their leaf; they stay where they are in space.
    pub(super) fn gather(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        wanted: &[Vec<(u32, [f64; D])>],
    ) -> Result<Moved, MigrateError> {
        let (roots, root_edge) = (tree.brick().roots, self.borders.rule.root_edge);
        let destination = |leaf: usize, place: [f64; D]| {
            let to = tree.locate(position_key(place, roots, root_edge));
            to.filter(|&to| to != tree.first_own() + leaf).map(|to| Destination::Leaf(to as u32))
        };
        let leaves = chunks.par_iter_mut().zip(wanted).enumerate().with_min_len(32);
        let departed = leaves.map(|(leaf, (chunk, wanted))| {
            let known = wanted.iter().filter_map(|&(p, place)| Some((p, destination(leaf, place)?)));
            Departed::take(chunk, &known.collect::<Vec<_>>())
        });
        let departed = departed.collect();
        self.arrive(tree, chunks, departed, &mut Vec::new())
    }

    /// Collective over neighbours. Appends what has departed from each own leaf, here and on other ranks, to where it
    /// goes. Appends what splits on the way did to `splits`.
    ///
    /// # Errors
    /// [`MigrateError`] on the rank that found it; the caller makes it collective. The exchange is completed
    /// in any case.
    pub(super) fn arrive(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        mut departed: Vec<Departed>,
        splits: &mut Vec<Splits>,
    ) -> Result<Moved, MigrateError> {
        let mut error = None;
        let mut moved = Moved::default();
        for departed in &mut departed {
            moved.deleted += departed.deleted;
            splits.extend(departed.splits.take());
            error = error.or(departed.error.take());
        }
        let neighbours = self.exchange.neighbours();
        let mut outgoing: Vec<Vec<u8>> = neighbours.iter().map(|_| Vec::new()).collect();
        let mut own: Vec<(u32, &[u64])> = Vec::new();
        for record in departed.iter().flat_map(|leaf| leaf.records.chunks_exact(record_words::<D>())) {
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
                error.get_or_insert_with(|| stray::<D>(record));
            }
        }
        let pending = self.exchange.begin(outgoing);
        let rank = chunks.first().map_or(0, |_| tree.owner(tree.first_own()));
        let messages: Vec<Vec<u64>> =
            pending.finish().iter().map(|bytes| bytemuck::allocation::pod_collect_to_vec(bytes)).collect();
        let (before, after) =
            messages.split_at(self.exchange.neighbours().partition_point(|&neighbour| neighbour < rank));
        let arrivals: Vec<(u32, &[u64])> =
            of_messages::<D>(before, tree).chain(own).chain(of_messages::<D>(after, tree)).collect();
        append_all(chunks, &arrivals);
        error.map_or(Ok(moved), Err)
    }
}

/// Own leaf and record of each particle in messages from other ranks.
fn of_messages<'a, const D: usize>(
    messages: &'a [Vec<u64>],
    tree: &'a KnownTree<D>,
) -> impl Iterator<Item = (u32, &'a [u64])> {
    let records = messages.iter().flat_map(|words| words.chunks_exact(record_words::<D>()));
    records.filter_map(|record| {
        let leaf = tree.locate(record[0]).and_then(|known| tree.local(known))?;
        Some((leaf as u32, record))
    })
}

/// Particles that leave a leaf, ascending, with where they go.
type Leavers = Result<Vec<(u32, Destination)>, MigrateError>;

impl Rule {
    /// As [`Rule::leavers`], after splitting those that enter a leaf finer than they were made for; children
    /// go each their own way.
    fn leavers_resampled<const D: usize>(
        self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        bounds: &([f64; D], [f64; D]),
        outside: &[u32],
        resampling: Option<&Resampling<'_, D>>,
    ) -> (Leavers, Splits) {
        let mut splits = Splits::default();
        let mut leavers = self.leavers(tree, leaf, chunk, outside);
        loop {
            let (Some(resampling), Ok(found)) = (resampling, &leavers) else { return (leavers, splits) };
            let entries = found.iter().filter_map(|(p, destination)| match destination {
                Destination::Leaf(to) => Some((*p, tree.leaves()[*to as usize].level)),
                Destination::Stay | Destination::Gone => None,
            });
            let level = tree.leaves()[leaf].level;
            if found.is_empty() || !resampling.enter(chunk, level, entries, &mut splits) {
                return (leavers, splits);
            }
            leavers = self.leavers(tree, leaf, chunk, &self::outside(chunk, bounds));
        }
    }

    /// Those among the particles `outside` the box of a leaf that are not in the leaf, with their destinations, in order.
    fn leavers<const D: usize>(
        self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        outside: &[u32],
    ) -> Leavers {
        let mut leavers = Vec::with_capacity(outside.len());
        for &p in outside {
            match self.destination(tree, leaf, chunk, p as usize)? {
                Destination::Stay => {}
                destination => leavers.push((p, destination)),
            }
        }
        Ok(leavers)
    }

    fn destination<const D: usize>(
        self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        p: usize,
    ) -> Result<Destination, MigrateError> {
        let mut position = chunk.position(p);
        if position.iter().any(|x| !x.is_finite()) {
            return Err(too_far(chunk, p));
        }
        let roots = tree.brick().roots;
        let extent: [f64; D] = std::array::from_fn(|axis| f64::from(roots[axis]) * self.root_edge);
        if (0..D).any(|axis| position[axis] < 0.0 || position[axis] >= extent[axis]) {
            match self.leaving {
                Leaving::Delete => return Ok(Destination::Gone),
                Leaving::Error => {
                    return Err(MigrateError::Left { id: chunk.ids()[p], position: position.to_vec() });
                }
                Leaving::Clamp => {
                    for axis in 0..D {
                        position[axis] = position[axis].clamp(0.0, extent[axis].next_down());
                        chunk.column_mut(Layout::<D>::POSITION + axis)[p] = position[axis];
                    }
                }
            }
        }
        let key = position_key(position, roots, self.root_edge);
        match tree.locate(key) {
            Some(to) if to == leaf => Ok(Destination::Stay),
            Some(to) => Ok(Destination::Leaf(to as u32)),
            None => Err(too_far(chunk, p)),
        }
    }
}

/// Particles that are not in a box, in order; one whose position is not a number is in none.
fn outside<const D: usize>(chunk: &Chunk<D>, bounds: &([f64; D], [f64; D])) -> Vec<u32> {
    let mut leavers = leavers::Leavers::default();
    leavers.begin(bounds);
    let mut found = Vec::new();
    for first in (0..chunk.len()).step_by(LANES) {
        let inside = leavers.inside(&positions(chunk, first));
        // Nearly all particles stay.
        if !inside.all() {
            let lanes = 0..LANES.min(chunk.len() - first);
            let left = lanes.filter(|lane| inside.bits() >> lane & 1 == 0);
            found.extend(left.map(|lane| (first + lane) as u32));
        }
    }
    found
}

/// Key of the finest-level octant that contains a position inside the domain. Leaf membership of particles
/// is defined by this function alone.
pub fn position_key<const D: usize>(position: [f64; D], roots: [u32; D], root_edge: f64) -> u64 {
    let scale = f64::from(1u32 << MAX_LEVEL) / root_edge;
    let coord: [u32; D] = std::array::from_fn(|axis| {
        let last = (roots[axis] << MAX_LEVEL) - 1;
        ((position[axis] * scale) as u32).min(last)
    });
    Octant { level: MAX_LEVEL, coord }.key()
}

/// Lower and upper corner of a leaf relative to the domain's lower corner, m.
pub fn leaf_box<const D: usize>(leaf: &Octant<D>, root_edge: f64) -> ([f64; D], [f64; D]) {
    let edge = root_edge / f64::from(1u32 << leaf.level);
    (leaf.coord.map(|c| f64::from(c) * edge), leaf.coord.map(|c| f64::from(c + 1) * edge))
}

/// The error of a particle whose new leaf belongs to a rank that is no neighbour.
fn stray<const D: usize>(record: &[u64]) -> MigrateError {
    let column = |column: usize| f64::from_bits(record[1 + column]);
    let position = (0..D).map(|axis| column(Layout::<D>::POSITION + axis)).collect();
    MigrateError::TooFar { id: record[1 + Layout::<D>::REALS], position }
}

fn too_far<const D: usize>(chunk: &Chunk<D>, p: usize) -> MigrateError {
    MigrateError::TooFar { id: chunk.ids()[p], position: chunk.position(p).to_vec() }
}
