//! The affine matrix of a particle.
use crate::kernel::Transfer;
use crate::particle::chunk::{Chunk, Layout};

/// Velocity gradient (1/s) that a transfer keeps in the affine matrix of a particle whose weights have these
/// second moments, m².
pub(super) fn gradient<const D: usize>(
    transfer: Transfer,
    matrix: &[[f64; D]; D],
    spread: &[f64; D],
) -> [[f64; D]; D] {
    match transfer {
        Transfer::Apic => matrix.map(|row| std::array::from_fn(|k| row[k] / spread[k])),
        _ => *matrix,
    }
}

/// The affine columns of particle `p` as a matrix.
pub(super) fn read_matrix<const D: usize>(chunk: &Chunk<D>, p: usize) -> [[f64; D]; D] {
    std::array::from_fn(|i| chunk.read(Layout::<D>::AFFINE + D * i, p))
}

/// Writes the affine columns of particle `p` from a matrix.
pub(super) fn write_matrix<const D: usize>(chunk: &mut Chunk<D>, p: usize, matrix: &[[f64; D]; D]) {
    for (i, row) in matrix.iter().enumerate() {
        chunk.write(Layout::<D>::AFFINE + D * i, p, row);
    }
}
