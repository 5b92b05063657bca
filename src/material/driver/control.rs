//! A point of which some strains and some stresses are prescribed.
use super::super::tensor::strain::tensor_of;
use nalgebra::{DMatrix, DVector, Matrix3};

use super::{Matrix, Point, determinant, full, increment, rows};
use crate::material::Material;
use crate::simd::{Lanes, Vector};

/// Names of the components of symmetric tensors.
pub const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "xy", "xz", "yz"];

/// Newton iterations at most.
const MOST: usize = 60;
/// Halvings of a step that has no solution.
const HALVINGS: u32 = 8;
/// Greatest strain that one iteration adds.
const REACH: f64 = 0.2;
/// Greatest strain in which a solution is searched.
const FAR: f64 = 20.0;

/// Prescribed value of a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Prescribed {
    /// Logarithmic strain since the start.
    Strain(f64),
    /// Cauchy stress, Pa.
    Stress(f64),
}

/// Prescribed state at the end of a step. The deformation gradient is `(I + γ e_x ⊗ e_y) exp(E)`, where γ and
/// some components of E are prescribed; the other components are those of the Cauchy stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Simple shear γ along x over y.
    pub shear: f64,
    /// E or the stress, component by component.
    pub components: [Prescribed; 6],
}

impl Target {
    /// The same with strains that count from these.
    pub fn since(&self, start: &[f64; 6]) -> Self {
        let components = std::array::from_fn(|c| match self.components[c] {
            Prescribed::Strain(strain) => Prescribed::Strain(start[c] + strain),
            stress @ Prescribed::Stress(_) => stress,
        });
        Self { components, ..*self }
    }
}

/// No strain has the prescribed stress.
#[derive(Clone, Debug, thiserror::Error)]
#[error(
    "found no deformation with {wanted}; the nearest has {found}. Either the material cannot carry it, as after failure, or the row is too far from the previous one: add rows in between or increase --substeps"
)]
pub struct NoSolution {
    wanted: String,
    found: String,
}

/// A point with its total deformation.
#[derive(Clone, Debug)]
pub struct Controlled<'a> {
    /// The point.
    pub point: Point<'a>,
    shear: f64,
    strain: [f64; 6],
    /// Modulus of pressure waves in the undeformed material, Pa.
    modulus: f64,
}

impl<'a> Controlled<'a> {
    /// An undeformed point.
    pub fn new(material: &'a dyn Material) -> Self {
        let modulus = material.density() * material.wave_speed() * material.wave_speed();
        Self { point: Point::new(material), shear: 0.0, strain: [0.0; 6], modulus }
    }

    /// As [`Point::close_drains`].
    pub fn close_drains(&mut self, material: &'a dyn Material) {
        self.point.close_drains(material);
        self.modulus = material.density() * material.wave_speed() * material.wave_speed();
    }

    /// The deformation gradient.
    pub fn gradient(&self) -> Matrix {
        gradient(self.shear, &self.strain)
    }

    /// E, the logarithm of the stretch.
    pub fn strain(&self) -> [f64; 6] {
        self.strain
    }

    /// Cauchy stress, Pa.
    pub fn stress(&self) -> [f64; 6] {
        let volume = determinant(&self.gradient());
        self.point.stress.map(|stress| stress / volume)
    }

    /// Moves to a target in equal steps of the prescribed components, each of `dt` (s).
    ///
    /// # Errors
    /// No strain has the prescribed stress.
    pub fn go(&mut self, target: &Target, steps: u32, dt: f64) -> Result<(), NoSolution> {
        let (shear, strain, stress) = (self.shear, self.strain, self.stress());
        for step in 1..=steps {
            let share = f64::from(step) / f64::from(steps);
            let between =
                |from: f64, to: f64| if step == steps { to } else { (to - from).mul_add(share, from) };
            let components = std::array::from_fn(|c| match target.components[c] {
                Prescribed::Strain(end) => Prescribed::Strain(between(strain[c], end)),
                Prescribed::Stress(end) => Prescribed::Stress(between(stress[c], end)),
            });
            self.step(&Target { shear: between(shear, target.shear), components }, dt, HALVINGS)?;
        }
        Ok(())
    }

