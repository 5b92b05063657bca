//! Paths of `agimp material`: rows of deformation, or of strains and stresses by name.
use std::path::Path;

use serde::Deserialize;

use super::error::{MaterialError, read};
use agimp::material::driver::Matrix;
use agimp::material::driver::control::{COMPONENTS, Prescribed, Target};

/// Loading path from a file.
#[derive(Debug)]
pub(super) enum Drive {
    /// Total deformations.
    Deformation(Vec<Deformation>),
    /// Strains and stresses, with the time at the end of each row.
    Control(Vec<Row>),
}

impl Drive {
    /// Whether it has no row.
    pub(super) fn is_empty(&self) -> bool {
        match self {
            Self::Deformation(rows) => rows.is_empty(),
            Self::Control(rows) => rows.is_empty(),
        }
    }
}

/// A row of prescribed strains and stresses.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// Time since the start, s.
    pub time: f64,
    /// Strain or stress, by component, at that time.
    pub target: Target,
}

/// A total deformation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Deformation {
    /// Logarithmic strains along the axes.
    Strain([f64; 3]),
    /// Deformation gradient.
    Gradient(Matrix),
}

impl Deformation {
    pub(super) fn gradient(&self) -> Matrix {
        match *self {
            Self::Gradient(f) => f,
            Self::Strain(strain) => std::array::from_fn(|i| {
                std::array::from_fn(|j| if i == j { libm::exp(strain[i]) } else { 0.0 })
            }),
        }
    }

    /// Between this (`share` 0) and `target` (`share` 1): linear in strains if both are strains, else
    /// in the deformation gradient.
    pub(super) fn towards(&self, target: &Self, share: f64) -> Self {
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
                        "found a deformation gradient with the determinant {determinant}; expected more than 0"
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

/// Reads a path from CSV or JSON.
pub(super) fn read_path(path: &Path) -> Result<Drive, MaterialError> {
    let text = read(path)?;
    let failed = |row: usize, reason: String| MaterialError::Row { path: path.to_path_buf(), row, reason };
    if text.trim_start().starts_with(['[', '{']) {
        let rows = match serde_json::from_str(&text) {
            Ok(JsonPath::Alone(rows) | JsonPath::Keyed { path: rows }) => rows,
            Err(error) => return Err(MaterialError::Json { path: path.to_path_buf(), error }),
        };
        return (rows.into_iter().map(JsonRow::numbers).enumerate())
            .map(|(i, numbers)| Deformation::from_numbers(&numbers).map_err(|reason| failed(i + 1, reason)))
            .collect::<Result<_, _>>()
            .map(Drive::Deformation);
    }
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    if let Some(header) = lines.clone().next()
        && is_control(header)
    {
        return control(header, lines.skip(1), &failed).map(Drive::Control);
    }
    let mut path = Vec::new();
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
    Ok(Drive::Deformation(path))
}

/// Whether a header names prescribed components: strains, stresses, the shear or the time.
fn is_control(header: &str) -> bool {
    let begins = |name: &str| name.starts_with("strain_") || name.starts_with("stress_");
    header.split(',').map(str::trim).any(|name| begins(name) || matches!(name, "shear" | "time"))
}

/// A column of a table of strains and stresses.
#[derive(Clone, Copy, PartialEq)]
enum Column {
    Time,
    Shear,
    Strain(usize),
    Stress(usize),
}

impl Column {
    fn of(name: &str) -> Result<Self, String> {
        let component = |name: &str| COMPONENTS.iter().position(|component| *component == name);
        let found = match name.split_once('_') {
            None if name == "time" => Some(Self::Time),
            None if name == "shear" => Some(Self::Shear),
            Some(("strain", end)) => component(end).map(Self::Strain),
            Some(("stress", end)) => component(end).map(Self::Stress),
            _ => None,
        };
        found.ok_or_else(|| {
            format!(
                "found the unknown column '{name}'; expected time, shear, and for each of {} either strain_* (logarithmic) or \
                 stress_* (Cauchy, Pa)",
                COMPONENTS.join(", ")
            )
        })
    }

    /// The component that it prescribes, if any.
    fn component(self) -> Option<usize> {
        match self {
            Self::Strain(c) | Self::Stress(c) => Some(c),
            _ => None,
        }
    }
}

/// Reads rows of strains and stresses. Components without a column have no strain.
fn control<'a>(
    header: &str,
    lines: impl Iterator<Item = &'a str>,
    failed: &impl Fn(usize, String) -> MaterialError,
) -> Result<Vec<Row>, MaterialError> {
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let columns: Vec<Column> = names
        .iter()
        .map(|name| Column::of(name))
        .collect::<Result<_, _>>()
        .map_err(|reason| failed(0, reason))?;
    for (i, column) in columns.iter().enumerate() {
        let same = |other: &Column| match column.component() {
            Some(c) => other.component() == Some(c),
            None => other == column,
        };
        if let Some(first) = columns[..i].iter().position(same) {
            let reason = format!("'{}' and '{}' prescribe the same", names[first], names[i]);
            return Err(failed(0, reason));
        }
    }
    let (mut rows, mut time) = (Vec::new(), 0.0);
    for (i, line) in lines.enumerate() {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        if fields.len() != columns.len() {
            let reason =
                format!("expected {} numbers as in the header, found {}", columns.len(), fields.len());
            return Err(failed(i + 1, reason));
        }
        let mut row = Row { time, target: Target { shear: 0.0, components: [Prescribed::Strain(0.0); 6] } };
        for (column, field) in columns.iter().zip(fields) {
            let number = field.parse::<f64>().ok().filter(|number| number.is_finite());
            let Some(number) = number else {
                return Err(failed(i + 1, format!("'{field}' is not a finite number")));
            };
            match *column {
                Column::Time if number < time => {
                    return Err(failed(
                        i + 1,
                        format!("found time {number}; expected at least {time}, that of the previous row"),
                    ));
                }
                Column::Time => row.time = number,
                Column::Shear => row.target.shear = number,
                Column::Strain(c) if number.abs() > 20.0 => {
                    let reason = format!("strain_{} = {number} is out of range: at most 20", COMPONENTS[c]);
                    return Err(failed(i + 1, reason));
                }
                Column::Strain(c) => row.target.components[c] = Prescribed::Strain(number),
                Column::Stress(c) => row.target.components[c] = Prescribed::Stress(number),
            }
        }
        time = row.time;
        rows.push(row);
    }
    Ok(rows)
}
