//! Batches of particles of a chunk and their columns as lanes.
use super::Select;
use super::simd::{LANES, Vector, VectorMask, prefetch};
use crate::particle::chunk::{Chunk, Layout, Place};

/// How far ahead columns are asked for, in particles, in the next chunk where this one ends: a batch at a time is too
/// many streams for the processor to foresee, and in 2D a column is over after a few lines.
const AHEAD: usize = 2 * LANES;

/// Up to [`LANES`] particles. Lanes that are no members compute something that is never stored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Batch {
    index: [u32; LANES],
    /// Bit i tells whether lane i is a member.
    lanes: u32,
    /// Lane i is particle `index[0] + i`, member or not.
    contiguous: bool,
    /// What a later batch will read.
    ahead: Place,
}

/// All lanes are members.
const ALL: u32 = (1 << LANES) - 1;

/// The batches of a selection, in order.
pub(super) struct Batches<'a> {
    select: Select<'a>,
    /// Particles of the chunk.
    len: usize,
    /// Room of its columns.
    stride: usize,
    /// Members taken so far.
    taken: usize,
    place: Place,
    next: Place,
}

impl<'a> Batches<'a> {
    /// Batches of a selection from a chunk. `next` is the place of the chunk to be read after it.
    pub fn new<const D: usize>(select: Select<'a>, chunk: &Chunk<D>, next: Place) -> Self {
        let place = chunk.place();
        Self { select, len: chunk.len(), stride: chunk.capacity(), taken: 0, place, next }
    }

    /// The next particles of the chunk. Columns have room for whole batches.
    #[inline(always)]
    fn whole(&self) -> Batch {
        let first = self.taken;
        let count = (self.len - first).min(LANES);
        let index = std::array::from_fn(|lane| (first + lane.min(count - 1)) as u32);
        Batch { index, lanes: ALL >> (LANES - count), contiguous: true, ahead: self.ahead(first) }
    }

    /// Where to read ahead while the particles from `first` on are at work.
    #[inline(always)]
    fn ahead(&self, first: usize) -> Place {
        let rows = self.len.next_multiple_of(LANES);
        let (place, particle) = match first + AHEAD {
            particle if particle < rows => (self.place, particle),
            particle if self.next.columns != 0 => (self.next, particle - rows),
            _ => (self.place, first),
        };
        let bytes = particle * size_of::<f64>();
        Place { columns: place.columns + bytes, stride: place.stride, tags: place.tags + bytes }
    }
}

impl Iterator for Batches<'_> {
    type Item = Batch;

    #[inline(always)]
    fn next(&mut self) -> Option<Batch> {
        match self.select {
            Select::All => {
                let first = self.taken;
                if first >= self.len {
                    return None;
                }
                let batch = self.whole();
                self.taken += LANES;
                Some(batch)
            }
            Select::List(list) => {
                let rest = &list[self.taken..];
                if rest.is_empty() {
                    return None;
                }
                let (batch, count) = Batch::of_list(rest, self.stride);
                self.taken += count;
                Some(Batch { ahead: self.ahead(rest[0] as usize), ..batch })
            }
        }
    }
}

impl Batch {
    /// Up to [`LANES`] particles, at least one, lane by lane.
    #[inline(always)]
    pub fn of_particles(list: &[u32]) -> Self {
        match list.first_chunk() {
            Some(next) if is_run(next) => {
                Self { index: *next, lanes: ALL, contiguous: true, ahead: Place::default() }
            }
            _ => Self::from_indices(list, |&p| p),
        }
    }

    /// The first particles of a list, and their number. Where at least a quarter of the next [`LANES`] particles of the chunk
    /// are on the list, as is usual beside level jumps, these are read as they stand; elsewhere they are picked.
    #[inline(always)]
    fn of_list(list: &[u32], stride: usize) -> (Self, usize) {
        if let Some(next) = list.first_chunk::<LANES>()
            && is_run(next)
        {
            let batch = Self { index: *next, lanes: ALL, contiguous: true, ahead: Place::default() };
            return (batch, LANES);
        }
        Self::of_gaps(list, stride)
    }

    /// As [`Batch::of_list`], for lists with gaps.
    #[inline(never)]
    fn of_gaps(list: &[u32], stride: usize) -> (Self, usize) {
        let first = list[0];
        let end = first + LANES as u32;
        let (mut index, mut lanes, mut count, mut least) = ([first; LANES], 0, 0, first);
        for &p in list.iter().take(LANES) {
            if p < least || p >= end {
                break;
            }
            index[(p - first) as usize] = p;
            lanes |= 1 << (p - first);
            count += 1;
            least = p + 1;
        }
        if (count >= LANES / 4 || count == list.len()) && end as usize <= stride {
            return (Self { index, lanes, contiguous: true, ahead: Place::default() }, count);
        }
        (Self::from_indices(list, |&p| p), list.len().min(LANES))
    }

