//! Principal values of a deviator, and tensors with the same principal directions, without eigenvectors.
//!
//! The eigenvalue of the greatest magnitude stands alone: the other two are no nearer to it than `√(3/2)` of
//! the norm, so its projector `n ⊗ n` is a well-conditioned polynomial in the tensor. The remainder lies in
//! the plane across `n` and has eigenvalues of equal size and opposite sign, exact for equal and nearly equal
//! ones.
use super::eigen::{Symmetric, determinant};
use crate::simd::{Vector, VectorMask, each};

/// `cos(arccos(x)/3)` for x from 0 to 1 as a polynomial in `x - 1/2`: Chebyshev interpolation, errors below
/// 1e-16.
const COSINE_OF_THIRD: [f64; 20] = [
    0.939_692_620_785_908_4,
    0.131_643_614_544_899_48,
    -0.025_725_655_950_657_5,
    0.008_853_239_646_703_792,
    -0.003_738_324_470_471_647_7,
    0.001_757_261_395_740_149_8,
    -0.000_882_641_818_327_069_4,
    0.000_463_781_080_382_938_07,
    -0.000_251_785_393_649_707_75,
    0.000_140_122_206_505_798_29,
    -7.951_322_720_916_29e-5,
    4.583_048_375_763_111e-5,
    -2.673_100_799_493_431_7e-5,
    1.577_549_228_227_639_6e-5,
    -9.550_727_248_319_559e-6,
    5.736_581_603_520_285e-6,
    -2.942_182_630_296_114_5e-6,
    1.783_136_164_845_402_9e-6,
    -2.078_718_841_416_756_5e-6,
    1.281_889_492_221_668_7e-6,
];

/// `1/(2 cos²(arccos(x)/3) - 1/2)` likewise, errors below 1.2e-8.
const INVERSE: [f64; 10] = [
    0.789_861_694_793,
    -0.308_707_876_209,
    0.159_356_812_088,
    -0.089_718_829_126_6,
    0.052_765_376_339_2,
    -0.031_805_435_567_5,
    0.018_958_968_896_6,
    -0.011_754_068_459_9,
    0.009_819_450_394_23,
    -0.006_207_346_748_06,
];

/// A deviator of known norm with the eigenvalue that stands alone: enough to know all three nearly.
pub(crate) struct Lone<V> {
    /// Frobenius norm of the deviator.
    norm: V,
    /// The deviator over its norm.
    unit: Symmetric<V>,
    /// The eigenvalue of `unit` that stands alone.
    value: V,
    /// `|cos 3θ| - 1/2` of the Lode angle.
    angle: V,
}

/// Decomposition of a deviator. It is `norm` times a tensor U of unit norm.
///
/// `P = (U² + lone U + (lone² - 1/2) I) inverse` is the projector on the direction of `lone`, and
/// `R = U + lone/2 I - 3/2 lone P` the part of U in the plane across it, with eigenvalues `half` and `-half`.
pub(crate) struct Principal<V> {
    /// Frobenius norm of the deviator.
    norm: V,
    /// The eigenvalue of U that stands alone.
    lone: V,
    /// Half the difference of the other two eigenvalues of U, and one over it or 0.
    half: V,
    half_inverse: V,
    /// U and U².
    unit: Symmetric<V>,
    square: Symmetric<V>,
    /// P as a polynomial: factors of I, U and U².
    projector: [V; 3],
    /// R likewise.
    rest: [V; 3],
}

impl<V: Vector> Lone<V> {
    /// Of a deviator with this Frobenius norm.
    #[inline(always)]
    pub(crate) fn of(deviator: &Symmetric<V>, norm: V) -> Self {
        let one = V::splat(1.0);
        if V::DERIVES {
            // Diagonal, and its components are the eigenvalues.
            return Self { norm, unit: *deviator, value: one, angle: one };
        }
        let scale = one / norm.max(V::splat(f64::MIN_POSITIVE));
        let unit = each(*deviator, |component| component * scale);
        let determinant = determinant(&unit);
        // Eigenvalues are 2 √(1/6) cos(θ + 2πk/3) with cos 3θ = 3√6 det.
        let x = (determinant.abs() * (3.0 * 6.0_f64.sqrt())).min(one) - V::splat(0.5);
        // Even and odd terms apart, to shorten the chain.
        let square = x * x;
        let (mut even, mut odd) = (V::splat(COSINE_OF_THIRD[18]), V::splat(COSINE_OF_THIRD[19]));
        for n in (0..9).rev() {
            even = even.mul_add(square, V::splat(COSINE_OF_THIRD[2 * n]));
            odd = odd.mul_add(square, V::splat(COSINE_OF_THIRD[2 * n + 1]));
        }
        let value = (odd.mul_add(x, even) * (2.0 / 6.0_f64.sqrt())).copysign(determinant);
        Self { norm, unit, value, angle: x }
    }

