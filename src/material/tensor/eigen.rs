//! Symmetric 3×3 matrices over lanes: products of small matrices and eigen decomposition.
//!
//! Components in the order `xx, yy, zz, xy, xz, yz`.
use crate::simd::{Lanes, Vector, VectorMask, each};

/// A symmetric matrix for each lane.
pub type Symmetric<V = Lanes> = [V; 6];

/// Eigenvalues and eigenvectors for each lane: `A = Σ value[k] vector[k] ⊗ vector[k]`, in no order.
#[derive(Clone, Copy, Debug)]
pub struct Eigen<V = Lanes> {
    /// Eigenvalues.
    pub value: [V; 3],
    /// Unit eigenvectors, `vector[k][axis]`.
    pub vector: [[V; 3]; 3],
}

/// Sweeps over the three off-diagonal components; 4 are enough as a rule.
const SWEEPS: usize = 8;
/// An off-diagonal component counts as zero when its square is below this times the product of its
/// diagonal components: 2^-108, that is a quarter of the rounding error.
const NEGLIGIBLE: f64 = 3.081_487_911_019_577_4e-33;

/// Eigen decomposition of positive definite matrices by cyclic Jacobi rotations (Golub & Van Loan,
/// Matrix Computations, section 8.5), accurate for equal and nearly equal eigenvalues.
///
/// With `plane` the components xz and yz are taken as zero and one rotation is exact. A lane stops
/// changing when it has converged, so its bits do not depend on the lanes beside it.
#[inline(always)]
pub fn decompose<V: Vector>(matrix: &Symmetric<V>, plane: bool) -> Eigen<V> {
    let zero = V::splat(0.0);
    let one = V::splat(1.0);
    let [mut xx, mut yy, mut zz, mut xy, mut xz, mut yz] = *matrix;
    let mut vector = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    if plane {
        let rotation = Rotation::new(&mut xx, &mut yy, &mut xy);
        vector[0] = [rotation.cos, -rotation.sin, zero];
        vector[1] = [rotation.sin, rotation.cos, zero];
        return Eigen { value: [xx, yy, zz], vector };
    }
    for _ in 0..SWEEPS {
        let converged = negligible(xy, xx, yy) & negligible(xz, xx, zz) & negligible(yz, yy, zz);
        if converged.all() {
            break;
        }
        let rotation = Rotation::new(&mut xx, &mut yy, &mut xy);
        rotation.apply(&mut xz, &mut yz);
        rotation.apply_vectors(&mut vector, 0, 1);
        let rotation = Rotation::new(&mut xx, &mut zz, &mut xz);
        rotation.apply(&mut xy, &mut yz);
        rotation.apply_vectors(&mut vector, 0, 2);
        let rotation = Rotation::new(&mut yy, &mut zz, &mut yz);
        rotation.apply(&mut xy, &mut xz);
        rotation.apply_vectors(&mut vector, 1, 2);
    }
    Eigen { value: [xx, yy, zz], vector }
}

/// Whether an off-diagonal component counts as zero beside its diagonal components.
#[inline(always)]
fn negligible<V: Vector>(off: V, p: V, q: V) -> V::Mask {
    (off * off).le(p * q * NEGLIGIBLE)
}

struct Rotation<V> {
    cos: V,
    sin: V,
}

impl<V: Vector> Rotation<V> {
    /// The rotation that zeroes `off`, applied to the 2×2 block; none where it counts as zero.
    #[inline(always)]
    fn new(p: &mut V, q: &mut V, off: &mut V) -> Self {
        let skip = negligible(*off, *p, *q);
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let difference = *q - *p;
        let twice = *off + *off;
        let root = difference.mul_add(difference, twice * twice).sqrt();
        let tangent = (twice * one.copysign(difference)) / (difference.abs() + root);
        let tangent = skip.select(zero, tangent);
        let cos = one / tangent.mul_add(tangent, one).sqrt();
        *p = tangent.neg_mul_add(*off, *p);
        *q = tangent.mul_add(*off, *q);
        *off = skip.select(*off, zero);
        Self { cos, sin: tangent * cos }
    }

    #[inline(always)]
    fn apply(&self, p: &mut V, q: &mut V) {
        let (old_p, old_q) = (*p, *q);
        *p = self.sin.neg_mul_add(old_q, self.cos * old_p);
        *q = self.sin.mul_add(old_p, self.cos * old_q);
    }

    #[inline(always)]
    fn apply_vectors(&self, vector: &mut [[V; 3]; 3], p: usize, q: usize) {
        for axis in 0..3 {
            let (mut a, mut b) = (vector[p][axis], vector[q][axis]);
            self.apply(&mut a, &mut b);
            (vector[p][axis], vector[q][axis]) = (a, b);
        }
    }
}

