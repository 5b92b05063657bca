//! Sparse symmetric matrices of blocks, one for each pair of nodes, and the smoother of a level of multigrid.
use rayon::prelude::*;

use super::skyline::Skyline;
use crate::solver::quasi_static::unknowns::Nodal;

/// Weights of nodes of the next coarser level, or of unknowns.
pub(super) type Weights = Vec<(u32, f64)>;

/// Rows that a thread takes at once.
const ROWS: usize = 128;
/// Steps of the smoother before and after the coarser levels.
const STEPS: usize = 2;
/// Greatest eigenvalue over the least that the smoother damps.
const RATIO: f64 = 8.0;
/// Factor on the estimate of the greatest eigenvalue, and power iterations for it: at first, and later.
const MARGIN: f64 = 1.15;
const POWERS: [usize; 2] = [16, 5];
/// Least pivot of a diagonal block over its entry.
const LEAST: f64 = 1e-9;

/// A matrix of one row for each node.
pub(super) struct Blocks<const D: usize> {
    /// Where each row starts, and its end.
    start: Vec<usize>,
    column: Vec<u32>,
    value: Vec<[[f64; D]; D]>,
}

impl<const D: usize> Blocks<D> {
    /// Zeros in these columns, which are sorted in each row.
    pub(super) fn new(rows: &[Vec<u32>]) -> Self {
        let mut start = vec![0];
        rows.iter().for_each(|row| start.push(start[start.len() - 1] + row.len()));
        let column = rows.concat();
        let value = vec![[[0.0; D]; D]; column.len()];
        Self { start, column, value }
    }

    pub(super) fn clear(&mut self) {
        self.value.fill([[0.0; D]; D]);
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// The block of a row and a column, if there is one.
    pub(super) fn block(&mut self, row: usize, column: u32) -> Option<&mut [[f64; D]; D]> {
        let (start, end) = (self.start[row], self.start[row + 1]);
        let found = self.column[start..end].binary_search(&column).ok()?;
        Some(&mut self.value[start + found])
    }

    /// Columns and blocks of a row.
    fn row(&self, row: usize) -> impl Iterator<Item = (usize, &[[f64; D]; D])> {
        let all = self.start[row]..self.start[row + 1];
        self.column[all.clone()].iter().map(|column| *column as usize).zip(&self.value[all])
    }

    /// `b - A x` in a row.
    fn residual(&self, row: usize, b: &[f64; D], x: &[[f64; D]]) -> [f64; D] {
        self.row(row).fold(*b, |rest, (column, block)| {
            let x = &x[column];
            std::array::from_fn(|i| (0..D).fold(rest[i], |sum, k| (-block[i][k]).mul_add(x[k], sum)))
        })
    }

    /// `Pᵀ A P`, without what is held. `to` has the weights of the coarse nodes for each row, `from` the rows
    /// of each coarse node.
    fn reduced(&self, to: &[Weights], from: &[Weights], held: &[u8]) -> Self {
        let rows = (0..from.len()).into_par_iter().with_min_len(ROWS).map_init(
            || vec![u32::MAX; from.len()],
            |place, coarse| {
                let mut row: Vec<(u32, [[f64; D]; D])> = Vec::new();
                for &(fine, share) in &from[coarse] {
                    for (column, block) in self.row(fine as usize) {
                        for &(other, weight) in &to[column] {
                            let slot = &mut place[other as usize];
                            if *slot == u32::MAX {
                                *slot = row.len() as u32;
                                row.push((other, [[0.0; D]; D]));
                            }
                            let sum = &mut row[*slot as usize].1;
                            for (sum, block) in sum.iter_mut().zip(block) {
                                for (sum, value) in sum.iter_mut().zip(block) {
                                    *sum = (share * weight).mul_add(*value, *sum);
                                }
                            }
                        }
                    }
                }
                row.iter().for_each(|(other, _)| place[*other as usize] = u32::MAX);
                row.sort_unstable_by_key(|(other, _)| *other);
                for (other, block) in &mut row {
                    without_held(block, held[coarse], held[*other as usize]);
                }
                row
            },
        );
        let rows: Vec<Vec<(u32, [[f64; D]; D])>> = rows.collect();
        let mut start = vec![0];
        rows.iter().for_each(|row| start.push(start[start.len() - 1] + row.len()));
        let column = rows.iter().flatten().map(|(column, _)| *column).collect();
        let value = rows.iter().flatten().map(|(_, block)| *block).collect();
        Self { start, column, value }
    }
}

/// Sets rows and columns of what is held to 0; a bit for each axis.
pub(super) fn without_held<const D: usize>(block: &mut [[f64; D]; D], row: u8, column: u8) {
    for (i, values) in block.iter_mut().enumerate() {
        for (k, value) in values.iter_mut().enumerate() {
            if row >> i & 1 == 1 || column >> k & 1 == 1 {
                *value = 0.0;
            }
        }
    }
}

/// A level of multigrid.
pub(super) struct Level<const D: usize> {
    pub(super) matrix: Blocks<D>,
    /// Held axes of each node, a bit each.
    pub(super) held: Vec<u8>,
    /// Of each node, the nodes of the next coarser level with their weights; none on the coarsest.
    pub(super) to: Vec<Weights>,
    /// The transpose: of each coarser node, the nodes that follow it.
    pub(super) from: Vec<Weights>,
    /// Inverse blocks of the diagonal.
    inverse: Vec<[[f64; D]; D]>,
    /// Estimate of the greatest eigenvalue of the matrix times these, and its vector.
    greatest: f64,
    vector: Nodal<D>,
}

impl<const D: usize> Level<D> {
    pub(super) fn new(matrix: Blocks<D>, held: Vec<u8>, to: Vec<Weights>, coarser: usize) -> Self {
        let mut from = vec![Vec::new(); coarser];
        for (node, weights) in to.iter().enumerate() {
            weights.iter().for_each(|&(coarse, weight)| from[coarse as usize].push((node as u32, weight)));
        }
        Self { matrix, held, to, from, inverse: Vec::new(), greatest: 0.0, vector: Vec::new() }
    }

