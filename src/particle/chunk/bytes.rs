//! Chunks as bytes, for other ranks of the same job.
use bytemuck::{cast_slice, cast_slice_mut};

use super::{Chunk, Layout};
use crate::particle::widest::Widest;

impl<const D: usize> Chunk<D> {
    /// Appends the particles as bytes: the number of carried columns, then all columns. Nothing without
    /// particles.
    pub fn append_to(&self, bytes: &mut Vec<u8>) {
        if self.is_empty() {
            return;
        }
        bytes.reserve(8 * (1 + self.len * self.columns()));
        bytes.extend_from_slice(&(self.carried as u64).to_ne_bytes());
        for column in 0..Layout::<D>::REALS {
            let (lines, rest) = self.column(column).lines();
            lines.for_each(|line| bytes.extend_from_slice(cast_slice(line)));
            bytes.extend_from_slice(cast_slice(rest));
        }
        (Self::IDS..self.columns())
            .for_each(|column| bytes.extend_from_slice(cast_slice(self.words(column))));
    }

    /// The particles that [`Chunk::append_to`] packed; empty if the bytes are not of that form.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut chunk = Self::new();
        let Some((carried, bytes)) = bytes.split_first_chunk() else { return chunk };
        let carried = u64::from_ne_bytes(*carried) as usize;
        let row = 8_usize.saturating_mul(carried.saturating_add(Self::CARRIED));
        let len = bytes.len() / row;
        if len == 0 || bytes.len() % row != 0 {
            return chunk;
        }
        chunk.carry(carried);
        chunk.reserve_exact(len);
        chunk.len = len;
        let (reals, words) = bytes.split_at(8 * len * Layout::<D>::REALS);
        for (column, values) in reals.chunks_exact(8 * len).enumerate() {
            for (to, value) in chunk.column_mut(column).into_iter().zip(values.as_chunks().0) {
                *to = f64::from_ne_bytes(*value);
            }
        }
        for (column, values) in (Self::IDS..).zip(words.chunks_exact(8 * len)) {
            cast_slice_mut(chunk.words_mut(column)).copy_from_slice(values);
        }
        chunk.widest = Widest::UNKNOWN;
        chunk
    }
}
