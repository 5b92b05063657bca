//! Numbers of the particles in a view, and their ranges over all times.
use std::path::Path;

use crate::frame::{Frame, is_integer};
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::PointField;
use agimp::io::snapshot::content::fields::COMPONENTS;
use agimp::io::snapshot::content::fields::Values;

/// One number for each particle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Column {
    /// Name, for example `pressure` or `velocity_x`.
    pub name: String,
    /// The field that it is from.
    pub source: PointField,
    /// The part of the field.
    pub part: Part,
}

/// Part of a field that a column has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// All of it.
    Whole,
    /// Magnitude of the vector.
    Magnitude,
    /// That component.
    Component(usize),
}

impl Column {
    /// The columns for the fields asked for; by default for all that the files show but identifiers, of the
    /// velocity its magnitude and of the stress nothing, as its measures are fields of their own.
    pub(super) fn chosen(
        shown: &[PointField],
        asked: Option<&[PointField]>,
        path: &Path,
    ) -> Result<Vec<Self>, FileError> {
        let whole = |field: PointField| Self { name: field.name().into(), source: field, part: Part::Whole };
        let speed = || Self { name: "speed".into(), source: PointField::Velocity, part: Part::Magnitude };
        let components = |field: PointField, names: &[&str]| -> Vec<Self> {
            let named = names.iter().enumerate();
            named
                .map(|(i, n)| Self {
                    name: format!("{}_{n}", field.name()),
                    source: field,
                    part: Part::Component(i),
                })
                .collect()
        };
        let fields = match asked {
            Some(asked) => asked.to_vec(),
            None => shown
                .iter()
                .copied()
                .filter(|f| !matches!(f, PointField::Id | PointField::Stress))
                .filter(|f| *f != PointField::Velocity || !shown.contains(&PointField::Speed))
                .collect(),
        };
        if fields.is_empty() {
            return Err(FileError::Refused {
                path: path.into(),
                reason: "the file shows no field that could give colours".into(),
            });
        }
        let mut columns: Vec<Self> = Vec::new();
        for field in fields {
            columns.extend(match field {
                PointField::Velocity if asked.is_some() => {
                    let mut columns = components(field, COMPONENTS[0]);
                    columns.push(speed());
                    columns
                }
                PointField::Velocity => vec![speed()],
                PointField::Stress => components(field, COMPONENTS[1]),
                other => vec![whole(other)],
            });
        }
        let mut seen = Vec::new();
        columns.retain(|column| {
            let new = !seen.contains(&column.name);
            seen.push(column.name.clone());
            new
        });
        Ok(columns)
    }

    /// Whether it holds small whole numbers.
    pub(super) fn is_integer(&self) -> bool {
        is_integer(self.source)
    }

    /// Its values in a frame; empty if the frame lacks the field.
    pub(super) fn values(&self, frame: &Frame) -> Vec<f64> {
        match frame.fields.iter().find(|(field, _)| *field == self.source).map(|(_, values)| values) {
            Some(Values::Id(ids)) => ids.iter().map(|&id| id as f64).collect(),
            Some(Values::Integer(numbers)) => numbers.iter().copied().map(f64::from).collect(),
            Some(Values::Single(values, width)) => {
                self.of_rows(values.iter().copied().map(f64::from), *width)
            }
            Some(Values::Real(values, width)) => self.of_rows(values.iter().copied(), *width),
            None => Vec::new(),
        }
    }

    fn of_rows(&self, values: impl Iterator<Item = f64>, width: usize) -> Vec<f64> {
        let values: Vec<f64> = values.collect();
        let rows = values.chunks_exact(width.max(1));
        match self.part {
            Part::Whole => values,
            Part::Magnitude => rows.map(|row| row.iter().map(|v| v * v).sum::<f64>().sqrt()).collect(),
            Part::Component(i) => rows.map(|row| row.get(i).copied().unwrap_or(0.0)).collect(),
        }
    }

