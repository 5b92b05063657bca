//! A material point driven along a prescribed path: `mod.rs` of deformation, `control.rs` of strains and
//! stresses; `tangent.rs`: the derivative of its stress.
use nalgebra::Matrix3;

use super::tensor::strain::Strain;
use super::{HISTORIES, Material, State, Step, undrained};
use crate::simd::{LANES, Lanes, Vector};

pub mod control;
mod tangent;

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
    /// Where the last update began.
    trial: Trial,
}

/// Arguments of an update.
#[derive(Clone, Copy, Debug)]
struct Trial {
    elastic: [f64; 6],
    history: [f64; HISTORIES],
    step: Step,
}

impl<'a> Point<'a> {
    /// An undeformed point.
    pub fn new(material: &'a dyn Material) -> Self {
        let (elastic, history) = ([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], material.initial_history());
        let mut point = Self {
            material,
            elastic,
            stress: [0.0; 6],
            history,
            work: 0.0,
            wave_speed: 0.0,
            dt: 0.0,
            size: 0.0,
            cell: f64::INFINITY,
            trial: Trial { elastic, history, step: Step::rest(true) },
        };
        point.set_trial(elastic);
        point
    }

    /// From now on the point is of this material, the same with water that cannot leave its pores.
    pub fn close_drains(&mut self, material: &'a dyn Material) {
        undrained::consolidate(&self.elastic, &mut self.history);
        undrained::consolidate_as(&self.history, &mut self.trial.history);
        self.material = material;
    }

    /// Applies an increment of deformation: the deformation gradient becomes `increment · F`.
    pub fn deform(&mut self, increment: &Matrix) {
        let increment = tensor(increment);
        self.set_trial(components(&(increment * full(&self.elastic) * increment.transpose())));
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

    /// Excess pressure of water that cannot leave the pores, Pa; 0 where there is none.
    pub fn excess_pore_pressure(&self) -> f64 {
        let modulus = self.material.water_modulus();
        if modulus > 0.0 { undrained::excess_pressure(modulus, &self.elastic, &self.history) } else { 0.0 }
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
        self.trial = Trial { elastic: trial, history: self.history, step };
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
    let inverse = tensor(from).try_inverse().filter(|inverse| inverse.iter().all(|x| x.is_finite()))?;
    Some(rows(&(tensor(to) * inverse)))
}

/// Logarithmic strain `½ ln F Fᵀ` of a deformation gradient.
pub fn logarithmic_strain(gradient: &Matrix) -> [f64; 6] {
    let gradient = tensor(gradient);
    let strain = Strain::of(&components(&(gradient * gradient.transpose())).map(Lanes::splat), false);
    let scalar = |lanes: Lanes| lanes.to_array()[0];
    let mean = scalar(strain.trace) / 3.0;
    std::array::from_fn(|c| scalar(strain.deviator[c]) + if c < 3 { mean } else { 0.0 })
}

/// Determinant.
pub fn determinant(a: &Matrix) -> f64 {
    tensor(a).determinant()
}

fn tensor(a: &Matrix) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| a[i][j])
}

fn rows(a: &Matrix3<f64>) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[(i, j)]))
}

/// A symmetric tensor from its components xx, yy, zz, xy, xz, yz.
fn full(s: &[f64; 6]) -> Matrix3<f64> {
    Matrix3::new(s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2])
}

/// The components of a symmetric tensor.
fn components(a: &Matrix3<f64>) -> [f64; 6] {
    [a.m11, a.m22, a.m33, a.m12, a.m13, a.m23]
}