    /// Eigenvalues of the deviator, greatest first, each wrong by at most 1e-7 of the norm where two are
    /// nearly equal.
    #[inline(always)]
    pub(crate) fn nearly_sorted(&self) -> [V; 3] {
        if V::DERIVES {
            return sorted_in_axes(&self.unit);
        }
        let half = (self.value * self.value).neg_mul_add(V::splat(0.75), V::splat(0.5));
        sorted(self.norm, self.value, half.max(V::splat(0.0)).sqrt())
    }
}

/// Components of a diagonal tensor, greatest first.
fn sorted_in_axes<V: Vector>(tensor: &Symmetric<V>) -> [V; 3] {
    let [x, y, z, ..] = *tensor;
    // Equal ones keep their order, as neighbours change places only.
    let pair = |a: V, b: V| {
        let is_less = a.lt(b);
        (is_less.select(b, a), is_less.select(a, b))
    };
    let (x, y) = pair(x, y);
    let (y, z) = pair(y, z);
    let (x, y) = pair(x, y);
    [x, y, z]
}

/// The diagonal tensor with these components, which stand in the order of [`sorted_in_axes`].
fn compose_in_axes<V: Vector>(tensor: &Symmetric<V>, sorted: &[V; 3]) -> Symmetric<V> {
    let zero = V::splat(0.0);
    let [x, y, z, ..] = *tensor;
    let [first, second, third] = *sorted;
    // The place of a component: behind greater ones, and behind equal ones that come before.
    let placed = |ahead: [V::Mask; 2]| {
        let [a, b] = ahead;
        (a & b).select(third, (a | b).select(second, first))
    };
    let (xy, xz, yz) = (x.lt(y), x.lt(z), y.lt(z));
    [placed([xy, xz]), placed([!xy, yz]), placed([!xz, !yz]), zero, zero, zero]
}

/// Eigenvalues, greatest first, of a deviator with this norm: those of the unit tensor are `lone` and, on
/// both sides of `-lone/2` at the distance `half`, the other two.
#[inline(always)]
fn sorted<V: Vector>(norm: V, lone: V, half: V) -> [V; 3] {
    let zero = V::splat(0.0);
    let first = zero.lt(lone);
    let lone = lone * norm;
    let (middle, half) = (lone * -0.5, half * norm);
    let (high, low) = (middle + half, middle - half);
    [first.select(lone, high), first.select(high, low), first.select(low, lone)]
}

impl<V: Vector> Principal<V> {
    /// Decomposes a deviator.
    #[inline(always)]
    pub(crate) fn of(from: &Lone<V>) -> Self {
        let one = V::splat(1.0);
        let Lone { norm, unit, value: lone, angle } = *from;
        if V::DERIVES {
            let (square, half, half_inverse) = (unit, one, one);
            return Self {
                norm,
                lone,
                half,
                half_inverse,
                unit,
                square,
                projector: [one; 3],
                rest: [one; 3],
            };
        }
        let [xx, yy, zz, xy, xz, yz] = unit;
        let square = [
            xx.mul_add(xx, xy.mul_add(xy, xz * xz)),
            yy.mul_add(yy, xy.mul_add(xy, yz * yz)),
            zz.mul_add(zz, xz.mul_add(xz, yz * yz)),
            xy.mul_add(xx + yy, xz * yz),
            xz.mul_add(xx + zz, xy * yz),
            yz.mul_add(yy + zz, xy * xz),
        ];
        // (U - a)(U - b) with the other two eigenvalues a and b, over its value for `lone`.
        let lone_square = lone * lone;
        // A polynomial and a step of Newton's method are faster than a division.
        let x = angle * angle;
        let (mut even, mut odd) = (V::splat(INVERSE[8]), V::splat(INVERSE[9]));
        for n in (0..4).rev() {
            even = even.mul_add(x, V::splat(INVERSE[2 * n]));
            odd = odd.mul_add(x, V::splat(INVERSE[2 * n + 1]));
        }
        let near = odd.mul_add(angle, even);
        let whole = lone_square.mul_add(V::splat(3.0), V::splat(-0.5));
        let inverse = near.mul_add(whole.neg_mul_add(near, one), near);
        let projector = [(lone_square - V::splat(0.5)) * inverse, lone * inverse, inverse];
        let apart = lone * 1.5;
        let rest = [
            apart.neg_mul_add(projector[0], lone * 0.5),
            apart.neg_mul_add(projector[1], one),
            -(apart * projector[2]),
        ];
        let [xx, yy, zz, xy, xz, yz] = polynomial(&rest, &unit, &square);
        let shear = xy.mul_add(xy, xz.mul_add(xz, yz * yz));
        let half = (xx.mul_add(xx, yy.mul_add(yy, zz.mul_add(zz, shear + shear))) * 0.5).sqrt();
        let zero = V::splat(0.0);
        let half_inverse = zero.lt(half).select(one / half, zero);
        Self { norm, lone, half, half_inverse, unit, square, projector, rest }
    }

    /// Eigenvalues of the deviator, greatest first.
    #[inline(always)]
    pub(crate) fn sorted(&self) -> [V; 3] {
        if V::DERIVES {
            return sorted_in_axes(&self.unit);
        }
        sorted(self.norm, self.lone, self.half)
    }

