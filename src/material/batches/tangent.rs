//! Tangents: the derivative of the stress at the end of an update by the deformation, for Newton's method.
//!
//! A law is an isotropic function of the trial tensor b: with principal values `b_k = exp(2 ε_k)` and the
//! unit vectors `n_k` of their directions, `τ = Σ τ_k(ε) n_k ⊗ n_k`. A further deformation with the
//! gradient l of displacements, symmetric part d and skew part w, in the axes `n_k`, changes b by
//! `l b + b lᵀ`, and so τ by
//!
//! ```text
//! δτ_kk = Σ_m A_km d_mm,   A_km = ∂τ_k/∂ε_m
//! δτ_km = G_km d_km + w_km τ_m - τ_k w_km,   G_km = (τ_k - τ_m) (b_k + b_m)/(b_k - b_m)
//! ```
//!
//! for k ≠ m: the divided differences of Daleckii and Krein (1965); of equal values they are the derivatives
//! `(A_kk - A_km - A_mk + A_mm)/2`. A comes from the law itself, with numbers that carry derivatives
//! ([`Dual`]).
use crate::material::tensor::eigen::{Symmetric, decompose};
use crate::material::{Law, State, Step};
use crate::simd::math::{exp, ln};
use crate::simd::{Dual, Lanes, Mask, Vector, VectorMask};

/// Difference of logarithmic strains below which G is a derivative: there the difference has lost half its
/// digits, and the derivative changes less.
const NEAR: f64 = 3e-8;
/// Norm of the deviator of a strain below which it is replaced by one of this norm: laws that yield under
/// pressure alone have a corner without one.
const NONE: f64 = 1e-10;

/// Derivative of the Kirchhoff stress of a batch at the end of an update by a deformation of the body in
/// which it ends: 18 numbers for each particle.
#[derive(Clone, Copy, Debug)]
pub struct Tangent {
    /// Two of three principal directions; the third is normal to them.
    directions: [[Lanes; 3]; 2],
    /// A, Pa.
    normal: [[Lanes; 3]; 3],
    /// G of the pairs 12, 13 and 23, Pa.
    shear: [Lanes; 3],
}

/// The pairs of `Tangent::shear`.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Tangent of a law at a trial state.
#[cold]
#[inline(never)]
pub(super) fn of(law: &impl Law, trial: &State, step: &Step) -> Tangent {
    let eigen = decompose(&trial.elastic, step.plane);
    let strain = apart(eigen.value.map(|value| ln(value) * 0.5));
    let axis = |k: usize| {
        let square = exp(strain[k] + strain[k]);
        Dual::variable(square, k, square + square)
    };
    let zero = Dual::splat(0.0);
    let mut state = State::new([axis(0), axis(1), axis(2), zero, zero, zero]);
    state.history = trial.history.map(Dual::from);
    law.respond(&mut state, &Step { plane: false, shock: None, ..*step });
    let stress = [0, 1, 2].map(|k| state.stress[k].value());
    let normal = [0, 1, 2].map(|k| [0, 1, 2].map(|m| state.stress[k].slope(m)));
    let shear = PAIRS.map(|[k, m]| {
        let limit = (normal[k][k] - normal[k][m] - normal[m][k] + normal[m][m]) * 0.5;
        let difference = strain[k] - strain[m];
        let [above, below] = [difference, -difference].map(exp);
        let whole = (stress[k] - stress[m]) * (above + below) / (above - below);
        difference.abs().lt(Lanes::splat(NEAR)).select(limit, whole)
    });
    Tangent { directions: [eigen.vector[0], eigen.vector[1]], normal, shear }
}

/// The same principal strains, with at least a slight deviator.
fn apart(strain: [Lanes; 3]) -> [Lanes; 3] {
    let mean = (strain[0] + strain[1] + strain[2]) * (1.0 / 3.0);
    let [x, y, z] = strain.map(|strain| strain - mean);
    let has_none = (x * x + y * y + z * z).lt(Lanes::splat(NONE * NONE));
    let slight = Lanes::splat(NONE * 0.5_f64.sqrt());
    [
        has_none.select(mean + slight, strain[0]),
        has_none.select(mean, strain[1]),
        has_none.select(mean - slight, strain[2]),
    ]
}

