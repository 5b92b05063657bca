//! Lines: points in a row at which a table of its own shows the material.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Measured, Readings};
use crate::row::Row;

/// Points at which the material is averaged.
#[derive(Clone, Debug)]
pub struct Line<const D: usize> {
    /// Name; part of the name of its file.
    pub name: String,
    /// The points, m from the lower corner of the domain.
    pub points: Vec<[f64; D]>,
    /// Bodies that count, by index; all without.
    pub bodies: Option<Vec<u16>>,
    /// Columns of its table, each once.
    pub quantities: Vec<Sampled>,
}

/// Quantities of lines. Means are not a number where there is no material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sampled {
    /// Share of the space that material fills.
    VolumeFraction,
    /// Mass per space, kg/m³.
    Density,
    /// Mean velocity by mass, m/s. Rings count by their sections in all means.
    Velocity,
    /// Mean Cauchy stress by volume, Pa, tension positive.
    Stress,
    /// Mean pressure by volume, Pa.
    Pressure,
    /// Mean plastic strain by volume.
    PlasticStrain,
    /// Mean pressure of the water in the pores by volume, Pa.
    PorePressure,
}

impl Sampled {
    /// Those of lines that name none.
    pub const USUAL: [Self; 6] = [
        Self::VolumeFraction,
        Self::Density,
        Self::Velocity,
        Self::Stress,
        Self::Pressure,
        Self::PlasticStrain,
    ];

    /// The measurement of a probe of the same quantity, if there is one.
    fn mean(self) -> Option<Measured> {
        match self {
            Self::VolumeFraction | Self::Density => None,
            Self::Velocity => Some(Measured::Velocity),
            Self::Stress => Some(Measured::Stress),
            Self::Pressure => Some(Measured::Pressure),
            Self::PlasticStrain => Some(Measured::PlasticStrain),
            Self::PorePressure => Some(Measured::PorePressure),
        }
    }
}

/// Material about a point: sums over particles with the weight Π max(0, 1 - |x - x_p| / h), h being the edge
/// of a cell. Those of rings are of their sections, per metre of circumference.
#[derive(Clone, Copy, Debug)]
pub struct Sample<const D: usize> {
    /// Level of the finest leaf that holds the point.
    pub level: u8,
    /// Volume of a cell there, m³; the integral of the weight, in axisymmetry beyond the axis.
    pub cell: f64,
    /// The sums.
    pub sums: Readings<D>,
}

/// The weight of a place (m) in the mean at a point (m), with cells of the edge `cell`, m.
pub fn weight<const D: usize>(point: &[f64; D], place: &[f64; D], cell: f64) -> f64 {
    (0..D).map(|a| (1.0 - (place[a] - point[a]).abs() / cell).max(0.0)).product()
}

impl<const D: usize> Line<D> {
    /// Those of its quantities that probes measure, too.
    pub fn measured(&self) -> Vec<Measured> {
        self.quantities.iter().filter_map(|quantity| quantity.mean()).collect()
    }

    /// Adds the columns behind step and time: a row for each point, counted from 1. `origin` is the lower
    /// corner of the domain, m.
    pub fn add_to(&self, row: &mut Row, of: Option<(usize, &Sample<D>)>, origin: &[f64]) {
        row.add(format_args!("point"), "", of.map(|(point, _)| (point + 1) as f64));
        let place = |(point, _): (usize, _)| -> [f64; D] {
            std::array::from_fn(|a| origin[a] + self.points[point][a])
        };
        row.vector(format_args!(""), &["x", "y", "z"][..D], "m", of.map(place));
        row.add(format_args!("level"), "", of.map(|(_, sample)| f64::from(sample.level)));
        let sample = of.map(|(_, sample)| sample);
        for quantity in &self.quantities {
            match quantity.mean() {
                Some(mean) => mean.add_to(row, "", sample.map(|sample| &sample.sums), origin),
                None if *quantity == Sampled::Density => {
                    let density = |sample: &Sample<D>| sample.sums.mass / sample.cell;
                    row.add(format_args!("density"), "kg/m³", sample.map(density));
                }
                None => {
                    let fraction = |sample: &Sample<D>| sample.sums.volume / sample.cell;
                    row.add(format_args!("volume_fraction"), "", sample.map(fraction));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Particles in the middle of the quarters of cells, each with the volume of a quarter: the weights about
    /// any point add up to one cell.
    #[test]
    fn weights_add_up_to_a_cell() {
        let places = (0..40).flat_map(|i| (0..40).map(move |j| [i, j].map(|c| 0.125 + 0.25 * f64::from(c))));
        let places: Vec<[f64; 2]> = places.collect();
        for point in [[5.0, 5.0], [4.3, 5.9], [2.125, 7.77]] {
            let sum: f64 = places.iter().map(|place| 0.0625 * weight(&point, place, 0.5)).sum();
            assert!((sum - 0.25).abs() < 1e-14, "{point:?}: {sum}");
        }
    }
}