    /// The tensor with the same directions and these eigenvalues, in the order of [`Principal::sorted`].
    #[inline(always)]
    pub(crate) fn compose(&self, sorted: &[V; 3]) -> Symmetric<V> {
        if V::DERIVES {
            return compose_in_axes(&self.unit, sorted);
        }
        let zero = V::splat(0.0);
        let first = zero.lt(self.lone);
        let lone = first.select(sorted[0], sorted[2]);
        let high = first.select(sorted[1], sorted[0]);
        let low = first.select(sorted[2], sorted[1]);
        let mean = (high + low) * 0.5;
        let slope = (high - low) * 0.5 * self.half_inverse;
        let apart = lone - mean;
        let mut factors = self.rest;
        for n in 0..3 {
            factors[n] = apart.mul_add(self.projector[n], slope * self.rest[n]);
        }
        factors[0] += mean;
        polynomial(&factors, &self.unit, &self.square)
    }
}

/// `f₀ I + f₁ U + f₂ U²`.
#[inline(always)]
fn polynomial<V: Vector>(factors: &[V; 3], unit: &Symmetric<V>, square: &Symmetric<V>) -> Symmetric<V> {
    let mut tensor = *unit;
    for c in 0..6 {
        let linear = if c < 3 { factors[1].mul_add(unit[c], factors[0]) } else { factors[1] * unit[c] };
        tensor[c] = factors[2].mul_add(square[c], linear);
    }
    tensor
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::eigen::decompose;
    use super::*;
    use crate::simd::Lanes;

    fn at(value: Lanes) -> f64 {
        value.to_array()[0]
    }

    fn norm(tensor: &Symmetric) -> f64 {
        let square = |c: usize| if c < 3 { 1.0 } else { 2.0 } * at(tensor[c]) * at(tensor[c]);
        (0..6).map(square).sum::<f64>().sqrt()
    }

    /// Eigenvalues and tensors composed of them agree with those of Jacobi rotations.
    fn agrees(tensor: [f64; 6]) -> Result<(), TestCaseError> {
        let mean = (tensor[0] + tensor[1] + tensor[2]) / 3.0;
        let deviator: Symmetric =
            std::array::from_fn(|c| Lanes::splat(if c < 3 { tensor[c] - mean } else { tensor[c] }));
        let size = norm(&deviator);
        let lone = Lone::of(&deviator, Lanes::splat(size));
        let principal = Principal::of(&lone);
        let sorted = principal.sorted();
        // Rotations require a positive definite matrix.
        let mut shifted = deviator;
        shifted[..3].iter_mut().for_each(|component| *component += Lanes::splat(2.0 * size + 1e-300));
        let eigen = decompose(&shifted, false);
        let shift = 2.0 * size + 1e-300;
        let mut expected = eigen.value.map(|value| at(value) - shift);
        expected.sort_by(|a, b| b.total_cmp(a));
        for k in 0..3 {
            let error = (at(sorted[k]) - expected[k]).abs();
            prop_assert!(error <= 3e-15 * size, "{k}: {} {}", at(sorted[k]), expected[k]);
        }
        for (near, exact) in lone.nearly_sorted().into_iter().zip(sorted) {
            prop_assert!((at(near) - at(exact)).abs() <= 1e-7 * size);
        }
        let back = principal.compose(&sorted);
        for c in 0..6 {
            prop_assert!((at(back[c]) - at(deviator[c])).abs() <= 3e-15 * size, "component {c}");
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn agrees_with_rotations(
            tensor in prop::array::uniform6(-1.0_f64..1.0),
            scale in prop::sample::select(vec![1e-100, 1e-9, 1.0, 1e12]),
        ) {
            agrees(tensor.map(|component| component * scale))?;
        }

        /// Two eigenvalues that are equal or nearly so, in any direction.
        #[test]
        fn of_nearly_equal_eigenvalues(
            v in prop::array::uniform3(-1.0_f64..1.0),
            w in prop::array::uniform3(-1.0_f64..1.0),
            gap in prop::sample::select(vec![0.0, 1e-16, 1e-12, 1e-8, 1e-3]),
            sign in prop::sample::select(vec![-1.0, 1.0]),
        ) {
            let dyad = |c: usize| {
                let (i, j) = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)][c];
                sign * v[i] * v[j] + gap * w[i] * w[j]
            };
            agrees(std::array::from_fn(dyad))?;
        }
    }

    #[test]
    fn no_deviator_has_equal_values() {
        let zero = Lanes::splat(0.0);
        let principal = Principal::of(&Lone::of(&[zero; 6], zero));
        for value in principal.sorted() {
            assert_eq!(at(value), 0.0);
        }
        let [a, b] = [2.0, 0.0].map(Lanes::splat);
        let tensor = principal.compose(&[a; 3]);
        for (component, expected) in tensor.into_iter().zip([a, a, a, b, b, b]) {
            assert_eq!(at(component), at(expected));
        }
    }
}
