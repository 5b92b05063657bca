//! Particles change leaves, and with them ranks.
//!
//! The last particles of a leaf fill the gaps of those that left. Arrivals are appended to a leaf in the order of their source leaves along the curve, then in the order
//! they had there. Ranks hold contiguous segments of the curve, so appending the messages of lower ranks,
//! then the own moves, then the messages of higher ranks gives that order on every partition.
use partition::comm::{Comm, NeighbourExchange, Traffic};
use partition::{MAX_LEVEL, Octant};
use rayon::prelude::*;

use super::records::{append_all, push_record, record_words};
use super::resample::{Resampling, Splits};
use crate::boundary::Leaving;
use crate::grid::{GridPlan, KnownTree};
use crate::kernel::simd::{LANES, Lanes, Mask};
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

impl<const D: usize> Migration<D> {
    /// Not collective. `neighbours` must be those of the plan's arena exchange.
    pub fn new(comm: &Comm, plan: &GridPlan<D>, neighbours: Vec<usize>, leaving: Leaving) -> Self {
        let own = plan.tree.first_own()..plan.tree.first_own() + plan.leaf_start.len() - 1;
        let boxes = plan.tree.leaves()[own].iter().map(|leaf| leaf_box(leaf, plan.root_edge)).collect();
        let exchange = NeighbourExchange::new(comm, neighbours, TAG);
        Self { exchange, boxes, rule: Rule { leaving, root_edge: plan.root_edge } }
    }

    /// Messages and bytes so far.
    pub fn traffic(&self) -> Traffic {
        self.exchange.traffic()
    }

    /// Collective over neighbours. Moves every particle into the leaf that contains it. With `resampling`, particles that
    /// enter a leaf finer than they were made for become their children on the way; what that did is appended to
    /// `splits`.
    ///
    /// # Errors
    /// [`MigrateError`] on the rank that found it; the caller makes it collective. The exchange is completed
    /// in any case.
    pub(super) fn migrate(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        resampling: Option<&Resampling<'_, D>>,
        splits: &mut Vec<Splits>,
    ) -> Result<Moved, MigrateError> {
        let (first, rule) = (tree.first_own(), self.rule);
        let found: Vec<(Leavers, Splits)> = chunks
            .par_iter_mut()
            .zip(&self.boxes)
            .enumerate()
            .with_min_len(4)
            .map(|(leaf, (chunk, bounds))| {
                rule.leavers_resampled(tree, first + leaf, chunk, bounds, resampling)
            })
            .collect();
        let mut all = Vec::with_capacity(found.len());
        for (leavers, split) in found {
            if resampling.is_some() {
                splits.push(split);
            }
            all.push(leavers);
        }
        self.carry(tree, chunks, all)
    }

    /// Collective over neighbours. Moves particles (per own leaf, ascending) into the leaves that contain the places given
    /// with them, which must be in or next to their leaf; they stay where they are in space.
    pub(super) fn gather(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        wanted: &[Vec<(u32, [f64; D])>],
    ) -> Result<Moved, MigrateError> {
        let roots = tree.brick().roots;
        let destination = |leaf: usize, place: [f64; D]| {
            let to = tree.locate(position_key(place, roots, self.rule.root_edge));
            to.filter(|&to| to != tree.first_own() + leaf).map(|to| Destination::Leaf(to as u32))
        };
        let each = wanted.iter().enumerate().map(|(leaf, wanted)| {
            let known = wanted.iter().filter_map(|&(p, place)| Some((p, destination(leaf, place)?)));
            Ok(known.collect())
        });
        let each = each.collect();
        self.carry(tree, chunks, each)
    }

    /// Collective over neighbours. Moves what was found to leave each own leaf.
    fn carry(
        &mut self,
        tree: &KnownTree<D>,
        chunks: &mut [Chunk<D>],
        found: Vec<Leavers>,
    ) -> Result<Moved, MigrateError> {
        let mut error = None;
        let mut moved = Moved::default();
        let mut leaving: Vec<(usize, Vec<(u32, Destination)>)> = Vec::new();
        for (leaf, found) in found.into_iter().enumerate() {
            match found {
                Ok(found) if found.is_empty() => {}
                Ok(found) => leaving.push((leaf, found)),
                Err(found) => {
                    error.get_or_insert(found);
                }
            }
        }
        let records: Vec<Vec<u64>> = leaving
            .par_iter()
            .with_min_len(16)
            .map(|(leaf, found)| {
                let mut records = Vec::with_capacity(found.len() * record_words::<D>());
                for (p, destination) in found {
                    if let Destination::Leaf(to) = *destination {
                        push_record(&mut records, u64::from(to), &chunks[*leaf], *p as usize);
                    }
                }
                records
            })
            .collect();

        let neighbours = self.exchange.neighbours();
        let mut outgoing: Vec<Vec<u8>> = neighbours.iter().map(|_| Vec::new()).collect();
        let mut own: Vec<(u32, &[u64])> = Vec::new();
        for record in records.iter().flat_map(|records| records.chunks_exact(record_words::<D>())) {
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
        let mut gone = vec![Vec::new(); chunks.len()];
        for (leaf, found) in leaving {
            moved.deleted += found.iter().filter(|(_, to)| matches!(to, Destination::Gone)).count() as u64;
            gone[leaf] = found.into_iter().map(|(p, _)| p).collect();
        }
        let some = chunks.par_iter_mut().zip(&gone).with_min_len(32).filter(|(_, gone)| !gone.is_empty());
        some.for_each(|(chunk, gone)| chunk.remove(gone));

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
        resampling: Option<&Resampling<'_, D>>,
    ) -> (Leavers, Splits) {
        let mut splits = Splits::default();
        loop {
            let leavers = self.leavers(tree, leaf, chunk, bounds);
            let (Some(resampling), Ok(found)) = (resampling, &leavers) else { return (leavers, splits) };
            let entries = found.iter().filter_map(|(p, destination)| match destination {
                Destination::Leaf(to) => Some((*p, tree.leaves()[*to as usize].level)),
                Destination::Stay | Destination::Gone => None,
            });
            let level = tree.leaves()[leaf].level;
            if found.is_empty() || !resampling.enter(chunk, level, entries, &mut splits) {
                return (leavers, splits);
            }
        }
    }

    /// Particles of one leaf that are outside it, with their destinations, in order.
    fn leavers<const D: usize>(
        self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        (lower, upper): &([f64; D], [f64; D]),
    ) -> Leavers {
        let mut leavers = Vec::new();
        for p in outside(chunk, lower, upper) {
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
fn outside<const D: usize>(chunk: &Chunk<D>, lower: &[f64; D], upper: &[f64; D]) -> Vec<u32> {
    let (reals, stride) = chunk.reals();
    let mut found = Vec::new();
    for first in (0..chunk.len()).step_by(LANES) {
        let mut inside = !Mask::from_bits(0);
        for axis in 0..D {
            // Columns hold whole batches; what lies behind the last particle is passed over below.
            let column = &reals[(Layout::<D>::POSITION + axis) * stride + first..];
            let x = column.first_chunk().map_or(Lanes::splat(f64::NAN), Lanes::load);
            inside = inside & Lanes::splat(lower[axis]).le(x) & x.lt(Lanes::splat(upper[axis]));
        }
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