impl Tangent {
    /// With a stress beside that is a function of the volume, with this derivative by its logarithm, Pa.
    pub(in crate::material) fn with_bulk(mut self, bulk: Lanes) -> Self {
        for entry in self.normal.iter_mut().flatten() {
            *entry += bulk;
        }
        self
    }

    /// The one whose normal part is the mean of A and its transpose: of laws whose flow is not associated,
    /// for solvers of symmetric systems.
    pub fn symmetric(mut self) -> Self {
        for [k, m] in PAIRS {
            let mean = (self.normal[k][m] + self.normal[m][k]) * 0.5;
            (self.normal[k][m], self.normal[m][k]) = (mean, mean);
        }
        self
    }

    /// Greatest stiffness along a principal direction, Pa.
    pub fn greatest(&self) -> Lanes {
        self.normal[0][0].max(self.normal[1][1]).max(self.normal[2][2])
    }

    /// That of `other` in the lanes of a mask, and this one in the others.
    pub(in crate::material) fn with_lanes(mut self, mask: Mask, other: &Self) -> Self {
        let all = |tangent: &mut Self, from: &Self| {
            let own = tangent.directions.iter_mut().chain(&mut tangent.normal).flatten();
            let own = own.chain(&mut tangent.shear);
            let from = from.directions.iter().chain(&from.normal).flatten().chain(&from.shear);
            own.zip(from).for_each(|(own, from)| *own = mask.select(*from, *own));
        };
        all(&mut self, other);
        self
    }

    /// Principal directions, `directions[k][axis]`.
    fn axes(&self) -> [[Lanes; 3]; 3] {
        let [a, b] = self.directions;
        let normal = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
        [a, b, [normal(1, 2), normal(2, 0), normal(0, 1)]]
    }

    /// Change of the Kirchhoff stress, Pa, by a small further deformation: `gradient[i][j]` is the derivative
    /// of displacement i along axis j of the deformed body, `stress` the stress that it has (Pa).
    ///
    /// The change of the Cauchy stress σ is `δτ/J - σ tr l`.
    pub fn change(&self, stress: &Symmetric, gradient: &[[Lanes; 3]; 3]) -> Symmetric {
        let axes = self.axes();
        let sum = |terms: [Lanes; 3]| terms[0] + terms[1] + terms[2];
        // The symmetric part in principal axes.
        let rate = [0, 1, 2].map(|k| {
            [0, 1, 2].map(|m| {
                let along = |i: usize| {
                    sum([0, 1, 2].map(|j| (gradient[i][j] + gradient[j][i]) * axes[m][j])) * axes[k][i]
                };
                sum([0, 1, 2].map(along)) * 0.5
            })
        });
        let mut own = [[Lanes::splat(0.0); 3]; 3];
        for k in 0..3 {
            own[k][k] = sum([0, 1, 2].map(|m| self.normal[k][m] * rate[m][m]));
        }
        for (pair, [k, m]) in PAIRS.into_iter().enumerate() {
            own[k][m] = self.shear[pair] * rate[k][m];
            own[m][k] = own[k][m];
        }
        let tau = |i: usize, j: usize| stress[if i == j { i } else { i + j + 2 }];
        let spin = |i: usize, j: usize| (gradient[i][j] - gradient[j][i]) * 0.5;
        let component = |i: usize, j: usize| {
            let rotated = sum([0, 1, 2].map(|k| spin(i, k) * tau(k, j) - tau(i, k) * spin(k, j)));
            let along = |k: usize| sum([0, 1, 2].map(|m| own[k][m] * axes[m][j])) * axes[k][i];
            rotated + sum([0, 1, 2].map(along))
        };
        [component(0, 0), component(1, 1), component(2, 2), component(0, 1), component(0, 2), component(1, 2)]
    }

    /// The part that is not due to rotation as a matrix in the axes of the coordinates, Pa: components of
    /// `δτ - w τ + τ w` (rows) by those of d, of which the last three count twice (columns).
    pub fn matrix(&self) -> [[Lanes; 6]; 6] {
        let zero = Lanes::splat(0.0);
        let mut columns = [[zero; 6]; 6];
        for (c, [i, j]) in [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]].into_iter().enumerate() {
            let mut gradient = [[zero; 3]; 3];
            gradient[i][j] += Lanes::splat(0.5);
            gradient[j][i] += Lanes::splat(0.5);
            columns[c] = self.change(&[zero; 6], &gradient);
        }
        std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]))
    }
}

#[cfg(test)]
mod tests;
