//! States of a particle as rows of numbers.
use std::io::Write;

use agimp::material::driver::control::COMPONENTS;
use agimp::material::driver::{Matrix, Point, determinant, logarithmic_strain};

/// A state, as input of a row.
#[derive(Debug)]
pub(super) struct Stage<'a> {
    /// Time, s.
    pub time: f64,
    /// Deformation gradient.
    pub gradient: Matrix,
    /// The particle.
    pub point: &'a Point<'a>,
}

/// Invariants of a state for charts.
#[cfg_attr(not(feature = "post"), expect(dead_code, reason = "only charts show them"))]
#[derive(Clone, Copy, Debug)]
pub(super) struct Invariants {
    /// Strain of volume `tr ε` and of shear `√(2/3) |dev ε|`.
    pub strain: [f64; 2],
    /// Cauchy pressure and `q = √(3/2) |dev σ|`, Pa.
    pub stress: [f64; 2],
}

/// All states.
#[derive(Debug)]
pub(super) struct Table {
    names: Vec<String>,
    histories: usize,
    /// Whether there are columns of water in the pores, and of the tangent.
    has_water: bool,
    has_tangent: bool,
    rows: Vec<Vec<f64>>,
    /// For pictures.
    pub invariants: Vec<Invariants>,
}

impl Table {
    /// No states yet, of a material with these history variables, perhaps with water in its pores, perhaps
    /// with its tangents.
    pub(super) fn new(histories: &[&str], has_water: bool, has_tangent: bool) -> Self {
        let mut names = Vec::new();
        let tensor = |name: &'static str| COMPONENTS.iter().map(move |c| format!("{name}_{c}"));
        names.extend(tensor("tau").chain(tensor("b")));
        names.extend(histories.iter().map(|name| (*name).to_owned()));
        names.extend(["plastic_work", "elastic_energy", "wave_speed", "time"].map(str::to_owned));
        names.extend(tensor("strain").chain(tensor("stress")));
        names.extend(["p", "q", "lode_angle"].map(str::to_owned));
        if has_water {
            names.extend(["excess_pore_pressure", "effective_p"].map(str::to_owned));
        }
        if has_tangent {
            let of_row = |row| COMPONENTS.iter().map(move |column| format!("tangent_{row}_{column}"));
            names.extend(COMPONENTS.iter().flat_map(of_row));
            names.push("tangent_error".to_owned());
        }
        let (rows, invariants) = (Vec::new(), Vec::new());
        Self { names, histories: histories.len(), has_water, has_tangent, rows, invariants }
    }

    /// Appends a state.
    pub(super) fn push(&mut self, stage: &Stage) {
        let Stage { time, gradient, point } = stage;
        let volume = determinant(gradient);
        let strain = logarithmic_strain(gradient);
        let stress = point.stress.map(|stress| stress / volume);
        let [volumetric, shear, _] = invariants(&strain);
        let [mean, norm, lode] = invariants(&stress);
        let (p, q) = (-mean / 3.0, 1.5_f64.sqrt() * norm);
        let mut row = [point.stress, point.elastic].concat();
        row.extend(&point.history[..self.histories]);
        row.extend([point.work, point.energy(), point.wave_speed, *time]);
        row.extend(strain.iter().chain(&stress));
        row.extend([p, q, lode]);
        if self.has_water {
            let excess = point.excess_pore_pressure();
            row.extend([excess, p - excess]);
        }
        if self.has_tangent {
            row.extend(point.tangent().iter().flatten());
            row.push(point.tangent_error());
        }
        // No negative zeros.
        self.rows.push(row.into_iter().map(|number| number + 0.0).collect());
        let strain = [volumetric, (2.0_f64 / 3.0).sqrt() * shear];
        self.invariants.push(Invariants { strain, stress: [p, q] });
    }

    /// Writes CSV.
    ///
    /// # Errors
    /// `out` cannot be written.
    pub(super) fn write(&self, out: &mut dyn Write) -> std::io::Result<()> {
        writeln!(out, "row,{}", self.names.join(","))?;
        for (i, row) in self.rows.iter().enumerate() {
            write!(out, "{i}")?;
            for number in row {
                write!(out, ",{number:e}")?;
            }
            writeln!(out)?;
        }
        Ok(())
    }
}

/// Trace, norm of the deviator, and Lode angle in degrees: 0 in extension (two lesser values equal), 60 in
/// compression (two greater values equal), 30 in pure shear and where there is no deviator.
fn invariants(tensor: &[f64; 6]) -> [f64; 3] {
    let trace = tensor[0] + tensor[1] + tensor[2];
    let deviator: [f64; 6] = std::array::from_fn(|c| if c < 3 { tensor[c] - trace / 3.0 } else { tensor[c] });
    let [xx, yy, zz, xy, xz, yz] = deviator;
    let norm = (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)).sqrt();
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let cosine = 3.0 * 6.0_f64.sqrt() * determinant / norm.powi(3);
    let is_isotropic = norm <= 1e-12 * trace.abs() || norm == 0.0;
    let angle = if is_isotropic { 30.0 } else { libm::acos(cosine.clamp(-1.0, 1.0)).to_degrees() / 3.0 };
    [trace, norm, angle]
}
