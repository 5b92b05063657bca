//! Hardening: the strength of a plastic model as a function of its plastic strain κ, of the rate of κ and of
//! temperature.
//!
//! | kind | strength `Y(κ)`, with `Y₀` the strength of the undeformed material |
//! |---|---|
//! | `none` | `Y₀` |
//! | `linear` | `Y₀ + H κ` |
//! | `voce` | `Y₀ + (Y_s - Y₀)(1 - e^(-δκ)) + H κ` |
//! | `ludwik` | `Y₀ + K κ^n` |
//! | `swift` | `Y₀ (1 + κ/ε₀)^n` |
//! | `table` | linear between points |
//! | `linear_softening` | `Y₀ - (Y₀ - Y_r) κ/κ_r`, at least `Y_r` |
//! | `exponential_softening` | `Y_r + (Y₀ - Y_r) e^(-κ/κ_r)` |
//! | `johnson_cook` | `(Y₀ + B κ^n)(1 + C ln⟨κ̇/κ̇₀⟩)(1 - T*^m)` |
//!
//! Softening localises in a band about a cell wide, so the strain that it takes is scaled by the size of
//! cells: with `length` L, cells of edge h soften over `κ_r L/h`, and the work per area of the band does not
//! depend on h.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::parameters::OutOfRange;

mod curve;

pub(in crate::material) use curve::{Curve, Flow};

/// How strength changes with plastic strain: a number is the modulus of linear hardening, Pa.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum Hardening {
    /// Modulus of linear hardening, Pa.
    Modulus(#[schemars(range(min = 0.0, max = 1e13))] f64),
    /// Any other law.
    Law(HardeningLaw),
}

impl Default for Hardening {
    fn default() -> Self {
        Self::Modulus(0.0)
    }
}

/// A hardening law: strength Y as a function of plastic strain κ. The strength Y₀ of the undeformed material
/// is a key of the model (`yield_stress`, `cohesion`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum HardeningLaw {
    /// Strength is constant: `Y = Y₀`.
    None {},
    /// Strength grows linearly: `Y = Y₀ + H κ`.
    Linear {
        /// Increase per plastic strain, Pa.
        #[schemars(range(min = 0.0, max = 1e13))]
        modulus: f64,
    },
    /// Strength tends to saturation (Voce 1948): `Y = Y₀ + (Y_s - Y₀)(1 - exp(-δ κ)) + H κ`.
    Voce {
        /// Strength at saturation, Pa.
        #[schemars(range(min = 0.0, max = 1e13))]
        saturation: f64,
        /// Exponent per plastic strain.
        #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
        rate: f64,
        /// Linear increase beside, Pa.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 1e13))]
        modulus: f64,
    },
    /// Strength grows by a power (Ludwik 1909): `Y = Y₀ + K κ^n`.
    Ludwik {
        /// Increase at a plastic strain of 1, Pa.
        #[schemars(range(min = 0.0, max = 1e13))]
        modulus: f64,
        /// Exponent.
        #[schemars(range(min = 0.01, max = 2.0))]
        exponent: f64,
    },
    /// Strength is a power of the strain since one of the past (Swift 1952): `Y = Y₀ (1 + κ/ε₀)^n`.
    Swift {
        /// Strain before the start.
        #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0))]
        strain: f64,
        /// Exponent.
        #[schemars(range(min = 0.0, max = 1.0))]
        exponent: f64,
    },
    /// Strength follows points, linearly between them, and is constant beyond the last.
    Table {
        /// Pairs of plastic strain and strength (Pa), strains above 0 and increasing. The first point is
        /// strain 0 with the strength of the undeformed material, and is not listed.
        #[schemars(extend("minItems" = 1, "maxItems" = 64), inner(inner(range(min = 0.0, max = 1e13))))]
        points: Vec<[f64; 2]>,
    },
    /// Strength falls linearly to a residual: `Y = Y₀ - (Y₀ - Y_r) κ/κ_r`, at least `Y_r`.
    LinearSoftening {
        /// Strength that is left, Pa.
        #[schemars(range(min = 0.0, max = 1e13))]
        residual: f64,
        /// Plastic strain at which it is reached.
        #[schemars(range(max = 1e3), extend("exclusiveMinimum" = 0.0))]
        strain: f64,
        /// Edge of the cells for which `strain` holds, m: others take more or less strain, such that a shear
        /// band of a cell's width takes the same work. Without it all cells take the same strain, and results
        /// depend on their size.
        #[serde(default)]
        #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
        length: Option<f64>,
    },
    /// Strength falls exponentially to a residual: `Y = Y_r + (Y₀ - Y_r) exp(-κ/κ_r)`.
    ExponentialSoftening {
        /// Strength that is left, Pa.
        #[schemars(range(min = 0.0, max = 1e13))]
        residual: f64,
        /// Plastic strain after which 37 % of the loss are to come.
        #[schemars(range(max = 1e3), extend("exclusiveMinimum" = 0.0))]
        strain: f64,
        /// Edge of the cells for which `strain` holds, m: others take more or less strain, such that a shear
        /// band of a cell's width takes the same work. Without it all cells take the same strain, and results
        /// depend on their size.
        #[serde(default)]
        #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
        length: Option<f64>,
    },
    /// Strength depends on strain, its rate and temperature, and plastic work heats (Johnson and Cook 1983):
    /// `Y = (Y₀ + B κ^n)(1 + C ln(rate/reference_rate))(1 - T*^m)`,
    /// `T* = (T - reference)/(melting - reference)`.
    JohnsonCook {
        /// B, increase at a plastic strain of 1, Pa.
        #[schemars(range(min = 0.0, max = 1e13))]
        modulus: f64,
        /// n, exponent of the plastic strain.
        #[schemars(range(min = 0.01, max = 2.0))]
        exponent: f64,
        /// C, increase with the logarithm of the rate.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 1.0))]
        rate_factor: f64,
        /// Rate of plastic strain below which strength does not depend on it, 1/s.
        #[serde(default = "one")]
        #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0))]
        reference_rate: f64,
        /// m, exponent of the homologous temperature.
        #[serde(default = "one")]
        #[schemars(range(min = 0.01, max = 10.0))]
        thermal_exponent: f64,
        /// Temperature up to which it does not weaken, K.
        #[serde(default = "room")]
        #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0))]
        reference_temperature: f64,
        /// Temperature at which no strength is left, K.
        #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0))]
        melting_temperature: f64,
        /// Temperature of the undeformed material, K.
        #[serde(default = "room")]
        #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0))]
        temperature: f64,
        /// Heat capacity, J/(kg K).
        #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
        specific_heat: f64,
        /// Part of the plastic work that becomes heat (Taylor and Quinney 1934).
        #[serde(default = "most")]
        #[schemars(range(min = 0.0, max = 1.0))]
        heat_fraction: f64,
    },
}

