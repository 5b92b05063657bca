//! `agimp material`: drives one particle of a model along a path of deformation.
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Deserialize;

use super::Failure;
use crate::material::driver::{Matrix, Point, increment};
use crate::material::parameters::NotAModel;
use crate::material::{Parameters, build};

/// Arguments of `agimp material`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Model and parameters as in a job, for example 'model = "hencky", young = 1e6, poisson = 0.3';
    /// or the name of a TOML file that holds them
    #[arg(long, value_name = "TOML|FILE")]
    pub model: String,

    /// Density of the undeformed material, kg/m³ (for the wave speed)
    #[arg(long, default_value_t = 1000.0)]
    pub density: f64,

    /// Equal parts into which each step of the path is divided
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub substeps: u32,

    /// The path: CSV or JSON. Each row is the total deformation since the start: 3 numbers are
    /// logarithmic strains along the axes, 9 are the deformation gradient row by row. JSON is a list of
    /// rows, alone or under the key "path" or "rows"; a row is a list of numbers (the 9 may be nested) or
    /// an object that holds one under "F" or "eps_log"; its other keys do not matter.
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
}

/// Why `agimp material` cannot go on.
#[derive(Debug, thiserror::Error)]
enum MaterialError {
    /// A file cannot be read.
    #[error("cannot read {}: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        error: std::io::Error,
    },
    /// The text of the model is none.
    #[error(transparent)]
    Model(#[from] NotAModel),
    /// The density is not above zero.
    #[error("--density {0} is out of range: it must be above 0 (kg/m³)")]
    Density(f64),
    /// The path is no valid JSON.
    #[error("{}: {error}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and why.
        error: serde_json::Error,
    },
    /// A row of the path.
    #[error("{}, row {row}: {reason}", path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// Row, counted from 1 without header and comments.
        row: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// The result cannot be written.
    #[error("cannot write the result: {0}")]
    Write(#[from] std::io::Error),
}

/// Drives the particle and prints its states as CSV.
///
/// # Errors
/// Model or path cannot be used, or standard output cannot be written.
pub fn execute(args: &Arguments) -> Result<(), Failure> {
    drive(args, &mut std::io::stdout().lock()).map_err(|error| match error {
        MaterialError::Write(error) => error.into(),
        other => Failure::Usage(other.to_string()),
    })
}

/// Runs the command and writes CSV to `out`: the undeformed state, then one line per row of the path.
fn drive(args: &Arguments, out: &mut dyn Write) -> Result<(), MaterialError> {
    let parameters = model(&args.model)?;
    if !(args.density > 0.0 && args.density.is_finite()) {
        return Err(MaterialError::Density(args.density));
    }
    let path = read_path(&args.path)?;
    let material = build(&parameters, args.density);
    let names = ["xx", "yy", "zz", "xy", "xz", "yz"];
    write!(out, "row")?;
    for tensor in ["tau", "b"] {
        for name in names {
            write!(out, ",{tensor}_{name}")?;
        }
    }
    for name in material.history_names() {
        write!(out, ",{name}")?;
    }
    writeln!(out, ",plastic_work,elastic_energy,wave_speed")?;
    let mut point = Point::new(material.as_ref());
    let histories = material.history_names().len();
    let mut write_state = |point: &Point, row: usize| -> Result<(), MaterialError> {
        write!(out, "{row}")?;
        for value in point.stress.iter().chain(&point.elastic).chain(&point.history[..histories]) {
            write!(out, ",{value:e}")?;
        }
        writeln!(out, ",{:e},{:e},{:e}", point.work, point.energy(), point.wave_speed)?;
        Ok(())
    };
    write_state(&point, 0)?;
    let mut last = Deformation::Strain([0.0; 3]);
    for (i, &target) in path.iter().enumerate() {
        for part in 1..=args.substeps {
            let share = f64::from(part) / f64::from(args.substeps);
            let before = last.towards(&target, f64::from(part - 1) / f64::from(args.substeps));
            let after = last.towards(&target, share);
            if let (Deformation::Strain(before), Deformation::Strain(after)) = (before, after) {
                point.stretch(std::array::from_fn(|k| after[k] - before[k]));
                continue;
            }
            match increment(&before.gradient(), &after.gradient()) {
                Some(step) => point.deform(&step),
                None => {
                    let reason =
                        "the straight line from the row before to this deformation gradient passes a \
                                  singular one; give rows between them"
                            .to_string();
                    return Err(MaterialError::Row { path: args.path.clone(), row: i + 1, reason });
                }
            }
        }
        last = target;
        write_state(&point, i + 1)?;
    }
    Ok(())
}

