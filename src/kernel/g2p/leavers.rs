//! Particles that leave the box of their leaf, found by G2P while their new positions are in registers.
use crate::kernel::batch::Batch;
use crate::particle::Chunk;
use crate::simd::{LANES, Vector, VectorMask};

/// Finds particles that are no longer in a box once they have moved.
#[derive(Clone, Debug)]
pub struct Leavers<const D: usize> {
    lower: [f64; D],
    upper: [f64; D],
    /// Their indices, in the order in which they moved.
    pub found: Vec<u32>,
}

impl<const D: usize> Default for Leavers<D> {
    /// With a box that contains every position.
    fn default() -> Self {
        Self { lower: [f64::NEG_INFINITY; D], upper: [f64::INFINITY; D], found: Vec::new() }
    }
}

impl<const D: usize> Leavers<D> {
    /// Clears the list; from now on particles belong in the box `lower <= x < upper`.
    pub fn begin(&mut self, (lower, upper): &([f64; D], [f64; D])) {
        (self.lower, self.upper) = (*lower, *upper);
        self.found.clear();
    }

    /// Lanes of positions in the box; one that is not a number is not.
    #[inline(always)]
    pub fn inside<V: Vector>(&self, position: &[V; D]) -> V::Mask {
        let mut inside = !V::Mask::from_bits(0);
        for axis in 0..D {
            let (lower, upper) = (V::splat(self.lower[axis]), V::splat(self.upper[axis]));
            inside = inside & lower.le(position[axis]) & position[axis].lt(upper);
        }
        inside
    }

    /// Lists those of some particles of a chunk that are outside, after they have been moved once more.
    pub fn look_again(&mut self, chunk: &Chunk<D>, moved: &[u32]) {
        let is_inside = |p: u32| {
            let x = chunk.position(p as usize);
            (0..D).all(|a| self.lower[a] <= x[a] && x[a] < self.upper[a])
        };
        let outside: Vec<u32> = moved.iter().copied().filter(|&p| !is_inside(p)).collect();
        if !outside.is_empty() {
            self.found.extend(outside);
            self.found.sort_unstable();
            self.found.dedup();
        }
    }

    /// Lists the members of a batch that moved out.
    #[inline(always)]
    pub(super) fn look<V: Vector>(&mut self, batch: &Batch, moved: &[V; D]) {
        let left = batch.members_among(!self.inside(moved).bits());
        // Nearly all particles stay.
        if left != 0 {
            self.note(batch, left);
        }
    }

    #[inline(never)]
    fn note(&mut self, batch: &Batch, left: u32) {
        let lanes = (0..LANES).filter(|lane| left >> lane & 1 == 1);
        self.found.extend(lanes.map(|lane| batch.particle(lane) as u32));
    }
}