impl<V: Vector> Eigen<V> {
    /// The matrix with the same eigenvectors and these eigenvalues.
    #[inline(always)]
    pub fn compose(&self, value: &[V; 3], plane: bool) -> Symmetric<V> {
        let v = &self.vector;
        if plane {
            let zero = V::splat(0.0);
            let entry =
                |i: usize, j: usize| (value[0] * v[0][i]).mul_add(v[0][j], value[1] * v[1][i] * v[1][j]);
            return [entry(0, 0), entry(1, 1), value[2], entry(0, 1), zero, zero];
        }
        let scale = |k: usize| each(v[k], |component| value[k] * component);
        let scaled = [scale(0), scale(1), scale(2)];
        let entry = |i: usize, j: usize| {
            scaled[0][i].mul_add(v[0][j], scaled[1][i].mul_add(v[1][j], scaled[2][i] * v[2][j]))
        };
        [entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)]
    }
}

/// Determinant.
#[inline(always)]
pub fn determinant<V: Vector>(matrix: &Symmetric<V>) -> V {
    let [xx, yy, zz, xy, xz, yz] = *matrix;
    let minor_x = yz.neg_mul_add(yz, yy * zz);
    let minor_y = yz.neg_mul_add(xz, xy * zz);
    let minor_z = yy.neg_mul_add(xz, xy * yz);
    xz.mul_add(minor_z, xy.neg_mul_add(minor_y, xx * minor_x))
}

/// Upper bound of the eigenvalues (Gershgorin).
#[inline(always)]
pub fn greatest_bound<V: Vector>(matrix: &Symmetric<V>) -> V {
    let [xx, yy, zz, xy, xz, yz] = *matrix;
    let (xy, xz, yz) = (xy.abs(), xz.abs(), yz.abs());
    (xx + (xy + xz)).max(yy + (xy + yz)).max(zz + (xz + yz))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::LANES;

    /// Random rotation from a unit quaternion.
    fn rotation(seed: u64) -> [[f64; 3]; 3] {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let q: [f64; 4] = std::array::from_fn(|_| next());
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        let [w, x, y, z] = q.map(|c| c / norm);
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }

    #[test]
    fn eigenvalues_distinct_equal_and_nearly_equal() {
        let sets = [
            [1.0, 2.0, 3.0],
            [1.0, 1.0, 1.0],
            [1.0, 1.0 + 1e-9, 1.0 - 3e-14],
            [0.5, 0.5, 4.0],
            [1.0, 1.0 + 1e-15, 9.0],
            [1e-3, 1.0, 1e3],
            [1.0 + 1e-7, 1.0, 1.0 - 1e-7],
            [0.04, 0.0400001, 25.0],
        ];
        for seed in 0..200 {
            let frames: [[[f64; 3]; 3]; LANES] =
                std::array::from_fn(|lane| rotation(seed * 31 + lane as u64 + 1));
            let entry = |i: usize, j: usize| {
                Lanes::new(std::array::from_fn(|lane| {
                    (0..3).map(|k| frames[lane][i][k] * sets[lane][k] * frames[lane][j][k]).sum()
                }))
            };
            let matrix = [entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)];
            let eigen = decompose(&matrix, false);
            let back = eigen.compose(&eigen.value, false);
            for lane in 0..LANES {
                let scale = sets[lane].iter().copied().fold(0.0, f64::max);
                let mut values = eigen.value.map(|v| v.to_array()[lane]);
                let mut expected = sets[lane];
                values.sort_by(f64::total_cmp);
                expected.sort_by(f64::total_cmp);
                for k in 0..3 {
                    assert!((values[k] - expected[k]).abs() <= 2e-15 * scale, "{values:?} {expected:?}");
                }
                for c in 0..6 {
                    let error = (back[c].to_array()[lane] - matrix[c].to_array()[lane]).abs();
                    assert!(error <= 6e-15 * scale, "{error} of {scale}");
                }
            }
        }
    }

    #[test]
    fn a_lane_does_not_see_its_neighbours() {
        let row = |xx: f64, xy: f64| [xx, 1.0, 1.1, xy, 0.3 * xy, -0.2 * xy];
        let mixed: Symmetric = std::array::from_fn(|c| {
            Lanes::new(std::array::from_fn(|lane| row(1.0 + 0.1 * lane as f64, 0.05 * lane as f64)[c]))
        });
        let together = decompose(&mixed, false);
        for lane in 0..LANES {
            let alone = decompose(&mixed.map(|c| Lanes::splat(c.to_array()[lane])), false);
            for k in 0..3 {
                assert_eq!(
                    together.value[k].to_array()[lane].to_bits(),
                    alone.value[k].to_array()[0].to_bits()
                );
            }
        }
    }

    #[test]
    fn plane_strain_needs_one_rotation() {
        let matrix = [1.3, 0.8, 1.1, 0.4, 0.0, 0.0].map(Lanes::splat);
        let eigen = decompose(&matrix, true);
        let back = eigen.compose(&eigen.value, true);
        for c in 0..6 {
            assert!((back[c].to_array()[0] - matrix[c].to_array()[0]).abs() < 4e-16);
        }
    }
}