fn one() -> f64 {
    1.0
}

fn room() -> f64 {
    293.15
}

fn most() -> f64 {
    0.9
}

impl Hardening {
    /// Checks conditions beyond the ranges of single keys. `initial` is the strength of the undeformed
    /// material, Pa.
    pub(in crate::material) fn check(&self, initial: f64) -> Result<(), OutOfRange> {
        let fail = |key: &str, value: f64, range: String| {
            Err(OutOfRange { key: format!("hardening.{key}"), value, range })
        };
        let Self::Law(law) = self else { return Ok(()) };
        match law {
            HardeningLaw::Table { points } => {
                let mut last = 0.0;
                for (i, &[strain, strength]) in points.iter().enumerate() {
                    if !(strain > last && strain.is_finite()) {
                        return fail(&format!("points[{i}][0]"), strain, format!("above {last}"));
                    }
                    if !(0.0..=1e13).contains(&strength) {
                        let range = "at least 0 and at most 1e13".to_owned();
                        return fail(&format!("points[{i}][1]"), strength, range);
                    }
                    last = strain;
                }
                Ok(())
            }
            HardeningLaw::LinearSoftening { residual, .. }
            | HardeningLaw::ExponentialSoftening { residual, .. }
                if *residual > initial =>
            {
                fail(
                    "residual",
                    *residual,
                    format!("at most the strength of the undeformed material, {initial}"),
                )
            }
            HardeningLaw::JohnsonCook { reference_temperature, melting_temperature, temperature, .. } => {
                if melting_temperature <= reference_temperature {
                    let range = format!("above reference_temperature, {reference_temperature}");
                    return fail("melting_temperature", *melting_temperature, range);
                }
                if temperature >= melting_temperature {
                    let range = format!("below melting_temperature, {melting_temperature}");
                    return fail("temperature", *temperature, range);
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// As [`Hardening::check`] for cohesion (Pa) of a model with these angles of friction and dilation,
    /// degrees.
    pub(in crate::material) fn check_frictional(
        &self,
        cohesion: f64,
        [friction, dilation]: [f64; 2],
        volume_correction: bool,
    ) -> Result<(), OutOfRange> {
        self.check(cohesion)?;
        let fail =
            |range: String| Err(OutOfRange { key: "dilation_angle".to_owned(), value: dilation, range });
        if dilation > friction {
            return fail(format!("at most friction_angle, {friction}"));
        }
        // Temperature and volume gain share one history variable.
        if self.heats() && volume_correction && dilation > 0.0 {
            return fail("0 with Johnson-Cook hardening, unless volume_correction = false".to_owned());
        }
        Ok(())
    }

    /// The same curve with all strengths over `factor`.
    pub(in crate::material) fn weakened(&self, factor: f64) -> Self {
        let mut law = match self {
            Self::Modulus(modulus) => return Self::Modulus(modulus / factor),
            Self::Law(law) => law.clone(),
        };
        match &mut law {
            HardeningLaw::None {} | HardeningLaw::Swift { .. } => {}
            HardeningLaw::Linear { modulus }
            | HardeningLaw::Ludwik { modulus, .. }
            | HardeningLaw::JohnsonCook { modulus, .. } => *modulus /= factor,
            HardeningLaw::Voce { saturation, modulus, .. } => {
                *saturation /= factor;
                *modulus /= factor;
            }
            HardeningLaw::Table { points } => points.iter_mut().for_each(|point| point[1] /= factor),
            HardeningLaw::LinearSoftening { residual, .. }
            | HardeningLaw::ExponentialSoftening { residual, .. } => *residual /= factor,
        }
        Self::Law(law)
    }

    /// Homologous temperature of the undeformed material, and the part of the plastic work that becomes heat,
    /// of laws with temperatures.
    pub(in crate::material) fn homologous(&self) -> Option<(f64, f64)> {
        let Self::Law(HardeningLaw::JohnsonCook {
            reference_temperature: reference,
            melting_temperature: melting,
            temperature,
            heat_fraction,
            ..
        }) = self
        else {
            return None;
        };
        Some((((temperature - reference) / (melting - reference)).max(0.0), *heat_fraction))
    }

    /// Whether it needs the history variable of the temperature.
    pub(in crate::material) fn heats(&self) -> bool {
        matches!(self, Self::Law(HardeningLaw::JohnsonCook { .. }))
    }
}
