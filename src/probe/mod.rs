//! Measurements of the material during a run. Sums are exact, so they do not depend on ranks.
//!
//! | file | what it holds |
//! |---|---|
//! | this | probes: the particles whose centres lie in a shape |
//! | `flux.rs` | fluxes: mass that has passed a plane or a face |
//! | `line.rs` | lines: the material about points in a row |
//! | `map.rs` | maps: largest depth and speed over a raster in plan |
//! | `track.rs` | tracks: particles that are followed |
mod flux;
pub mod line;
mod map;
mod track;

pub use flux::{Flux, Section};
pub use line::Line;
pub use map::{Map, Maxima};
pub use track::{Track, Tracked};

use crate::geometry::Shape;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A probe of a job.
#[derive(Clone, Debug)]
pub struct Probe<const D: usize> {
    /// Name; part of the names of its columns in the history.
    pub name: String,
    /// Where it measures, relative to the lower corner of the domain; everywhere without.
    pub region: Option<Shape<D>>,
    /// Bodies that it measures, by index; all without.
    pub bodies: Option<Vec<u16>>,
    /// Quantities that it measures, each once.
    pub quantities: Vec<Measured>,
}

impl<const D: usize> Probe<D> {
    /// Whether a particle counts, by its place (m from the lower corner of the domain) and its body.
    pub fn counts(&self, x: &[f64; D], body: u16) -> bool {
        self.bodies.as_ref().is_none_or(|bodies| bodies.contains(&body))
            && self.region.as_ref().is_none_or(|region| region.distance(x) <= 0.0)
    }
}

/// What a probe measures. Means are not a number while there is no material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Measured {
    /// Mass, kg.
    Mass,
    /// Volume, m³.
    Volume,
    /// Centre of mass, m.
    Centre,
    /// Mean velocity by mass, m/s.
    Velocity,
    /// Momentum, kg m/s.
    Momentum,
    /// Greatest speed of a particle, m/s.
    GreatestSpeed,
    /// Kinetic energy, J.
    KineticEnergy,
    /// Elastic energy, J.
    ElasticEnergy,
    /// Plastic work so far, J.
    PlasticWork,
    /// Mean Cauchy stress by volume, Pa, tension positive.
    Stress,
    /// Mean pressure by volume, Pa.
    Pressure,
    /// Mean plastic strain by volume.
    PlasticStrain,
    /// Mean pressure of the water in the pores by volume, Pa: of the water table, of seepage, and the excess in undrained ground.
    PorePressure,
    /// Least and greatest coordinates of particles along each axis, m.
    Extent,
}

/// Names and units of the columns of quantities, in the order of [`values`]. `suffix` follows the stem of
/// each name.
pub fn columns<const D: usize>(quantities: &[Measured], suffix: &str) -> Vec<(String, &'static str)> {
    quantities.iter().flat_map(|quantity| quantity.columns::<D>(suffix)).collect()
}

/// Values of quantities in a row of the history. `origin` is the lower corner of the domain, m.
pub fn values<const D: usize>(quantities: &[Measured], readings: &Readings<D>, origin: &[f64]) -> Vec<f64> {
    let mut values = Vec::new();
    quantities.iter().for_each(|quantity| quantity.values(readings, origin, &mut values));
    values
}

/// Axes as parts of names.
const AXES: [&str; 3] = ["_x", "_y", "_z"];

impl Measured {
    /// Names and units of its columns.
    fn columns<const D: usize>(self, suffix: &str) -> Vec<(String, &'static str)> {
        let (stem, unit) = self.stem_and_unit();
        let stems: &[&str] = if self == Self::Extent { &["least", "greatest"] } else { &[stem] };
        let of_stem = |stem: &&str| {
            let stem = (*stem).to_owned();
            self.components::<D>().iter().map(move |component| (format!("{stem}{suffix}{component}"), unit))
        };
        stems.iter().flat_map(of_stem).collect()
    }

    /// Its values, appended to those of a row.
    fn values<const D: usize>(self, of: &Readings<D>, origin: &[f64], values: &mut Vec<f64>) {
        let mean = |sum: f64, of: f64| if of > 0.0 { sum / of } else { f64::NAN };
        match self {
            Self::Mass => values.push(of.mass),
            Self::Volume => values.push(of.volume),
            Self::Centre => {
                values.extend((0..D).map(|a| origin[a] + mean(of.mass_place[a], of.mass)));
            }
            Self::Velocity => values.extend(of.momentum.map(|sum| mean(sum, of.mass))),
            Self::Momentum => values.extend(of.momentum),
            Self::GreatestSpeed => values.push(of.greatest_speed),
            Self::KineticEnergy => values.push(of.energies[0]),
            Self::ElasticEnergy => values.push(of.energies[1]),
            Self::PlasticWork => values.push(of.energies[2]),
            Self::Stress => {
                let components = &of.volume_stress[..self.components::<D>().len()];
                values.extend(components.iter().map(|sum| mean(*sum, of.volume)));
            }
            Self::Pressure => {
                let [xx, yy, zz, ..] = of.volume_stress;
                values.push(mean(-(xx + yy + zz) / 3.0, of.volume));
            }
            Self::PlasticStrain => values.push(mean(of.volume_strain, of.volume)),
            Self::PorePressure => values.push(mean(of.volume_pores, of.volume)),
            Self::Extent => {
                let is_empty = of.mass <= 0.0;
                let place = |side: &[f64; D]| -> [f64; D] {
                    std::array::from_fn(|a| if is_empty { f64::NAN } else { origin[a] + side[a] })
                };
                values.extend(of.extent.iter().flat_map(place));
            }
        }
    }

