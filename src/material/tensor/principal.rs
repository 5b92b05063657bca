//! Principal values of a deviator, and tensors with the same principal directions, without eigenvectors.
//!
//! The eigenvalue of the greatest magnitude stands alone: the other two are no nearer to it than `√(3/2)` of the norm, so its
//! projector `n ⊗ n` is a well-conditioned polynomial in the tensor. What is left lies in the plane across `n` and has
//! eigenvalues of equal size and opposite sign, exact for equal and nearly equal ones.
use super::eigen::{Symmetric, determinant};
use crate::simd::{Vector, VectorMask, each};

/// A deviator taken apart. It is `norm` times a tensor of unit norm.
pub(crate) struct Principal<V> {
    /// Frobenius norm of the deviator.
    norm: V,
    /// The eigenvalue that stands alone, of the tensor of unit norm.
    lone: V,
    /// Half the difference of the other two eigenvalues, likewise.
    half: V,
    /// Projector on the direction of `lone`.
    projector: Symmetric<V>,
    /// What the tensor of unit norm has in the plane across, with eigenvalues `half` and `-half`.
    rest: Symmetric<V>,
}

impl<V: Vector> Principal<V> {
    /// Takes a deviator of known Frobenius norm apart.
    #[inline(always)]
    pub(crate) fn of(deviator: &Symmetric<V>, norm: V) -> Self {
        let one = V::splat(1.0);
        let scale = one / norm.max(V::splat(f64::MIN_POSITIVE));
        let unit = each(*deviator, |component| component * scale);
        let [xx, yy, zz, xy, xz, yz] = unit;
        let determinant = determinant(&unit);
        // Eigenvalues are 2 √(1/6) cos(θ + 2πk/3) with cos 3θ = 3√6 det; y = cos θ is the root of 4y³ - 3y = |cos 3θ| from
        // √3/2 to 1. The first guess is exact at both ends.
        let cosine = (determinant.abs() * (3.0 * 6.0_f64.sqrt())).min(one);
        let half_root = 0.75_f64.sqrt();
        let curvature = V::splat(1.0 - half_root - 1.0 / 6.0);
        let mut y = cosine.mul_add(cosine.mul_add(curvature, V::splat(1.0 / 6.0)), V::splat(half_root));
        for _ in 0..3 {
            let square = y * y;
            let excess = y.mul_add(square.mul_add(V::splat(4.0), V::splat(-3.0)), -cosine);
            y = y - excess / square.mul_add(V::splat(12.0), V::splat(-3.0));
        }
        let lone = (y * (2.0 / 6.0_f64.sqrt())).copysign(determinant);
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
        let product = lone_square - V::splat(0.5);
        let inverse = one / lone_square.mul_add(V::splat(3.0), V::splat(-0.5));
        let (mut projector, mut rest) = (unit, unit);
        for c in 0..6 {
            let unit_part = if c < 3 { product } else { V::splat(0.0) };
            projector[c] = (lone.mul_add(unit[c], square[c]) + unit_part) * inverse;
            let plane = if c < 3 { lone.mul_add(V::splat(0.5), unit[c]) } else { unit[c] };
            rest[c] = (lone * 1.5).neg_mul_add(projector[c], plane);
        }
        let [xx, yy, zz, xy, xz, yz] = rest;
        let shear = xy.mul_add(xy, xz.mul_add(xz, yz * yz));
        let half = (xx.mul_add(xx, yy.mul_add(yy, zz.mul_add(zz, shear + shear))) * 0.5).sqrt();
        Self { norm, lone, half, projector, rest }
    }

    /// Eigenvalues of the deviator, greatest first.
    #[inline(always)]
    pub(crate) fn sorted(&self) -> [V; 3] {
        let zero = V::splat(0.0);
        let lone = self.lone * self.norm;
        let (middle, half) = (lone * -0.5, self.half * self.norm);
        let (high, low) = (middle + half, middle - half);
        let first = zero.lt(lone);
        [first.select(lone, high), first.select(high, low), first.select(low, lone)]
    }

    /// The tensor with the same directions and these eigenvalues, in the order of [`Principal::sorted`].
    #[inline(always)]
    pub(crate) fn compose(&self, sorted: &[V; 3]) -> Symmetric<V> {
        let zero = V::splat(0.0);
        let first = zero.lt(self.lone);
        let lone = first.select(sorted[0], sorted[2]);
        let high = first.select(sorted[1], sorted[0]);
        let low = first.select(sorted[2], sorted[1]);
        let mean = (high + low) * 0.5;
        let slope = zero.lt(self.half).select((high - low) * 0.5 / self.half, zero);
        let apart = lone - mean;
        let mut tensor = self.projector;
        for c in 0..6 {
            tensor[c] = apart.mul_add(self.projector[c], slope * self.rest[c]);
            if c < 3 {
                tensor[c] += mean;
            }
        }
        tensor
    }
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
        let principal = Principal::of(&deviator, Lanes::splat(size));
        let sorted = principal.sorted();
        // Rotations want a positive definite matrix.
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
        let principal = Principal::of(&[zero; 6], zero);
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
