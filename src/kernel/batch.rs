//! Batches of particles of a chunk and their columns as lanes.
use super::Select;
use super::simd::{LANES, Lanes};
use crate::particle::chunk::Layout;

/// Up to [`LANES`] particles. Lanes beyond `count` repeat the last one, so that they compute something
/// valid that is never stored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Batch {
    index: [u32; LANES],
    pub count: usize,
    contiguous: bool,
}

impl Batch {
    /// Number of batches of a selection from a chunk of `len` particles.
    pub fn number(select: &Select, len: usize) -> usize {
        match select {
            Select::All => len.div_ceil(LANES),
            Select::List(list) => list.len().div_ceil(LANES),
        }
    }

    /// Batch `i` of a selection from a chunk of `len` particles.
    #[inline(always)]
    pub fn of(select: &Select, len: usize, i: usize) -> Self {
        let first = i * LANES;
        match select {
            Select::All => {
                let count = (len - first).min(LANES);
                let index = std::array::from_fn(|lane| (first + lane.min(count - 1)) as u32);
                Self { index, count, contiguous: count == LANES }
            }
            Select::List(list) => Self::from_indices(&list[first..], |&p| p),
        }
    }

    /// The first particles of a list of anything that names a particle.
    #[inline(always)]
    pub fn from_indices<T>(list: &[T], particle: impl Fn(&T) -> u32) -> Self {
        let count = list.len().min(LANES);
        let index: [u32; LANES] = std::array::from_fn(|lane| particle(&list[lane.min(count - 1)]));
        let contiguous = (0..LANES).all(|lane| index[lane] == index[0].wrapping_add(lane as u32));
        Self { index, count, contiguous }
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
            if let Some(to) = reals[start..start + LANES].first_chunk_mut() {
                values.store(to);
            }
        } else {
            self.store_scattered(reals, column, values);
        }
    }

    #[inline(never)]
    fn store_scattered(&self, reals: &mut [f64], column: usize, values: Lanes) {
        let values = values.to_array();
        for lane in 0..self.count {
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