    /// One step, or two halves of it where there is no solution in one.
    fn step(&mut self, target: &Target, dt: f64, halvings: u32) -> Result<(), NoSolution> {
        let error = match self.solve(target, dt) {
            Ok(next) => {
                *self = next;
                return Ok(());
            }
            Err(error) => error,
        };
        if halvings == 0 {
            return Err(error);
        }
        let stress = self.stress();
        let components = std::array::from_fn(|c| match target.components[c] {
            Prescribed::Strain(end) => Prescribed::Strain(0.5 * (self.strain[c] + end)),
            Prescribed::Stress(end) => Prescribed::Stress(0.5 * (stress[c] + end)),
        });
        let middle = Target { shear: 0.5 * (self.shear + target.shear), components };
        let mut next = self.clone();
        // Whichever half fails, the error names the whole target.
        let halves = next.step(&middle, 0.5 * dt, halvings - 1);
        halves.and_then(|()| next.step(target, 0.5 * dt, halvings - 1)).map_err(|_| error)?;
        *self = next;
        Ok(())
    }

    /// The point after a step in which the free strains are as given.
    fn moved(&self, target: &Target, strain: [f64; 6], dt: f64) -> Option<Self> {
        let mut next = self.clone();
        (next.shear, next.strain, next.point.dt) = (target.shear, strain, dt);
        next.point.deform(&increment(&self.gradient(), &next.gradient())?);
        next.point.stress.iter().all(|stress| stress.is_finite()).then_some(next)
    }

    /// The point where the free components have the prescribed stresses: by Newton's method with differences
    /// for derivatives, and where that fails, as at kinks of a yield surface, by Broyden's from the elastic
    /// stiffness.
    fn solve(&self, target: &Target, dt: f64) -> Result<Self, NoSolution> {
        let mut search = Search { start: self, target, dt, free: Vec::new() };
        let mut strain = self.strain;
        for (c, prescribed) in target.components.iter().enumerate() {
            match *prescribed {
                Prescribed::Strain(end) => strain[c] = end,
                Prescribed::Stress(wanted) => search.free.push((c, wanted)),
            }
        }
        search.run(strain, false).or_else(|_| search.run(strain, true))
    }
}

/// The search for the free strains.
struct Search<'a, 'b> {
    start: &'b Controlled<'a>,
    target: &'b Target,
    dt: f64,
    /// Components with prescribed stress, Pa.
    free: Vec<(usize, f64)>,
}