    /// The matrix of the next coarser level, where this is held.
    pub(super) fn reduced(&self, held: &[u8]) -> Blocks<D> {
        self.matrix.reduced(&self.to, &self.from, held)
    }

    /// Prepares the smoother for the present matrix.
    pub(super) fn prepare(&mut self) {
        let (matrix, count) = (&self.matrix, self.matrix.len());
        let diagonals = (0..count).into_par_iter().with_min_len(ROWS);
        let inverse = diagonals.map(|row| {
            let own = matrix.row(row).find(|(column, _)| *column == row);
            own.map_or([[0.0; D]; D], |(_, block)| inverse(block))
        });
        self.inverse = inverse.collect();
        let powers = if self.vector.len() == count { POWERS[1] } else { POWERS[0] };
        if self.vector.len() != count {
            // Any vector without symmetry does.
            let sign = |n: usize| ((n as u32).wrapping_mul(2_654_435_761) >> 8) as f64 / 16_777_216.0 - 0.5;
            self.vector = (0..count).map(|node| std::array::from_fn(|a| sign(D * node + a))).collect();
        }
        let zero = [0.0; D];
        for _ in 0..powers {
            let rows = (0..count).into_par_iter().with_min_len(ROWS);
            let next: Nodal<D> = rows
                .map(|row| times(&self.inverse[row], &self.matrix.residual(row, &zero, &self.vector)))
                .collect();
            let norm = next.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
            let before = self.vector.iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
            self.greatest = if before > 0.0 { norm / before } else { 0.0 };
            let scale = if norm > 0.0 { 1.0 / norm } else { 0.0 };
            self.vector = next.into_iter().map(|x| x.map(|x| -scale * x)).collect();
        }
    }

