//! A material point driven along a prescribed path: `mod.rs` of deformation, `control.rs` of strains and
//! stresses.
use super::tensor::strain::Strain;
use super::{HISTORIES, Material, State, Step};
use crate::simd::{LANES, Lanes, Vector};

pub mod control;

/// A 3×3 matrix, `m[i][j]` in row i and column j.
pub type Matrix = [[f64; 3]; 3];

/// One particle of a material, with scalar state. Symmetric tensors: `xx, yy, zz, xy, xz, yz`.
#[derive(Clone, Debug)]
pub struct Point<'a> {
    material: &'a dyn Material,
    /// Elastic left Cauchy-Green tensor.
    pub elastic: [f64; 6],
    /// Kirchhoff stress, Pa.
    pub stress: [f64; 6],
    /// History variables.
    pub history: [f64; HISTORIES],
    /// Plastic work so far per reference volume, J/m³.
    pub work: f64,
    /// Bound of the wave speeds, m/s.
    pub wave_speed: f64,
    /// Length of the steps to come, s; 0: nothing flows by its rate.
    pub dt: f64,
    /// Edge of the cells that regularise softening, m; 0: none.
    pub size: f64,
    /// Edge of the cells on which it moves, m: bounds the step of viscous flow. Infinite: none.
    pub cell: f64,
}

impl<'a> Point<'a> {
    /// An undeformed point.
    pub fn new(material: &'a dyn Material) -> Self {
        let mut point = Self {
            material,
            elastic: [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            stress: [0.0; 6],
            history: material.initial_history(),
            work: 0.0,
            wave_speed: 0.0,
            dt: 0.0,
            size: 0.0,
            cell: f64::INFINITY,
        };
        point.set_trial(point.elastic);
        point
    }

    /// Applies an increment of deformation: the deformation gradient becomes `increment · F`.
    pub fn deform(&mut self, increment: &Matrix) {
        let b = full(&self.elastic);
        let trial = product(&product(increment, &b), &transposed(increment));
        self.set_trial([trial[0][0], trial[1][1], trial[2][2], trial[0][1], trial[0][2], trial[1][2]]);
    }

    /// Stretches along the coordinate axes by `exp(strain)`.
    pub fn stretch(&mut self, strain: [f64; 3]) {
        let mut increment = [[0.0; 3]; 3];
        for axis in 0..3 {
            increment[axis][axis] = libm::exp(strain[axis]);
        }
        self.deform(&increment);
    }

    /// Elastic energy per reference volume, J/m³.
    pub fn energy(&self) -> f64 {
        let mut state = State::new(self.elastic.map(Lanes::splat));
        state.history = self.history.map(Lanes::splat);
        self.material.energy(&state, self.is_plane()).to_array()[0]
    }

    fn is_plane(&self) -> bool {
        self.elastic[4] == 0.0 && self.elastic[5] == 0.0
    }

    fn set_trial(&mut self, trial: [f64; 6]) {
        self.elastic = trial;
        let mut state = State::new(trial.map(Lanes::splat));
        state.history = self.history.map(Lanes::splat);
        let step =
            Step { dt: self.dt, cell: self.cell, size: [self.size; LANES], ..Step::rest(self.is_plane()) };
        self.material.update(&mut state, &step);
        let scalar = |lanes: Lanes| lanes.to_array()[0];
        self.elastic = state.elastic.map(scalar);
        self.stress = state.stress.map(scalar);
        self.history = state.history.map(scalar);
        self.work += scalar(state.work);
        self.wave_speed = scalar(state.wave_speed);
    }
}

/// The increment that takes the deformation gradient `from` to `to`: `to · from⁻¹`; none if `from` is
/// singular.
pub fn increment(from: &Matrix, to: &Matrix) -> Option<Matrix> {
    let cofactor = |i: usize, j: usize| {
        let (r, s) = ((i + 1) % 3, (i + 2) % 3);
        let (p, q) = ((j + 1) % 3, (j + 2) % 3);
        from[r][p] * from[s][q] - from[r][q] * from[s][p]
    };
    let determinant = (0..3).map(|j| from[0][j] * cofactor(0, j)).sum::<f64>();
    if determinant == 0.0 || !determinant.is_finite() {
        return None;
    }
    let inverse = std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant));
    Some(product(to, &inverse))
}

/// Logarithmic strain `½ ln F Fᵀ` of a deformation gradient.
pub fn logarithmic_strain(gradient: &Matrix) -> [f64; 6] {
    let b = product(gradient, &transposed(gradient));
    let tensor = [b[0][0], b[1][1], b[2][2], b[0][1], b[0][2], b[1][2]];
    let strain = Strain::of(&tensor.map(Lanes::splat), false);
    let scalar = |lanes: Lanes| lanes.to_array()[0];
    let mean = scalar(strain.trace) / 3.0;
    std::array::from_fn(|c| scalar(strain.deviator[c]) + if c < 3 { mean } else { 0.0 })
}

/// Determinant.
pub fn determinant(a: &Matrix) -> f64 {
    let minor = |j: usize, k: usize| a[1][j] * a[2][k] - a[1][k] * a[2][j];
    a[0][0] * minor(1, 2) - a[0][1] * minor(0, 2) + a[0][2] * minor(0, 1)
}

fn full(s: &[f64; 6]) -> Matrix {
    [[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]]
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| a[i][0].mul_add(b[0][j], a[i][1].mul_add(b[1][j], a[i][2] * b[2][j])))
    })
}