impl<'a> Search<'a, '_> {
    fn residual(&self, at: &Controlled) -> Vec<f64> {
        let stress = at.stress();
        self.free.iter().map(|&(c, wanted)| stress[c] - wanted).collect()
    }

    fn moved(&self, strain: [f64; 6]) -> Option<Controlled<'a>> {
        self.start.moved(self.target, strain, self.dt)
    }

    fn failed(&self, at: &Controlled) -> NoSolution {
        let stress = at.stress();
        let list = |value: &dyn Fn(usize, f64) -> f64| {
            let one =
                |&(c, wanted): &(usize, f64)| format!("stress_{} = {:.4e}", COMPONENTS[c], value(c, wanted));
            self.free.iter().map(one).collect::<Vec<_>>().join(", ")
        };
        NoSolution { wanted: list(&|_, wanted| wanted) + " Pa", found: list(&|c, _| stress[c]) + " Pa" }
    }

    /// Stiffness of the undeformed material with a Poisson's ratio of 1/4, column by column.
    fn elastic(&self) -> Vec<Vec<f64>> {
        let third = self.start.modulus / 3.0;
        let entry = |i: usize, j: usize| match (i < 3 && j < 3, i == j) {
            (true, true) => 3.0 * third,
            (true, false) => third,
            (false, true) => 2.0 * third,
            (false, false) => 0.0,
        };
        let column = |&(j, _): &(usize, f64)| self.free.iter().map(|&(i, _)| entry(i, j)).collect();
        self.free.iter().map(column).collect()
    }

    /// Stiffness from differences, in the directions of the errors of the stress.
    fn differences(&self, strain: &[f64; 6], errors: &[f64]) -> Option<Vec<Vec<f64>>> {
        let mut columns = Vec::new();
        for (k, &(c, _)) in self.free.iter().enumerate() {
            let difference = 1e-8_f64.max(1e-7 * strain[c].abs()).copysign(-errors[k]);
            let mut beside = *strain;
            beside[c] += difference;
            let changed = self.residual(&self.moved(beside)?);
            columns.push((0..errors.len()).map(|i| (changed[i] - errors[i]) / difference).collect());
        }
        Some(columns)
    }

    fn run(&self, mut strain: [f64; 6], secant: bool) -> Result<Controlled<'a>, NoSolution> {
        let Some(mut now) = self.moved(strain) else { return Err(self.failed(self.start)) };
        let mut errors = self.residual(&now);
        let (mut columns, mut fresh) = (self.elastic(), true);
        for _ in 0..if secant { 10 * MOST } else { MOST } {
            let stress =
                now.stress().iter().fold(1e-6 * self.start.modulus, |most: f64, s| most.max(s.abs()));
            if greatest(&errors) <= 1e-10 * stress {
                return Ok(now);
            }
            if greatest(&strain) > FAR {
                break;
            }
            if !secant {
                match self.differences(&strain, &errors) {
                    Some(own) => columns = own,
                    None => break,
                }
            }
            let better =
                solution(&columns, &errors).and_then(|change| self.descend(&strain, &errors, change));
            let Some((next, moved)) = better else {
                if !secant || fresh {
                    break;
                }
                (columns, fresh) = (self.elastic(), true);
                continue;
            };
            let own = self.residual(&moved);
            if secant {
                update(&mut columns, &self.free, [&strain, &next], [&errors, &own]);
                fresh = false;
            }
            (strain, now, errors) = (next, moved, own);
        }
        Err(self.failed(&now))
    }

    /// The first of shorter and shorter steps with less error.
    fn descend(
        &self,
        strain: &[f64; 6],
        errors: &[f64],
        change: Vec<f64>,
    ) -> Option<([f64; 6], Controlled<'a>)> {
        let mut share = (REACH / greatest(&change)).min(1.0);
        while share > 1e-5 {
            let mut next = *strain;
            for (&(c, _), change) in self.free.iter().zip(&change) {
                next[c] -= share * change;
            }
            if let Some(moved) = self.moved(next)
                && square(&self.residual(&moved)) < square(errors)
            {
                return Some((next, moved));
            }
            share *= 0.5;
        }
        None
    }
}

fn greatest(numbers: &[f64]) -> f64 {
    numbers.iter().fold(0.0, |most: f64, number| most.max(number.abs()))
}

fn square(numbers: &[f64]) -> f64 {
    numbers.iter().map(|number| number * number).sum()
}

/// Broyden's update: the stiffness explains the last step.
fn update(columns: &mut [Vec<f64>], free: &[(usize, f64)], strain: [&[f64; 6]; 2], errors: [&[f64]; 2]) {
    let step: Vec<f64> = free.iter().map(|&(c, _)| strain[1][c] - strain[0][c]).collect();
    let length = square(&step);
    for i in 0..step.len() {
        let explained: f64 = (0..step.len()).map(|k| columns[k][i] * step[k]).sum();
        let missing = errors[1][i] - errors[0][i] - explained;
        for k in 0..step.len() {
            columns[k][i] += missing * step[k] / length;
        }
    }
}

/// `(I + γ e_x ⊗ e_y) exp(E)`
fn gradient(shear: f64, strain: &[f64; 6]) -> Matrix {
    let trace = strain[0] + strain[1] + strain[2];
    let deviator: [f64; 6] = std::array::from_fn(|c| if c < 3 { strain[c] - trace / 3.0 } else { strain[c] });
    let half = deviator.map(|component| Lanes::splat(0.5 * component));
    let stretch = tensor_of(Lanes::splat(0.5 * trace), &half, false).map(|lanes| lanes.to_array()[0]);
    rows(&(Matrix3::new(1.0, shear, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0) * full(&stretch)))
}