    /// Steps of Chebyshev's iteration with the blocks of the diagonal; `x` is 0 at the start if `is_first`.
    fn smooth(&self, x: &mut Nodal<D>, b: &Nodal<D>, is_first: bool) {
        if self.greatest == 0.0 {
            return;
        }
        let most = MARGIN * self.greatest;
        let [middle, reach] = [0.5 * (most + most / RATIO), 0.5 * (most - most / RATIO)];
        let (sigma, mut rho) = (middle / reach, reach / middle);
        let mut change: Nodal<D> = Vec::new();
        for step in 0..STEPS {
            let [keep, take] = match step {
                0 => [0.0, 1.0 / middle],
                _ => {
                    let next = 1.0 / (2.0 * sigma - rho);
                    let factors = [next * rho, 2.0 * next / reach];
                    rho = next;
                    factors
                }
            };
            let one = |row: usize| -> [f64; D] {
                let rest = match step == 0 && is_first {
                    true => b[row],
                    false => self.matrix.residual(row, &b[row], x),
                };
                let towards = times(&self.inverse[row], &rest);
                std::array::from_fn(|a| match step {
                    0 => take * towards[a],
                    _ => keep.mul_add(change[row][a], take * towards[a]),
                })
            };
            change = (0..x.len()).into_par_iter().with_min_len(ROWS).map(one).collect();
            for (x, change) in x.iter_mut().zip(&change) {
                (0..D).for_each(|a| x[a] += change[a]);
            }
        }
    }
}

/// One V-cycle for `A x = b` from the level of this number down; the coarsest is solved by `bottom`.
pub(super) fn cycle<const D: usize>(levels: &[Level<D>], bottom: &Skyline, b: &Nodal<D>) -> Nodal<D> {
    let Some((level, coarser)) = levels.split_first() else { return Vec::new() };
    if coarser.is_empty() {
        let mut values: Vec<f64> = b.iter().flatten().copied().collect();
        bottom.solve(&mut values);
        return values.chunks_exact(D).map(|values| std::array::from_fn(|a| values[a])).collect();
    }
    let mut x = vec![[0.0; D]; b.len()];
    level.smooth(&mut x, b, true);
    let rows = (0..b.len()).into_par_iter().with_min_len(ROWS);
    let rest: Nodal<D> = rows.map(|row| level.matrix.residual(row, &b[row], &x)).collect();
    let held = &coarser[0].held;
    let down = level.from.par_iter().with_min_len(ROWS).zip(held).map(|(from, held)| {
        let sum =
            from.iter().fold([0.0; D], |sum, &(node, weight)| added(&sum, weight, &rest[node as usize]));
        std::array::from_fn(|a| if held >> a & 1 == 1 { 0.0 } else { sum[a] })
    });
    let down: Nodal<D> = down.collect();
    let up = cycle(coarser, bottom, &down);
    for ((x, to), held) in x.iter_mut().zip(&level.to).zip(&level.held) {
        let way = to.iter().fold(*x, |way, &(node, weight)| added(&way, weight, &up[node as usize]));
        (0..D).filter(|a| held >> a & 1 == 0).for_each(|a| x[a] = way[a]);
    }
    level.smooth(&mut x, b, false);
    x
}

/// Factors of the matrix of the coarsest level.
pub(super) fn factors<const D: usize>(matrix: &Blocks<D>) -> Skyline {
    let first = (0..matrix.len()).flat_map(|row| {
        let first = matrix.row(row).map(|(column, _)| column).min().unwrap_or(row).min(row);
        (0..D).map(move |_| D * first)
    });
    let mut skyline = Skyline::new(first.collect());
    for row in 0..matrix.len() {
        for (column, block) in matrix.row(row).filter(|(column, _)| *column <= row) {
            for (i, values) in block.iter().enumerate() {
                for (k, &value) in values.iter().enumerate().filter(|(k, _)| column < row || *k <= i) {
                    skyline.add(D * row + i, D * column + k, value);
                }
            }
        }
    }
    skyline.factor();
    skyline
}

/// `a + weight b`.
fn added<const D: usize>(a: &[f64; D], weight: f64, b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| weight.mul_add(b[i], a[i]))
}

fn times<const D: usize>(matrix: &[[f64; D]; D], x: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|i| (0..D).fold(0.0, |sum, k| matrix[i][k].mul_add(x[k], sum)))
}

/// Inverse of a block of the diagonal; of the entries on its diagonal alone if it is not positive. Axes
/// without stiffness have none.
fn inverse<const D: usize>(block: &[[f64; D]; D]) -> [[f64; D]; D] {
    let alone = || {
        let own = |i: usize| if block[i][i] > 0.0 { 1.0 / block[i][i] } else { 0.0 };
        std::array::from_fn(|i| std::array::from_fn(|k| if i == k { own(i) } else { 0.0 }))
    };
    let is_held = |i: usize| block[i].iter().all(|value| *value == 0.0);
    // By elimination, with the identity beside it; held axes stand for themselves.
    let mut left: [[f64; D]; D] = std::array::from_fn(|i| {
        std::array::from_fn(|k| if i == k && is_held(i) { 1.0 } else { block[i][k] })
    });
    let mut right: [[f64; D]; D] =
        std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(i == k && !is_held(i)))));
    for pivot in 0..D {
        let whole = if is_held(pivot) { 1.0 } else { block[pivot][pivot] };
        let is_pivot = left[pivot][pivot] > LEAST * whole.abs();
        if !is_pivot {
            return alone();
        }
        for row in (0..D).filter(|row| *row != pivot) {
            let factor = left[row][pivot] / left[pivot][pivot];
            for k in 0..D {
                left[row][k] = (-factor).mul_add(left[pivot][k], left[row][k]);
                right[row][k] = (-factor).mul_add(right[pivot][k], right[row][k]);
            }
        }
    }
    std::array::from_fn(|i| std::array::from_fn(|k| right[i][k] / left[i][i]))
}