    /// Identifiers in a frame, if that is what the column holds.
    pub(super) fn ids<'a>(&self, frame: &'a Frame) -> Option<&'a [u64]> {
        frame.fields.iter().find(|(field, _)| *field == self.source).and_then(|(_, values)| match values {
            Values::Id(ids) => Some(ids.as_slice()),
            _ => None,
        })
    }
}

/// The fields that the columns are from, each once.
pub(super) fn sources(columns: &[Column]) -> Vec<PointField> {
    let mut fields: Vec<PointField> = columns.iter().map(|column| column.source).collect();
    fields.sort();
    fields.dedup();
    fields
}

/// Scale from the values of a column to whole numbers `0 ..= levels - 1`.
///
/// Level `q` stands for `unit · sinh(low + q (high - low) / (levels - 1))`: near zero levels have equal
/// distances, far from it equal ratios. So one outlier does not make all other values the same level. Whole
/// numbers are kept as they are, from `low` on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub unit: f64,
    pub low: f64,
    pub high: f64,
    pub levels: u32,
    pub integer: bool,
}

impl Scale {
    /// The level of a value; NaN gets the lowest.
    pub(super) fn level(&self, value: f64) -> u16 {
        let most = f64::from(self.levels - 1);
        let place = if self.integer {
            value - self.low
        } else if self.high > self.low {
            ((value / self.unit).asinh() - self.low) / (self.high - self.low) * most
        } else {
            0.0
        };
        place.round().clamp(0.0, most) as u16
    }

    /// Value of a level.
    #[cfg(test)]
    pub(super) fn value(&self, level: u16) -> f64 {
        if self.integer {
            return self.low + f64::from(level);
        }
        let most = f64::from((self.levels - 1).max(1));
        self.unit * (self.low + f64::from(level) / most * (self.high - self.low)).sinh()
    }
}

/// Bounds over all frames, from a first pass over them.
pub(super) struct LeafMaxima {
    /// Lower and upper corner of the box round all particles, m.
    pub bounds: [[f64; 3]; 2],
    /// Smallest half width, m.
    pub half_width: f64,
    /// Header and domain of the first frame.
    pub first: Option<First>,
    /// Least and greatest value of each column.
    pub ranges: Vec<[f64; 2]>,
    /// Some values of each column, for medians and the like.
    samples: Vec<Vec<f64>>,
}

/// Properties that all frames share.
pub(super) struct First {
    pub header: agimp::io::snapshot::Header,
    pub domain: [[f64; 3]; 2],
}

/// Values of a column that are kept of each frame.
const SAMPLES: usize = 4096;

impl LeafMaxima {
    pub(super) fn new(columns: usize) -> Self {
        Self {
            bounds: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
            half_width: f64::INFINITY,
            first: None,
            ranges: vec![[f64::INFINITY, f64::NEG_INFINITY]; columns],
            samples: vec![Vec::new(); columns],
        }
    }

    /// Extends the bounds to a frame. Refuses one of another domain than the first.
    pub(super) fn look(&mut self, path: &Path, frame: &Frame, columns: &[Column]) -> Result<(), FileError> {
        let domain = frame.domain();
        let first = self.first.get_or_insert_with(|| First { header: frame.header.clone(), domain });
        if first.domain != domain || first.header.dimension != frame.header.dimension {
            return Err(FileError::Refused {
                path: path.into(),
                reason: "the domain is not that of the first file; expected outputs of one run".into(),
            });
        }
        let [low, high] = &mut self.bounds;
        for position in &frame.positions {
            for axis in 0..3 {
                low[axis] = low[axis].min(position[axis]);
                high[axis] = high[axis].max(position[axis]);
            }
        }
        self.half_width = frame.half_widths.iter().copied().fold(self.half_width, f64::min);
        for ((column, range), samples) in columns.iter().zip(&mut self.ranges).zip(&mut self.samples) {
            let values = column.values(frame);
            for &value in values.iter().filter(|value| value.is_finite()) {
                *range = [range[0].min(value), range[1].max(value)];
            }
            let stride = values.len().div_ceil(SAMPLES).max(1);
            samples.extend(values.into_iter().step_by(stride).filter(|value| value.is_finite()));
        }
        for samples in &mut self.samples {
            samples.sort_by(f64::total_cmp);
        }
        Ok(())
    }

