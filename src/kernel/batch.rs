//! Batches of particles of a chunk and their columns as lanes.
use super::Select;
use super::simd::{LANES, Lanes, Mask, prefetch};
use crate::particle::chunk::Layout;

/// How far ahead columns are asked for, in particles: a batch at a time is too many streams for the
/// processor to foresee.
const AHEAD: usize = 2 * LANES;

/// Up to [`LANES`] particles. Lanes that are no members compute something that is never stored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Batch {
    index: [u32; LANES],
    /// Bit i tells whether lane i is a member.
    lanes: u32,
    /// Lane i is particle `index[0] + i`, member or not.
    contiguous: bool,
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
}

impl<'a> Batches<'a> {
    /// Batches of a selection from a chunk of `len` particles in columns of `stride` numbers.
    pub fn new(select: Select<'a>, len: usize, stride: usize) -> Self {
        Self { select, len, stride, taken: 0 }
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
                // Columns have room for whole batches.
                let count = (self.len - first).min(LANES);
                self.taken += LANES;
                let index = std::array::from_fn(|lane| (first + lane.min(count - 1)) as u32);
                Some(Batch { index, lanes: ALL >> (LANES - count), contiguous: true })
            }
            Select::List(list) => {
                let rest = &list[self.taken..];
                if rest.is_empty() {
                    return None;
                }
                let (batch, count) = Batch::of_list(rest, self.stride);
                self.taken += count;
                Some(batch)
            }
        }
    }
}

impl Batch {
    /// The first particles of a list, and their number. Where at least half of the next [`LANES`] particles of the chunk
    /// are on the list, as is usual beside level jumps, these are read as they stand; elsewhere they are picked.
    #[inline(never)]
    fn of_list(list: &[u32], stride: usize) -> (Self, usize) {
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
        if (count >= LANES / 2 || count == list.len()) && end as usize <= stride {
            return (Self { index, lanes, contiguous: true }, count);
        }
        (Self::from_indices(list, |&p| p), list.len().min(LANES))
    }

    /// The first particles of a list of anything that names a particle, which may do so several times.
    #[inline(always)]
    pub fn from_indices<T>(list: &[T], particle: impl Fn(&T) -> u32) -> Self {
        let count = list.len().min(LANES);
        let index: [u32; LANES] = std::array::from_fn(|lane| particle(&list[lane.min(count - 1)]));
        Self { index, lanes: ALL >> (LANES - count), contiguous: false }
    }

    /// Lanes that are members, in order.
    #[inline(always)]
    pub fn members(&self) -> impl Iterator<Item = usize> + use<> {
        let mut left = self.lanes;
        std::iter::from_fn(move || {
            let lane = left.trailing_zeros() as usize;
            left &= left.wrapping_sub(1);
            (lane < LANES).then_some(lane)
        })
    }

    /// `values` of members, 0 elsewhere.
    #[inline(always)]
    pub fn of_members(&self, values: Lanes) -> Lanes {
        self.merged(values, Lanes::splat(0.0))
    }

    /// `values` of members, `others` elsewhere.
    #[inline(always)]
    fn merged(&self, values: Lanes, others: Lanes) -> Lanes {
        if self.lanes == ALL { values } else { Mask::from_bits(self.lanes).select(values, others) }
    }

    /// Particle of a lane.
    #[inline(always)]
    pub fn particle(&self, lane: usize) -> usize {
        self.index[lane] as usize
    }

    /// Reads a column.
    #[inline(always)]
    pub fn load(&self, reals: &[f64], stride: usize, column: usize) -> Lanes {
        let column = column * stride;
        if self.contiguous {
            let start = column + self.particle(0);
            prefetch(reals, start + AHEAD);
            match reals[start..start + LANES].first_chunk() {
                Some(values) => Lanes::load(values),
                None => Lanes::splat(0.0),
            }
        } else {
            self.load_scattered(reals, column)
        }
    }

    #[inline(never)]
    fn load_scattered(&self, reals: &[f64], column: usize) -> Lanes {
        Lanes::new(std::array::from_fn(|lane| reals[column + self.particle(lane)]))
    }

    /// Writes a column.
    #[inline(always)]
    pub fn store(&self, reals: &mut [f64], stride: usize, column: usize, values: Lanes) {
        let column = column * stride;
        if self.contiguous {
            let start = column + self.particle(0);
            prefetch(reals, start + AHEAD);
            if let Some(to) = reals[start..start + LANES].first_chunk_mut() {
                self.merged(values, Lanes::load(to)).store(to);
            }
        } else {
            self.store_scattered(reals, column, values);
        }
    }

    #[inline(never)]
    fn store_scattered(&self, reals: &mut [f64], column: usize, values: Lanes) {
        let values = values.to_array();
        for lane in self.members() {
            reals[column + self.particle(lane)] = values[lane];
        }
    }

    /// Positions.
    #[inline(always)]
    pub fn positions<const D: usize>(&self, reals: &[f64], stride: usize) -> [Lanes; D] {
        let mut position = [Lanes::splat(0.0); D];
        for axis in 0..D {
            position[axis] = self.load(reals, stride, Layout::<D>::POSITION + axis);
        }
        position
    }

    /// Material index of each lane.
    #[inline(always)]
    pub fn materials(&self, tags: &[u64]) -> [u16; LANES] {
        // The material is the low half word of a packed tag.
        std::array::from_fn(|lane| tags[self.particle(lane)] as u16)
    }
}
