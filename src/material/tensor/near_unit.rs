//! Functions of symmetric tensors near the unit tensor, without eigenvectors.
//!
//! By the theorem of Cayley and Hamilton a tensor Y without trace obeys `Y³ = q Y + d I` with `q = tr(Y²)/2`
//! and `d = det Y`. So all powers, and with them every power series, are sums of I, Y and Y², and a step of
//! Horner's scheme takes two multiply-adds for the whole tensor.
use super::eigen::{Symmetric, determinant};
use crate::simd::{Vector, each};

/// Greatest norm (Frobenius) of Y for which the series are exact but for rounding: eigenvalues are at most
/// 0.82 times as large, and the remainder of the series is below 2e-18.
const LIMIT: f64 = 0.2;

/// `ln(1 + x) = x - x²/2 + x³/3 - …`
const LN: [f64; 21] = {
    let mut series = [0.0; 21];
    let mut n = 1;
    while n < series.len() {
        series[n] = if n % 2 == 1 { 1.0 } else { -1.0 } / n as f64;
        n += 1;
    }
    series
};

/// `exp x = 1 + x + x²/2 + …`, for twice a strain, of which the eigenvalues are at most 0.19.
const EXP: [f64; 13] = {
    let mut series = [1.0; 13];
    let mut n = 1;
    while n < series.len() {
        series[n] = series[n - 1] / n as f64;
        n += 1;
    }
    series
};

/// A symmetric tensor without trace, with its square.
pub(super) struct TraceFree<V> {
    tensor: Symmetric<V>,
    square: Symmetric<V>,
    /// `tr(Y²)/2`.
    q: V,
    /// `det Y`.
    d: V,
}

impl<V: Vector> TraceFree<V> {
    /// A third of the trace of b, and Y where `b = tr(b)/3 (I + Y)`.
    #[inline(always)]
    pub(super) fn beside_unit(b: &Symmetric<V>) -> (V, Self) {
        let mean = (b[0] + b[1] + b[2]) * (1.0 / 3.0);
        let scale = V::splat(1.0) / mean;
        let mut tensor = each(*b, |component| component * scale);
        for c in 0..3 {
            tensor[c] = (b[c] - mean) * scale;
        }
        (mean, Self::new(tensor))
    }

    /// From its components.
    #[inline(always)]
    pub(super) fn new(tensor: Symmetric<V>) -> Self {
        let [xx, yy, zz, xy, xz, yz] = tensor;
        let square = [
            xx.mul_add(xx, xy.mul_add(xy, xz * xz)),
            yy.mul_add(yy, xy.mul_add(xy, yz * yz)),
            zz.mul_add(zz, xz.mul_add(xz, yz * yz)),
            xy.mul_add(xx + yy, xz * yz),
            xz.mul_add(xx + zz, xy * yz),
            yz.mul_add(yy + zz, xy * xz),
        ];
        Self { tensor, square, q: (square[0] + square[1] + square[2]) * 0.5, d: determinant(&tensor) }
    }

    /// Lanes for which the series hold.
    #[inline(always)]
    pub(super) fn is_small(&self) -> V::Mask {
        self.q.le(V::splat(0.5 * LIMIT * LIMIT))
    }

    /// `ln(I + Y)`: its trace and its deviator.
    #[inline(always)]
    pub(super) fn ln_of_one_plus(&self) -> (V, Symmetric<V>) {
        let [unit, first, second] = self.series(&LN);
        // Neither Y nor what is added to the diagonal has a trace.
        let two_thirds = self.q * (2.0 / 3.0);
        let mut deviator = self.tensor;
        for c in 0..6 {
            let square = if c < 3 { self.square[c] - two_thirds } else { self.square[c] };
            deviator[c] = first.mul_add(self.tensor[c], second * square);
        }
        (unit.mul_add(V::splat(3.0), second * (self.q + self.q)), deviator)
    }

    /// `exp Y`.
    #[inline(always)]
    pub(super) fn exp(&self) -> Symmetric<V> {
        let [unit, first, second] = self.series(&EXP);
        let mut sum = self.tensor;
        for c in 0..6 {
            sum[c] = first.mul_add(self.tensor[c], second * self.square[c]);
            if c < 3 {
                sum[c] += unit;
            }
        }
        sum
    }

    /// Factors of I, Y and Y² in a power series.
    #[inline(always)]
    fn series<const N: usize>(&self, series: &[f64; N]) -> [V; 3] {
        let mut unit = V::splat(series[N - 3]);
        let (mut first, mut second) = (V::splat(series[N - 2]), V::splat(series[N - 1]));
        for n in (0..N - 3).rev() {
            let next = second.mul_add(self.d, V::splat(series[n]));
            (unit, first, second) = (next, second.mul_add(self.q, unit), first);
        }
        [unit, first, second]
    }
}