    /// The scales of the columns.
    pub(super) fn scales(&self, columns: &[Column], bits: u8) -> Vec<Scale> {
        let scale = |((column, range), samples): ((&Column, &[f64; 2]), &Vec<f64>)| {
            let [low, high] = if range[0] <= range[1] { *range } else { [0.0, 0.0] };
            if column.is_integer() {
                let levels = (high - low).clamp(0.0, 65535.0) as u32 + 1;
                return Scale { unit: 1.0, low, high, levels, integer: true };
            }
            let mut sizes: Vec<f64> = samples.iter().map(|v| v.abs()).filter(|&v| v > 0.0).collect();
            sizes.sort_by(f64::total_cmp);
            // Subnormal numbers would make the quotient infinite.
            let unit = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0).max(f64::MIN_POSITIVE * 1e20);
            let levels = 1_u32 << bits.clamp(4, 16);
            let [mut low, mut high] = [low, high].map(|value| (value / unit).asinh());
            if low < 0.0 && high > 0.0 {
                // Zero gets a level of its own.
                let step = (high - low) / f64::from(levels - 2);
                low = (low / step).floor() * step;
                high = low + f64::from(levels - 1) * step;
            }
            Scale { unit, low, high, levels, integer: false }
        };
        columns.iter().zip(&self.ranges).zip(&self.samples).map(scale).collect()
    }

    /// The range of a column without its outermost half percents.
    pub(super) fn usual(&self, column: usize) -> [f64; 2] {
        let samples = &self.samples[column];
        let outer = samples.len() / 200;
        match (samples.get(outer), samples.iter().rev().nth(outer)) {
            (Some(&low), Some(&high)) => [low, high],
            _ => [0.0, 0.0],
        }
    }

    /// Edge of a unit of the packed positions, m.
    pub(super) fn resolution(&self) -> f64 {
        const PARTS: f64 = 32.0;
        let extent = (0..3).map(|axis| self.bounds[1][axis] - self.bounds[0][axis]).fold(0.0, f64::max);
        let resolution = (extent / 65535.0).max(self.half_width / PARTS);
        if resolution.is_finite() && resolution > 0.0 { resolution } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(columns: &[Column]) -> Vec<&str> {
        columns.iter().map(|column| column.name.as_str()).collect()
    }

    #[test]
    fn columns_without_a_choice_are_scalars() {
        use PointField::{Id, Pressure, Speed, Stress, Velocity};
        let all = |shown: &[PointField]| Column::chosen(shown, None, Path::new("a")).unwrap();
        assert_eq!(names(&all(&[Velocity, Id, Stress, Pressure])), ["speed", "pressure"]);
        assert_eq!(names(&all(&[Velocity, Speed])), ["speed"]);
        assert!(Column::chosen(&[Id], None, Path::new("a")).is_err());
        let asked = Column::chosen(&[Velocity, Id], Some(&[Velocity, Speed, Id]), Path::new("a")).unwrap();
        assert_eq!(names(&asked), ["velocity_x", "velocity_y", "velocity_z", "speed", "id"]);
        assert_eq!(sources(&asked), [Velocity, Id]);
    }

    #[test]
    fn scale_keeps_small_values_apart_beside_an_outlier() {
        // A pressure of 1 kPa with one particle at 1 GPa.
        let unit = 1e3;
        let [low, high] = [-2e3_f64, 1e9].map(|v| (v / unit).asinh());
        let scale = Scale { unit, low, high, levels: 1024, integer: false };
        for value in [-2e3, -900.0, -10.0, 0.0, 20.0, 1e3, 1.1e3, 1e6, 1e9] {
            let back = scale.value(scale.level(value));
            assert!((back - value).abs() <= 0.01 * value.abs() + 0.01 * unit, "{value} {back}");
        }
        assert_eq!(scale.level(f64::NAN), 0);
        let one = Scale { unit: 1.0, low: 0.5, high: 0.5, levels: 1024, integer: false };
        assert_eq!(one.value(one.level(0.5_f64.sinh())), 0.5_f64.sinh());
    }
}