    /// How the names of its columns begin, and their unit.
    fn stem_and_unit(self) -> (&'static str, &'static str) {
        match self {
            Self::Mass => ("mass", "kg"),
            Self::Volume => ("volume", "m³"),
            Self::Centre => ("centre", "m"),
            Self::Velocity => ("velocity", "m/s"),
            Self::Momentum => ("momentum", "kg m/s"),
            Self::GreatestSpeed => ("greatest_speed", "m/s"),
            Self::KineticEnergy => ("kinetic_energy", "J"),
            Self::ElasticEnergy => ("elastic_energy", "J"),
            Self::PlasticWork => ("plastic_work", "J"),
            Self::Stress => ("stress", "Pa"),
            Self::Pressure => ("pressure", "Pa"),
            Self::PlasticStrain => ("plastic_strain", ""),
            Self::PorePressure => ("pore_pressure", "Pa"),
            Self::Extent => ("extent", "m"),
        }
    }

    /// How the names of its columns end.
    fn components<const D: usize>(self) -> &'static [&'static str] {
        match self {
            Self::Centre | Self::Velocity | Self::Momentum | Self::Extent => &AXES[..D],
            Self::Stress if D == 2 => &["_xx", "_yy", "_zz", "_xy"],
            Self::Stress => &["_xx", "_yy", "_zz", "_xy", "_xz", "_yz"],
            _ => &[""],
        }
    }
}

/// Sums over the particles that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readings<const D: usize> {
    /// Mass, kg.
    pub mass: f64,
    /// Volume, m³.
    pub volume: f64,
    /// Mass times place, kg m, from the lower corner of the domain.
    pub mass_place: [f64; D],
    /// Momentum, kg m/s.
    pub momentum: [f64; D],
    /// Kinetic, elastic energy and plastic work, J.
    pub energies: [f64; 3],
    /// Volume times Cauchy stress, J.
    pub volume_stress: [f64; 6],
    /// Volume times plastic strain, m³.
    pub volume_strain: f64,
    /// Volume times pressure in pores, J; 0 where no quantity asks for it.
    pub volume_pores: f64,
    /// Greatest speed, m/s.
    pub greatest_speed: f64,
    /// Least and greatest coordinates, m, from the lower corner of the domain; infinite without particles.
    pub extent: [[f64; D]; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Measured; 14] = [
        Measured::Mass,
        Measured::Volume,
        Measured::Centre,
        Measured::Velocity,
        Measured::Momentum,
        Measured::GreatestSpeed,
        Measured::KineticEnergy,
        Measured::ElasticEnergy,
        Measured::PlasticWork,
        Measured::Stress,
        Measured::Pressure,
        Measured::PlasticStrain,
        Measured::PorePressure,
        Measured::Extent,
    ];

    fn check<const D: usize>() {
        let nothing = Readings {
            mass: 0.0,
            volume: 0.0,
            mass_place: [0.0; D],
            momentum: [0.0; D],
            energies: [0.0; 3],
            volume_stress: [0.0; 6],
            volume_strain: 0.0,
            volume_pores: 0.0,
            greatest_speed: 0.0,
            extent: [[f64::INFINITY; D], [f64::NEG_INFINITY; D]],
        };
        let values = values(&ALL, &nothing, &[0.0; 3]);
        let columns = columns::<D>(&ALL, "_p");
        assert_eq!(columns.len(), values.len());
        // Sums of nothing are 0, means of nothing are no number, and nothing is infinite.
        for ((name, _), value) in columns.iter().zip(values) {
            let is_sum =
                ["mass", "volume", "momentum", "greatest_speed", "kinetic", "elastic", "plastic_work"]
                    .iter()
                    .any(|stem| name.starts_with(stem));
            assert!(if is_sum { value == 0.0 } else { value.is_nan() }, "{name} = {value}");
        }
    }

    #[test]
    fn columns_and_values_of_nothing_agree() {
        check::<2>();
        check::<3>();
    }
}
