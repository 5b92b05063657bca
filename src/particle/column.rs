//! One component of the particles of a chunk: every so many lines of their tiles.
use std::iter::{Flatten, StepBy, Take};
use std::ops::{Index, IndexMut};
use std::slice;

use super::layout::TILE;
use crate::simd::{LANES, Lanes, Vector};

const _: () = assert!(LANES == TILE, "a batch of a kernel is a tile");

/// Values of one component, particle by particle.
#[derive(Clone, Copy, Debug)]
pub struct Column<'a> {
    /// From that of the first tile on; empty without particles.
    lines: &'a [[f64; TILE]],
    /// Lines from tile to tile.
    step: usize,
    len: usize,
}

/// [`Column`] to be written.
#[derive(Debug)]
pub struct ColumnMut<'a> {
    lines: &'a mut [[f64; TILE]],
    step: usize,
    len: usize,
}

/// Values of a column in order.
pub(super) type Values<'a> = Take<Flatten<StepBy<slice::Iter<'a, [f64; TILE]>>>>;
/// Values of a column in order, to be written.
pub(super) type ValuesMut<'a> = Take<Flatten<StepBy<slice::IterMut<'a, [f64; TILE]>>>>;

impl<'a> Column<'a> {
    pub(super) fn new(lines: &'a [[f64; TILE]], step: usize, len: usize) -> Self {
        Self { lines, step, len }
    }

    /// The values in order.
    pub fn iter(&self) -> Values<'a> {
        self.lines.iter().step_by(self.step).flatten().take(self.len)
    }

    /// The values of full tiles, and those behind them.
    pub fn lines(&self) -> (impl Iterator<Item = &'a [f64; TILE]> + use<'a>, &'a [f64]) {
        let full = self.len / TILE;
        let rest = match self.len % TILE {
            0 => &[][..],
            rest => &self.lines[full * self.step][..rest],
        };
        (self.lines.iter().step_by(self.step).take(full), rest)
    }

    /// Least and greatest of the values, 0 among them.
    pub fn range(&self) -> [f64; 2] {
        let (lines, rest) = self.lines();
        let [least, greatest] = lines
            .map(Lanes::load)
            .fold([Lanes::splat(0.0); 2], |range, values| [values.min(range[0]), values.max(range[1])])
            .map(Lanes::to_array);
        [
            least.iter().chain(rest).copied().fold(0.0, f64::min),
            greatest.iter().chain(rest).copied().fold(0.0, f64::max),
        ]
    }

    /// Greatest of the values, 0 among them.
    pub fn greatest(&self) -> f64 {
        let (lines, rest) = self.lines();
        let most = lines.fold(Lanes::splat(0.0), |most, line| Lanes::load(line).max(most));
        most.to_array().iter().chain(rest).copied().fold(0.0, f64::max)
    }

    /// Sum in an order that follows from the number of values.
    pub fn sum(&self) -> f64 {
        let (lines, rest) = self.lines();
        let sums = lines.fold(Lanes::splat(0.0), |sum, line| Lanes::load(line) + sum);
        sums.to_array().iter().chain(rest).sum()
    }
}

impl ColumnMut<'_> {
    pub(super) fn new(lines: &mut [[f64; TILE]], step: usize, len: usize) -> ColumnMut<'_> {
        ColumnMut { lines, step, len }
    }

    /// Sets all values.
    pub fn fill(self, value: f64) {
        self.into_iter().for_each(|own| *own = value);
    }
}

/// Line and lane of particle `p` of `len`.
#[inline]
fn place(p: usize, step: usize, len: usize) -> (usize, usize) {
    assert!(p < len, "particle {p} of {len}");
    (p / TILE * step, p % TILE)
}

/// # Panics
/// There is no such particle.
impl Index<usize> for Column<'_> {
    type Output = f64;

    #[inline]
    fn index(&self, p: usize) -> &f64 {
        let (line, lane) = place(p, self.step, self.len);
        &self.lines[line][lane]
    }
}

/// # Panics
/// There is no such particle.
impl Index<usize> for ColumnMut<'_> {
    type Output = f64;

    #[inline]
    fn index(&self, p: usize) -> &f64 {
        let (line, lane) = place(p, self.step, self.len);
        &self.lines[line][lane]
    }
}

impl IndexMut<usize> for ColumnMut<'_> {
    #[inline]
    fn index_mut(&mut self, p: usize) -> &mut f64 {
        let (line, lane) = place(p, self.step, self.len);
        &mut self.lines[line][lane]
    }
}

impl<'a> IntoIterator for Column<'a> {
    type Item = &'a f64;
    type IntoIter = Values<'a>;

    fn into_iter(self) -> Values<'a> {
        self.iter()
    }
}

impl<'a> IntoIterator for ColumnMut<'a> {
    type Item = &'a mut f64;
    type IntoIter = ValuesMut<'a>;

    fn into_iter(self) -> ValuesMut<'a> {
        self.lines.iter_mut().step_by(self.step).flatten().take(self.len)
    }
}

/// Equal values in the same order.
impl PartialEq for Column<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    #[test]
    fn every_so_many_lines() {
        // The second of three components of eleven particles.
        let mut lines: Vec<[f64; TILE]> =
            (0..6).map(|line| std::array::from_fn(|i| f64::from(10 * line + i as i32))).collect();
        let expected: Vec<f64> = (10..18).chain(40..43).map(f64::from).collect();
        let column = Column::new(&lines[1..], 3, 11);
        assert!(column.iter().eq(&expected) && (0..11).all(|p| column[p] == expected[p]));
        let (full, rest) = column.lines();
        assert!(full.flatten().chain(rest).eq(&expected));
        let mut column = ColumnMut::new(&mut lines[1..], 3, 11);
        column[9] += 0.5;
        column.into_iter().for_each(|value| *value *= 2.0);
        assert_eq!((lines[4][1], lines[4][3], lines[3][1], lines[1][7]), (83.0, 43.0, 31.0, 34.0));
        let (mut full, rest) = Column::new(&[], 3, 0).lines();
        assert!(full.next().is_none() && rest.is_empty());
    }

    #[test]
    fn of_any_number_of_values() {
        for len in 0..40 {
            let values: Vec<f64> = (0..len).map(|i| f64::from((i * 7 + 3) % 40 - 20)).collect();
            let least = values.iter().copied().fold(0.0, f64::min);
            let most = values.iter().copied().fold(0.0, f64::max);
            let lines = lines(&values);
            let column = Column::new(&lines, 1, values.len());
            assert_eq!(column.range(), [least, most]);
            assert_eq!(column.greatest(), most);
            assert_eq!(column.sum(), values.iter().sum::<f64>());
        }
    }

    /// Tiles that consist of one column.
    pub(crate) fn lines(values: &[f64]) -> Vec<[f64; TILE]> {
        let line = |values: &[f64]| std::array::from_fn(|i| values.get(i).copied().unwrap_or(f64::NAN));
        values.chunks(TILE).map(line).collect()
    }
}
