//! Total strain of a particle, elastic and plastic, since it was made.
//!
//! Particles carry `e = b - 1` with the total left Cauchy-Green tensor `b = F Fᵀ`, so that small strains keep
//! their digits. A step with the velocity gradient ∇v gives `f (1 + e) fᵀ - 1`, `f = 1 + Δt ∇v`. In plane
//! strain no component out of the plane changes.
//!
//! Material that is stirred without end is strained without end. Components of e stop at `GREATEST`, and the
//! least stretch is bounded below by its rounding error beside the greatest: strains stay finite for any
//! motion.
use super::chunk::Chunk;
use crate::material::tensor::eigen::decompose;
use crate::simd::{Lanes, Vector, VectorMask, each};

/// Components that particles carry: xx, yy, xy in plane strain, else xx, yy, zz, xy, xz, yz.
pub const fn columns(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Rows and columns of the components that particles carry.
pub const fn places(dimension: usize) -> &'static [(usize, usize)] {
    match dimension {
        2 => &[(0, 0), (1, 1), (0, 1)],
        _ => &[(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)],
    }
}

/// Greatest component of `e`, a stretch of 1e12: beyond it all are reduced alike.
const GREATEST: f64 = 1e24;

/// Components of `e`; in plane strain the last three are zero.
pub type Components = [f64; 6];

/// Components of a particle, which carries them from column `first` on.
pub fn read<const D: usize>(chunk: &Chunk<D>, first: usize, p: usize) -> Components {
    std::array::from_fn(|c| if c < columns(D) { chunk.carried(first + c)[p] } else { 0.0 })
}

/// Writes what [`read`] reads.
pub fn write<const D: usize>(chunk: &mut Chunk<D>, first: usize, p: usize, e: &Components) {
    (0..columns(D)).for_each(|c| chunk.carried_mut(first + c)[p] = e[c]);
}

/// `e` of a batch of particles after a step of `dt` (s) with their velocity gradients (1/s).
pub fn after_step<V: Vector, const D: usize>(e: &[V; 6], gradient: &[[V; D]; D], dt: f64) -> [V; 6] {
    let zero = V::splat(0.0);
    let mut tensor = [[zero; D]; D];
    for (&(i, j), &value) in places(D).iter().zip(e) {
        (tensor[i][j], tensor[j][i]) = (value, value);
    }
    // f (1 + e) fᵀ - 1 = e + g (1 + e) + ((1 + e) + g (1 + e)) gᵀ with g = f - 1.
    let g = gradient.map(|row| each(row, |slope| slope * dt));
    let mut one_plus = tensor;
    (0..D).for_each(|i| one_plus[i][i] += V::splat(1.0));
    let mut pushed = [[zero; D]; D];
    for i in 0..D {
        for j in 0..D {
            for k in 0..D {
                pushed[i][j] += g[i][k] * one_plus[k][j];
            }
        }
    }
    let mut new = [zero; 6];
    let mut greatest = zero;
    for (new, &(i, j)) in new.iter_mut().zip(places(D)) {
        let mut other = zero;
        for k in 0..D {
            other += (one_plus[i][k] + pushed[i][k]) * g[j][k];
        }
        *new = tensor[i][j] + pushed[i][j] + other;
        greatest = greatest.max(new.abs());
    }
    let most = V::splat(GREATEST);
    let factor = most.lt(greatest).select(most / greatest, V::splat(1.0));
    each(new, |component| component * factor)
}

/// `b = 1 + e`, components xx, yy, zz, xy, xz, yz.
pub fn tensor(dimension: usize, e: &Components) -> [f64; 6] {
    match dimension {
        2 => [1.0 + e[0], 1.0 + e[1], 1.0, e[2], 0.0, 0.0],
        _ => [1.0 + e[0], 1.0 + e[1], 1.0 + e[2], e[3], e[4], e[5]],
    }
}

