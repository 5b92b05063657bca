//! Pieces of a slice, mutable and disjoint.
use std::ops::Range;

/// Cuts pieces out of a slice from its beginning to its end.
pub(in crate::grid) struct DisjointSlices<'a, T> {
    rest: &'a mut [T],
    /// Index of the first element of the rest.
    first: usize,
}

impl<'a, T> DisjointSlices<'a, T> {
    /// Of a slice whose first element has the index `first`.
    pub(crate) fn new(slice: &'a mut [T], first: usize) -> Self {
        Self { rest: slice, first }
    }

    /// The elements with these indices, which begin behind those of the last piece.
    pub(crate) fn cut(&mut self, range: Range<usize>) -> &'a mut [T] {
        let (_, rest) = std::mem::take(&mut self.rest).split_at_mut(range.start - self.first);
        let (piece, rest) = rest.split_at_mut(range.len());
        (self.rest, self.first) = (rest, range.end);
        piece
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_those_asked_for() {
        let mut values: Vec<usize> = (10..30).collect();
        let mut cutter = DisjointSlices::new(&mut values, 10);
        let pieces = [10..12, 12..12, 15..20, 29..30].map(|range| (range.clone(), cutter.cut(range)));
        for (range, piece) in pieces {
            assert!(piece.iter().copied().eq(range));
            piece.fill(0);
        }
        assert_eq!(values.iter().filter(|value| **value == 0).count(), 8);
    }
}
