//! Batches of particles of a chunk.
use std::ops::Range;

use super::chunk::{Chunk, Layout};
use crate::simd::{LANES, Lanes, Vector};

/// Appends to a list those of some particles whose bits are set by `lanes`, which is called with the first
/// particle of each batch; bits behind the last particle are ignored.
#[inline(always)]
pub fn list_lanes(particles: Range<usize>, list: &mut Vec<u32>, lanes: impl Fn(usize) -> u32) {
    for first in particles.clone().step_by(LANES) {
        let members = LANES.min(particles.end - first);
        let mut left = lanes(first) & ((1 << members) - 1);
        while left != 0 {
            list.push(first as u32 + left.trailing_zeros());
            left &= left - 1;
        }
    }
}

/// Values in a column of [`LANES`] particles from `first` on; values behind the last particle are undefined.
#[inline(always)]
pub fn values<const D: usize>(chunk: &Chunk<D>, column: usize, first: usize) -> Lanes {
    Lanes::new(chunk.values(column, first))
}

/// Positions, as [`values`] gives them.
pub fn positions<const D: usize>(chunk: &Chunk<D>, first: usize) -> [Lanes; D] {
    std::array::from_fn(|axis| values(chunk, Layout::<D>::POSITION + axis, first))
}