    /// The first particles of a list of anything that names a particle, which may do so several times.
    #[inline(always)]
    pub fn from_indices<T>(list: &[T], particle: impl Fn(&T) -> u32) -> Self {
        let count = list.len().min(LANES);
        let index: [u32; LANES] = std::array::from_fn(|lane| particle(&list[lane.min(count - 1)]));
        Self { index, lanes: ALL >> (LANES - count), contiguous: false, ahead: Place::default() }
    }

    /// Lanes that are members, in order.
    #[inline(always)]
    pub fn members(&self) -> impl Iterator<Item = usize> + use<> {
        lanes_in(self.lanes)
    }

    /// Which of some lanes, a bit each, are members.
    #[inline(always)]
    pub fn members_among(&self, lanes: u32) -> u32 {
        self.lanes & lanes
    }

    /// `values` of members, 0 elsewhere.
    #[inline(always)]
    pub fn of_members<V: Vector>(&self, values: V) -> V {
        self.merged(values, V::splat(0.0))
    }

    /// `values` of members, `others` elsewhere.
    #[inline(always)]
    fn merged<V: Vector>(&self, values: V, others: V) -> V {
        if self.lanes == ALL { values } else { V::Mask::from_bits(self.lanes).select(values, others) }
    }

    /// Particle of a lane.
    #[inline(always)]
    pub fn particle(&self, lane: usize) -> usize {
        self.index[lane] as usize
    }

    /// Asks for what a later batch will read of a column.
    #[inline(always)]
    fn read_ahead(&self, column: usize) {
        prefetch(self.ahead.columns.wrapping_add(column * self.ahead.stride));
    }

    /// Reads a column.
    #[inline(always)]
    pub fn load<V: Vector>(&self, reals: &[f64], stride: usize, column: usize) -> V {
        if self.contiguous {
            let start = column * stride + self.particle(0);
            self.read_ahead(column);
            match reals[start..start + LANES].first_chunk() {
                Some(values) => V::load(values),
                None => V::splat(0.0),
            }
        } else {
            V::load(&self.load_scattered(reals, column * stride))
        }
    }

    #[inline(never)]
    fn load_scattered(&self, reals: &[f64], column: usize) -> [f64; LANES] {
        std::array::from_fn(|lane| reals[column + self.particle(lane)])
    }

    /// Writes a column.
    #[inline(always)]
    pub fn store<V: Vector>(&self, reals: &mut [f64], stride: usize, column: usize, values: V) {
        if self.contiguous {
            let start = column * stride + self.particle(0);
            self.read_ahead(column);
            if let Some(to) = reals[start..start + LANES].first_chunk_mut() {
                self.merged(values, V::load(to)).store(to);
            }
        } else {
            self.store_scattered(reals, column * stride, &values.to_array());
        }
    }

    #[inline(never)]
    fn store_scattered(&self, reals: &mut [f64], column: usize, values: &[f64; LANES]) {
        for lane in self.members() {
            reals[column + self.particle(lane)] = values[lane];
        }
    }

    /// Positions.
    #[inline(always)]
    pub fn positions<V: Vector, const D: usize>(&self, reals: &[f64], stride: usize) -> [V; D] {
        let mut position = [V::splat(0.0); D];
        for axis in 0..D {
            position[axis] = self.load(reals, stride, Layout::<D>::POSITION + axis);
        }
        position
    }

    /// Material index of each lane.
    #[inline(always)]
    pub fn materials(&self, tags: &[u64]) -> [u16; LANES] {
        prefetch(self.ahead.tags);
        // The material is the low half word of a packed tag.
        std::array::from_fn(|lane| tags[self.particle(lane)] as u16)
    }
}

/// Whether particles follow each other in the chunk. All are looked at: members of a family come in any order.
#[inline(always)]
fn is_run(list: &[u32; LANES]) -> bool {
    (0..LANES).fold(true, |is_run, lane| is_run & (list[lane] == list[0].wrapping_add(lane as u32)))
}

/// The lanes of a set that has a bit for each.
#[inline(always)]
pub(super) fn lanes_in(mut set: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = set.trailing_zeros() as usize;
        set &= set.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}
