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
use crate::row::{AXES, Row};
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
    /// Point below the middle of a deposit, m from the lower corner of the domain; given if quantities need
    /// it.
    pub foot: Option<[f64; D]>,
}

impl<const D: usize> Probe<D> {
    /// Whether a particle counts, by its place (m from the lower corner of the domain) and its body.
    pub fn counts(&self, x: &[f64; D], body: u16) -> bool {
        self.bodies.as_ref().is_none_or(|bodies| bodies.contains(&body))
            && self.region.as_ref().is_none_or(|region| region.distance(x) <= 0.0)
    }
}

/// Quantities of probes. Means are not a number while there is no material.
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
    /// Mean pressure of the water in the pores by volume, Pa: of the water table, of seepage, and the excess
    /// in undrained ground.
    PorePressure,
    /// Least and greatest coordinates of particles along each axis, m.
    Extent,
    /// Distance in plan from the foot of the probe within which 98 % of the mass lies, m.
    RunOut,
    /// Distance in plan from the foot to the outer edge of the deposit, m: gaps between particles beyond the
    /// run-out are no wider than their boxes.
    Edge,
    /// Height of the deposit above the foot, m, within a twentieth of the run-out about it.
    Height,
}

/// Ends of the names of the components of a stress.
const STRESS: [&str; 6] = ["_xx", "_yy", "_zz", "_xy", "_xz", "_yz"];

impl Measured {
    /// Adds its columns, with `suffix` between the stem of each name and its component. `origin` is the lower
    /// corner of the domain, m.
    pub fn add_to<const D: usize>(
        self,
        row: &mut Row,
        suffix: &str,
        of: Option<&Readings<D>>,
        origin: &[f64],
    ) {
        let mean = |sum: f64, of: f64| if of > 0.0 { sum / of } else { f64::NAN };
        let axes = &AXES[..D];
        let mut add = |stem: &str, unit, value| row.add(format_args!("{stem}{suffix}"), unit, value);
        match self {
            Self::Mass => add("mass", "kg", of.map(|of| of.mass)),
            Self::Volume => add("volume", "m³", of.map(|of| of.volume)),
            Self::GreatestSpeed => add("greatest_speed", "m/s", of.map(|of| of.greatest_speed)),
            Self::KineticEnergy => add("kinetic_energy", "J", of.map(|of| of.energies[0])),
            Self::ElasticEnergy => add("elastic_energy", "J", of.map(|of| of.energies[1])),
            Self::PlasticWork => add("plastic_work", "J", of.map(|of| of.energies[2])),
            Self::Pressure => {
                let sum = |[xx, yy, zz, ..]: [f64; 6]| -(xx + yy + zz) / 3.0;
                add("pressure", "Pa", of.map(|of| mean(sum(of.volume_stress), of.volume)));
            }
            Self::PlasticStrain => add("plastic_strain", "", of.map(|of| mean(of.volume_strain, of.volume))),
            Self::PorePressure => add("pore_pressure", "Pa", of.map(|of| mean(of.volume_pores, of.volume))),
            Self::Centre => {
                let place = |of: &Readings<D>| -> [f64; D] {
                    std::array::from_fn(|a| origin[a] + mean(of.mass_place[a], of.mass))
                };
                row.vector(format_args!("centre{suffix}"), axes, "m", of.map(place));
            }
            Self::Velocity => {
                let velocity = |of: &Readings<D>| of.momentum.map(|sum| mean(sum, of.mass));
                row.vector(format_args!("velocity{suffix}"), axes, "m/s", of.map(velocity));
            }
            Self::Momentum => {
                row.vector(format_args!("momentum{suffix}"), axes, "kg m/s", of.map(|of| of.momentum));
            }
            Self::Stress => {
                let stress = |of: &Readings<D>| of.volume_stress.map(|sum| mean(sum, of.volume));
                let ends = &STRESS[..if D == 2 { 4 } else { 6 }];
                row.vector(format_args!("stress{suffix}"), ends, "Pa", of.map(stress));
            }
            Self::Extent => {
                for (side, stem) in ["least", "greatest"].iter().enumerate() {
                    let place = |of: &Readings<D>| -> [f64; D] {
                        let at = |a: usize| origin[a] + of.extent[side][a];
                        std::array::from_fn(|a| if of.mass <= 0.0 { f64::NAN } else { at(a) })
                    };
                    row.vector(format_args!("{stem}{suffix}"), axes, "m", of.map(place));
                }
            }
            Self::RunOut => add("run_out", "m", of.map(|of| of.deposit.run_out)),
            Self::Edge => add("edge", "m", of.map(|of| of.deposit.edge)),
            Self::Height => add("height", "m", of.map(|of| of.deposit.height)),
        }
    }

    /// Whether it is counted from the foot of a probe.
    pub fn needs_foot(self) -> bool {
        matches!(self, Self::RunOut | Self::Edge | Self::Height)
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
    /// Shape of the deposit about the foot of the probe.
    pub deposit: Deposit,
}

/// A deposit about a foot; not a number without material or a foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deposit {
    /// Distance within which 98 % of the mass lies, m.
    pub run_out: f64,
    /// Distance of its outer edge, m.
    pub edge: f64,
    /// Height above the foot, m.
    pub height: f64,
}

impl Deposit {
    /// No material.
    pub const NONE: Self = Self { run_out: f64::NAN, edge: f64::NAN, height: f64::NAN };
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Measured; 17] = [
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
        Measured::RunOut,
        Measured::Edge,
        Measured::Height,
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
            deposit: Deposit::NONE,
        };
        let add = |row: &mut Row, of| ALL.iter().for_each(|q| q.add_to::<D>(row, "_p", of, &[0.0; 3]));
        let values = Row::values(|row| add(row, Some(&nothing)));
        let columns = Row::names(|row| add(row, None));
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
