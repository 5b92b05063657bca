//! Columns that some particles carry for loads: the area of the surface that they stand for, or a share of a
//! force.
//!
//! Only particles at the surface of a body do, so only leaves with such particles have columns for it. A
//! chunk without columns is the same as one with zeros.
use bytemuck::{cast_slice, cast_slice_mut};

use super::{Chunk, TILE};

impl<const D: usize> Chunk<D> {
    /// Number of carried columns; 0 in most leaves.
    pub fn carried_columns(&self) -> usize {
        self.carried
    }

    /// Values of the particles in a column; empty if the chunk does not have it, and so zero.
    pub fn carried(&self, column: usize) -> &[f64] {
        if column < self.carried { cast_slice(self.words(Self::CARRIED + column)) } else { &[] }
    }

    /// Values of the particles in a column, mutable; empty if the chunk does not have it.
    pub fn carried_mut(&mut self, column: usize) -> &mut [f64] {
        self.revision = None;
        if column < self.carried { cast_slice_mut(self.words_mut(Self::CARRIED + column)) } else { &mut [] }
    }

    /// Provides at least so many columns; new ones are zero.
    pub fn carry(&mut self, columns: usize) {
        if columns <= self.carried {
            return;
        }
        let first = self.columns();
        self.carried = columns;
        self.block.resize(self.capacity / TILE * self.columns());
        (first..self.columns()).for_each(|column| self.words_mut(column).fill(0));
    }
}
