//! Probes: what the history measures of the material in a shape.
//!
//! A particle counts where its centre lies in the shape. Sums are exact, so they do not depend on ranks; the flux of mass through a
//! plane is the rate at which the mass of a probe on one side of it changes.
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
    /// What it measures, each once.
    pub quantities: Vec<Measured>,
}

impl<const D: usize> Probe<D> {
    /// Whether a particle counts, by its place (m from the lower corner of the domain) and its body.
    pub fn counts(&self, x: &[f64; D], body: u16) -> bool {
        self.bodies.as_ref().is_none_or(|bodies| bodies.contains(&body))
            && self.region.as_ref().is_none_or(|region| region.distance(x) <= 0.0)
    }

    /// Names and units of the columns, in the order of [`Readings::values`].
    pub fn columns(&self) -> impl Iterator<Item = (String, &'static str)> + '_ {
        self.quantities.iter().flat_map(move |quantity| {
            let (stem, unit) = quantity.stem_and_unit();
            let name = move |stem: &str, component: &&str| (format!("{stem}_{}{component}", self.name), unit);
            let components = quantity.components::<D>();
            match quantity {
                Measured::Extent => {
                    let [low, high] = ["least", "greatest"];
                    let low = components.iter().map(|component| name(low, component));
                    low.chain(components.iter().map(|component| name(high, component))).collect::<Vec<_>>()
                }
                _ => components.iter().map(|component| name(stem, component)).collect(),
            }
        })
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
    /// Least and greatest coordinates of particles along each axis, m.
    Extent,
}

/// Axes as parts of names.
const AXES: [&str; 3] = ["_x", "_y", "_z"];

impl Measured {
    /// How the names of its columns begin, and their unit.
    fn stem_and_unit(self) -> (&'static str, &'static str) {
        match self {
            Self::Mass => ("mass", "kg"),
            Self::Volume => ("volume", "m^3"),
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
    /// Greatest speed, m/s.
    pub greatest_speed: f64,
    /// Least and greatest coordinates, m, from the lower corner of the domain; infinite without particles.
    pub extent: [[f64; D]; 2],
}

impl<const D: usize> Readings<D> {
    /// The values of a row of the history. `origin` is the lower corner of the domain, m.
    pub fn values(&self, probe: &Probe<D>, origin: &[f64]) -> Vec<f64> {
        let mean = |sum: f64, of: f64| if of > 0.0 { sum / of } else { f64::NAN };
        let is_empty = self.mass <= 0.0;
        let mut values = Vec::new();
        for quantity in &probe.quantities {
            match quantity {
                Measured::Mass => values.push(self.mass),
                Measured::Volume => values.push(self.volume),
                Measured::Centre => {
                    values.extend((0..D).map(|a| origin[a] + mean(self.mass_place[a], self.mass)));
                }
                Measured::Velocity => values.extend(self.momentum.map(|sum| mean(sum, self.mass))),
                Measured::Momentum => values.extend(self.momentum),
                Measured::GreatestSpeed => values.push(self.greatest_speed),
                Measured::KineticEnergy => values.push(self.energies[0]),
                Measured::ElasticEnergy => values.push(self.energies[1]),
                Measured::PlasticWork => values.push(self.energies[2]),
                Measured::Stress => {
                    let components = &self.volume_stress[..quantity.components::<D>().len()];
                    values.extend(components.iter().map(|sum| mean(*sum, self.volume)));
                }
                Measured::Pressure => {
                    let [xx, yy, zz, ..] = self.volume_stress;
                    values.push(mean(-(xx + yy + zz) / 3.0, self.volume));
                }
                Measured::PlasticStrain => values.push(mean(self.volume_strain, self.volume)),
                Measured::Extent => {
                    let place = |side: &[f64; D]| -> [f64; D] {
                        std::array::from_fn(|a| if is_empty { f64::NAN } else { origin[a] + side[a] })
                    };
                    values.extend(self.extent.iter().flat_map(place));
                }
            }
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Measured; 13] = [
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
        Measured::Extent,
    ];

    fn check<const D: usize>() {
        let probe = Probe::<D> { name: "p".into(), region: None, bodies: None, quantities: ALL.to_vec() };
        let nothing = Readings {
            mass: 0.0,
            volume: 0.0,
            mass_place: [0.0; D],
            momentum: [0.0; D],
            energies: [0.0; 3],
            volume_stress: [0.0; 6],
            volume_strain: 0.0,
            greatest_speed: 0.0,
            extent: [[f64::INFINITY; D], [f64::NEG_INFINITY; D]],
        };
        let values = nothing.values(&probe, &[0.0; 3]);
        let columns: Vec<_> = probe.columns().collect();
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