/// A total deformation.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Deformation {
    /// Logarithmic strains along the axes.
    Strain([f64; 3]),
    /// Deformation gradient.
    Gradient(Matrix),
}

impl Deformation {
    fn gradient(&self) -> Matrix {
        match *self {
            Self::Gradient(f) => f,
            Self::Strain(strain) => std::array::from_fn(|i| {
                std::array::from_fn(|j| if i == j { libm::exp(strain[i]) } else { 0.0 })
            }),
        }
    }

    /// Between this (`share` 0) and `target` (`share` 1): linear in strains if both are strains, else
    /// in the deformation gradient.
    fn towards(&self, target: &Self, share: f64) -> Self {
        let between = |a: f64, b: f64| if share == 1.0 { b } else { (b - a).mul_add(share, a) };
        if let (Self::Strain(a), Self::Strain(b)) = (self, target) {
            return Self::Strain(std::array::from_fn(|k| between(a[k], b[k])));
        }
        let (a, b) = (self.gradient(), target.gradient());
        Self::Gradient(std::array::from_fn(|i| std::array::from_fn(|j| between(a[i][j], b[i][j]))))
    }

    fn from_numbers(numbers: &[f64]) -> Result<Self, String> {
        if let Some(bad) = numbers.iter().find(|x| !x.is_finite()) {
            return Err(format!("{bad} is not a finite number"));
        }
        match *numbers {
            [x, y, z] => Ok(Self::Strain([x, y, z])),
            [a, b, c, d, e, f, g, h, i] => {
                let gradient = [[a, b, c], [d, e, f], [g, h, i]];
                let determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
                if determinant > 0.0 {
                    Ok(Self::Gradient(gradient))
                } else {
                    Err(format!(
                        "a deformation gradient has a determinant above 0, this one has {determinant}"
                    ))
                }
            }
            _ => Err(format!(
                "expected 3 numbers (logarithmic strains) or 9 (deformation gradient), found {}",
                numbers.len()
            )),
        }
    }
}

/// Reads a model from TOML text or from the file of that name.
fn model(text: &str) -> Result<Parameters, MaterialError> {
    if text.contains('=') {
        return Ok(text.parse()?);
    }
    Ok(read(Path::new(text))?.parse()?)
}

fn read(path: &Path) -> Result<String, MaterialError> {
    std::fs::read_to_string(path).map_err(|error| MaterialError::Read { path: path.to_path_buf(), error })
}

#[derive(Deserialize)]
#[serde(untagged)]
enum JsonPath {
    Alone(Vec<JsonRow>),
    Keyed {
        #[serde(alias = "rows")]
        path: Vec<JsonRow>,
    },
}

#[derive(Deserialize)]
#[serde(untagged)]
enum JsonRow {
    Flat(Vec<f64>),
    Nested(Vec<Vec<f64>>),
    Keyed {
        #[serde(rename = "F", alias = "eps_log")]
        deformation: Box<JsonRow>,
    },
}

impl JsonRow {
    fn numbers(self) -> Vec<f64> {
        match self {
            Self::Flat(numbers) => numbers,
            Self::Nested(rows) => rows.concat(),
            Self::Keyed { deformation } => deformation.numbers(),
        }
    }
}