/// Logarithmic (Hencky) strain `½ ln(1 + e)`, components xx, yy, zz, xy, yz, xz as VTK orders them. Where the
/// greatest principal stretch is more than 1e8 times the least, the latter is lost to rounding, and
/// approximate at most.
pub fn logarithmic(dimension: usize, e: &Components) -> [f64; 6] {
    let [xx, yy, zz, xy, xz, yz] = match dimension {
        2 => [e[0], e[1], 0.0, e[2], 0.0, 0.0],
        _ => std::array::from_fn(|c| e[c]),
    };
    let plane = dimension == 2;
    let axes = decompose(&tensor(dimension, e).map(Lanes::splat), plane);
    // By the vectors of b and with the digits of e: v · e v.
    let along = axes.vector.map(|vector| {
        let [x, y, z] = vector.map(|component| component.to_array()[0]);
        xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + xz * x * z + yz * y * z)
    });
    let least = f64::EPSILON * (1.0 + along.iter().copied().fold(0.0, f64::max)) - 1.0;
    let strains = along.map(|along| Lanes::splat(0.5 * libm::log1p(along.max(least))));
    let [xx, yy, zz, xy, xz, yz] = axes.compose(&strains, plane).map(|component| component.to_array()[0]);
    [xx, yy, zz, xy, yz, xz]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// [`super::after_step`] of one particle.
    fn after_step<const D: usize>(e: &Components, gradient: &[[f64; D]; D], dt: f64) -> Components {
        let gradient = gradient.map(|row| row.map(Lanes::splat));
        super::after_step(&e.map(Lanes::splat), &gradient, dt).map(|component| component.to_array()[7])
    }

    /// A bar that is drawn out at a constant rate, in 2D and 3D, while it turns: `ln` of its length.
    #[test]
    fn a_drawn_bar_has_the_logarithm_of_its_length() {
        let steps = 20_000;
        let (rate, dt) = (0.7, 1.0 / f64::from(steps));
        let (mut e, mut plane) = ([0.0; 6], [0.0; 6]);
        for _ in 0..steps {
            e = after_step(&e, &[[rate, -0.2, 0.0], [0.2, -0.35, 0.0], [0.0, 0.0, -0.35]], dt);
            plane = after_step(&plane, &[[rate, 0.0], [0.0, -rate]], dt);
        }
        let strain = logarithmic(2, &plane);
        assert!((strain[0] - 0.7).abs() < 2e-5 && (strain[1] + 0.7).abs() < 2e-5, "{strain:?}");
        let strain = logarithmic(3, &e);
        assert!((strain[2] + 0.35).abs() < 2e-5, "{strain:?}");
        assert!((strain[..3].iter().sum::<f64>()).abs() < 5e-5, "no change of volume: {strain:?}");
    }

    /// Simple shear by an amount k: principal strains ± asinh(k / 2), exact in one step.
    #[test]
    fn simple_shear() {
        let k = 1.5;
        let strain = logarithmic(2, &after_step(&[0.0; 6], &[[0.0, k], [0.0, 0.0]], 1.0));
        let radius = (0.25 * (strain[0] - strain[1]).powi(2) + strain[3] * strain[3]).sqrt();
        assert!((radius - libm::asinh(0.5 * k)).abs() < 1e-14 && (strain[0] + strain[1]).abs() < 1e-14);
    }

    /// Plane strain that is sheared to and fro by unlike amounts, as stirred sand is: strains stay finite,
    /// and symmetric as long as rounding leaves the least stretch.
    #[test]
    fn what_is_stirred_without_end_has_finite_strains() {
        let mut e = [0.0; 6];
        let mut greatest: f64 = 0.0;
        for step in 0..200_000 {
            let (a, b) = (0.02 * f64::from(step % 7), 0.03 * f64::from(step % 5));
            e = after_step(&e, &[[0.0, a], [b, a * b]], 1.0);
            let strain = logarithmic(2, &e);
            assert!(strain.iter().all(|component| component.is_finite()), "step {step}: {strain:?}");
            greatest = strain[..2].iter().fold(greatest, |most, component| most.max(component.abs()));
        }
        assert!(
            greatest > 20.0 && e.iter().all(|component| component.abs() <= GREATEST * (1.0 + 1e-15)),
            "{greatest} {e:?}"
        );
    }

    /// A strain of 1e-12 has all its digits.
    #[test]
    fn small_strains_keep_their_digits() {
        let e = after_step(&[0.0; 6], &[[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], 1e-12);
        assert!((logarithmic(3, &e)[0] / 1e-12 - 1.0).abs() < 1e-11);
    }
}