/// Solves `Σ columns[k] x[k] = right`; none if the matrix is singular.
fn solution(columns: &[Vec<f64>], right: &[f64]) -> Option<Vec<f64>> {
    let matrix = DMatrix::from_fn(right.len(), right.len(), |i, k| columns[k][i]);
    let x = matrix.lu().solve(&DVector::from_column_slice(right))?;
    x.iter().all(|x| x.is_finite()).then(|| x.as_slice().to_vec())
}

#[cfg(test)]
mod newton;
#[cfg(test)]
mod tests {
    use super::Prescribed::{Strain, Stress};
    use super::*;
    use crate::material::Parameters;

    fn built(text: &str) -> Box<dyn Material> {
        text.parse::<Parameters>().unwrap().build(1000.0)
    }

    fn axial(strain: f64, lateral: f64) -> Target {
        let none = Strain(0.0);
        Target {
            shear: 0.0,
            components: [Stress(lateral), Stress(lateral), Strain(strain), none, none, none],
        }
    }

    /// Linear hardening in uniaxial stress: the Kirchhoff stress is `σ_y + H κ` with
    /// `κ = (a - σ_y/E) / (1 + H/E)`.
    #[test]
    fn a_bar_in_tension_follows_its_closed_form() {
        let material =
            built("model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e4, hardening = 1e5");
        let mut bar = Controlled::new(material.as_ref());
        bar.go(&axial(0.2, 0.0), 5, 0.0).unwrap();
        let plastic = (0.2 - 1e-2) / 1.1;
        assert!((bar.point.stress[2] - 1e4 - 1e5 * plastic).abs() < 1e-5, "{:?}", bar.point.stress);
        assert!((bar.point.history[0] - plastic).abs() < 1e-9);
        assert!(bar.stress()[0].abs() < 1e-6);
    }

    /// Mohr-Coulomb in triaxial compression under Cauchy stress: `N p + 2 c √N`, up to the volume in the term
    /// of cohesion.
    #[test]
    fn soil_fails_in_triaxial_compression_as_coulomb_says() {
        let material =
            built("model = 'mohr_coulomb', young = 1e8, poisson = 0.3, friction_angle = 30, cohesion = 1e4");
        let mut soil = Controlled::new(material.as_ref());
        let (all, none) = (Stress(-1e5), Strain(0.0));
        let confined = Target { shear: 0.0, components: [all, all, all, none, none, none] };
        soil.go(&confined, 1, 0.0).unwrap();
        assert!(soil.stress()[..3].iter().all(|stress| (stress + 1e5).abs() < 1e-4));
        let start = soil.strain[2];
        soil.go(&axial(start - 0.05, -1e5), 20, 0.0).unwrap();
        let volume = determinant(&soil.gradient());
        let expected = 3.0 * 1e5 + 2.0 * 1e4 * 3.0_f64.sqrt() / volume;
        assert!((soil.stress()[2] + expected).abs() < 1e-3, "{} {expected}", soil.stress()[2]);
        // Beyond failure there is no strain.
        let Err(error) =
            soil.go(&Target { shear: 0.0, components: [all, all, Stress(-5e5), none, none, none] }, 1, 0.0)
        else {
            panic!("beyond failure")
        };
        assert!(error.to_string().contains("stress_zz = -5.0000e5 Pa; the nearest has "), "{error}");
    }

    /// Viscous shear between plates under a constant normal stress.
    #[test]
    fn a_fluid_is_sheared_under_pressure() {
        let material = built("model = 'fluid', bulk_modulus = 1e6, viscosity = 2");
        let mut fluid = Controlled::new(material.as_ref());
        let none = Strain(0.0);
        let target = Target { shear: 0.1, components: [none, Stress(-5e3), none, none, none, none] };
        fluid.go(&target, 1000, 1e-3).unwrap();
        let stress = fluid.stress();
        assert!((stress[3] - 0.2).abs() < 1e-3 && (stress[1] + 5e3).abs() < 1e-3, "{stress:?}");
    }
}