fn read_path(path: &Path) -> Result<Vec<Deformation>, MaterialError> {
    let text = read(path)?;
    let failed = |row: usize, reason: String| MaterialError::Row { path: path.to_path_buf(), row, reason };
    if text.trim_start().starts_with(['[', '{']) {
        let rows = match serde_json::from_str(&text) {
            Ok(JsonPath::Alone(rows) | JsonPath::Keyed { path: rows }) => rows,
            Err(error) => return Err(MaterialError::Json { path: path.to_path_buf(), error }),
        };
        return (rows.into_iter().map(JsonRow::numbers).enumerate())
            .map(|(i, numbers)| Deformation::from_numbers(&numbers).map_err(|reason| failed(i + 1, reason)))
            .collect();
    }
    let mut path = Vec::new();
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    for (i, line) in lines.enumerate() {
        let fields: Result<Vec<f64>, _> =
            line.split(',').map(|field| field.trim().parse::<f64>().map_err(|_| field.trim())).collect();
        match fields {
            Ok(numbers) => {
                let row = path.len() + 1;
                path.push(Deformation::from_numbers(&numbers).map_err(|reason| failed(row, reason))?);
            }
            // A header.
            Err(_) if i == 0 => {}
            Err(field) => return Err(failed(path.len() + 1, format!("'{field}' is not a number"))),
        }
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(model: &str, name: &str, path: &str, substeps: u32) -> Result<String, String> {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join(name);
        std::fs::write(&file, path).unwrap();
        let args = Arguments { model: model.to_string(), density: 1000.0, substeps, path: file };
        let mut out = Vec::new();
        drive(&args, &mut out).map_err(|error| error.to_string())?;
        Ok(String::from_utf8(out).unwrap())
    }

    const METAL: &str = "model = \"von_mises\", young = 1e9, poisson = 0.25, yield_stress = 1e6";

    fn last_row(text: &str) -> Vec<f64> {
        text.lines().last().unwrap().split(',').map(|field| field.parse().unwrap()).collect()
    }

    #[test]
    fn strains_and_gradients_agree() {
        let strains =
            result(METAL, "path.csv", "x, y, z\n# shear\n0.001,-0.001,0\n0.01,-0.01,0\n", 4).unwrap();
        assert_eq!(strains.lines().count(), 4);
        let f = |a: f64| format!("[[{:e},0,0],[0,{:e},0],[0,0,1]]", libm::exp(a), libm::exp(-a));
        let json = format!("{{\"path\": [{}, {}]}}", f(0.001), f(0.01));
        let gradients = result(METAL, "path.json", &json, 1).unwrap();
        // Perfect plasticity in pure shear: tau = σ_y / √3.
        for text in [&strains, &gradients] {
            assert!((last_row(text)[1] - 1e6 / 3.0_f64.sqrt()).abs() < 1e-3);
        }
        assert!(strains.starts_with("row,tau_xx,tau_yy,tau_zz,tau_xy,tau_xz,tau_yz,b_xx"));
        assert!(strains.lines().next().unwrap().contains(",plastic_strain,plastic_work,"));
    }

    #[test]
    fn errors_say_what_would_be_right() {
        let error = |model: &str, path: &str| result(model, "path.csv", path, 1).unwrap_err();
        assert!(error(METAL, "1,2\n").contains("row 1: expected 3 numbers"));
        assert!(error(METAL, "0,0,0\n0,a,0\n").contains("row 2: 'a' is not a number"));
        assert!(error(METAL, "1,0,0,0,1,0,0,0,-1\n").contains("determinant above 0"));
        let bad = "model = \"hencky\", young = 1e6, poisson = 0.5";
        assert!(
            error(bad, "0,0,0").contains("poisson = 0.5 is out of range: it must be above -1 and below 0.5")
        );
        assert!(error("model = \"rubber\", young = 1e6", "0,0,0").contains("rubber"));
        assert!(error("no_such_file.toml", "0,0,0").contains("cannot read no_such_file.toml"));
    }
}
