//! Factors of a symmetric matrix that is stored by rows from their first entry to the diagonal.

/// Part of its diagonal entry below which a pivot counts as none.
const LEAST: f64 = 1e-10;

/// A symmetric matrix, and then its factors `L D Lᵀ`.
#[derive(Clone, Debug, Default)]
pub(super) struct Skyline {
    /// First column of each row.
    first: Vec<usize>,
    /// Place of the diagonal of each row.
    diagonal: Vec<usize>,
    values: Vec<f64>,
}

impl Skyline {
    /// Of zeros, with these first columns of rows.
    pub(super) fn new(first: Vec<usize>) -> Self {
        let mut end = 0;
        let ends = first.iter().enumerate().map(|(row, first)| {
            end += row - first + 1;
            end - 1
        });
        let diagonal: Vec<usize> = ends.collect();
        Self { first, diagonal, values: vec![0.0; end] }
    }

    /// Adds to the entry of a row and a column, in either order.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        let (row, column) = (row.max(column), row.min(column));
        self.values[self.diagonal[row] - (row - column)] += value;
    }

    /// The row with its first column.
    fn row(&self, row: usize) -> (usize, &[f64]) {
        let end = self.diagonal[row];
        (self.first[row], &self.values[end - (row - self.first[row])..=end])
    }

    /// Replaces the matrix by its factors. A row without a pivot stands for itself.
    pub(super) fn factor(&mut self) {
        for row in 0..self.first.len() {
            let (first, whole) = self.row(row);
            let mut own = whole.to_vec();
            let whole = own[row - first];
            for column in first..row {
                let (start, other) = self.row(column);
                let from = first.max(start);
                let products = own[from - first..column - first].iter().zip(&other[from - start..]);
                own[column - first] -= products.take(column - from).map(|(a, b)| a * b).sum::<f64>();
            }
            // Up to here the row is `L D`.
            let mut pivot = own[row - first];
            for column in first..row {
                let scaled = own[column - first] / self.values[self.diagonal[column]];
                pivot = (-scaled).mul_add(own[column - first], pivot);
                own[column - first] = scaled;
            }
            let is_pivot = pivot > LEAST * whole;
            if !is_pivot {
                pivot = if whole > 0.0 { whole } else { 1.0 };
                own[..row - first].fill(0.0);
            }
            own[row - first] = pivot;
            let end = self.diagonal[row];
            self.values[end - (row - first)..=end].copy_from_slice(&own);
        }
    }

    /// Solves with the factors, in place.
    pub(super) fn solve(&self, values: &mut [f64]) {
        for row in 0..values.len() {
            let (first, own) = self.row(row);
            let known = own[..row - first].iter().zip(&values[first..row]);
            values[row] -= known.map(|(a, b)| a * b).sum::<f64>();
        }
        for (row, value) in values.iter_mut().enumerate() {
            *value /= self.values[self.diagonal[row]];
        }
        for row in (0..values.len()).rev() {
            let (first, own) = self.row(row);
            let value = values[row];
            let below = values[first..row].iter_mut().zip(own);
            below.for_each(|(other, a)| *other = (-a).mul_add(value, *other));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bar of springs, held at one end and pulled with 1 N at the other, with a node that nothing holds.
    #[test]
    fn a_bar_of_springs_is_stretched() {
        let first = vec![0, 0, 1, 2, 4];
        let mut matrix = Skyline::new(first);
        for spring in 0..4 {
            matrix.add(spring, spring, 2.0);
            if spring > 0 {
                matrix.add(spring - 1, spring - 1, 2.0);
                matrix.add(spring - 1, spring, -2.0);
            }
        }
        matrix.factor();
        let mut values = [0.0, 0.0, 0.0, 1.0, 0.0];
        matrix.solve(&mut values);
        for (value, exact) in values.into_iter().zip([0.5, 1.0, 1.5, 2.0, 0.0]) {
            assert!((value - exact).abs() < 1e-14, "{values:?}");
        }
    }
}
