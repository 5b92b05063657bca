//! Damage: stiffness and strength that a material loses for good where it is torn.
//!
//! | file | content |
//! |---|---|
//! | `mod.rs` | keys of a job file |
//! | `softening.rs` | stress of a crack band as a function of its greatest strain |
//! | `brittle.rs` | Hencky elasticity with cracks |
//! | `ductile.rs` | metal that fails by plastic strain |
//!
//! A crack localises in a band about a cell wide. The stress of the band falls such that it takes the energy
//! of fracture G per area of crack whatever its width h (crack band, Bažant and Oh 1983). The width is that
//! of the cells that a particle was made for when it begins to crack, and stays.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

mod brittle;
mod ductile;
mod softening;

pub(super) use brittle::Brittle;
pub(super) use ductile::Ductile;
pub use ductile::Failure;
pub use softening::Softening;

/// Damage of an elastic material: cracks that open beyond a strength. With the greatest value κ so far of the
/// driving strain, the stress is `(1 - D(κ))` times that of the whole material. D is the field `damage`, from
/// 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Damage {
    /// Cracks open by the greatest principal stress (Rankine): the driving strain is that of the whole
    /// material over Young's modulus.
    Rankine {
        /// Tensile strength f, Pa: a Kirchhoff stress.
        #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
        strength: f64,
        /// Energy of fracture G per area of a crack, J/m².
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        fracture_energy: f64,
        /// How the stress falls.
        #[serde(default)]
        softening: Softening,
        /// Whether only principal stresses in tension are lowered, so that closed cracks bear pressure.
        /// `false`: all stress is.
        #[serde(default = "yes")]
        tension_only: bool,
    },
    /// Cracks open by the principal strains in tension (Mazars 1984): the driving strain is the root of the
    /// sum of their squares.
    Strain {
        /// Driving strain from which it cracks; the strength is Young's modulus times it.
        #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
        onset: f64,
        /// Energy of fracture G per area of a crack, J/m².
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        fracture_energy: f64,
        /// How the stress falls.
        #[serde(default)]
        softening: Softening,
        /// Whether only principal stresses in tension are lowered, so that closed cracks bear pressure.
        /// `false`: all stress is.
        #[serde(default = "yes")]
        tension_only: bool,
    },
    /// Cracks open by the energy that damage sets free (Simo and Ju 1987): the driving strain is the root of
    /// the sum of stress times strain over Young's modulus, over the principal stresses in tension. A crack
    /// takes the energy of fracture whatever Poisson's ratio: of the other kinds it takes it where the
    /// material may contract along the crack, as in a bar, and `(1 + ν)(1 - 2ν)/(1 - ν)` of it
    /// (`strain`: one over that) in a band between solids that stay: 0.9 with 0.2.
    Energy {
        /// Strength in uniaxial tension f, Pa: a Kirchhoff stress.
        #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
        strength: f64,
        /// Energy of fracture G per area of a crack, J/m².
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        fracture_energy: f64,
        /// How the stress falls.
        #[serde(default)]
        softening: Softening,
        /// Whether only principal stresses in tension are lowered, so that closed cracks bear pressure.
        /// `false`: all stress is.
        #[serde(default = "yes")]
        tension_only: bool,
    },
}

fn yes() -> bool {
    true
}

impl Damage {
    /// Width of a crack band up to which its stress falls with growing strain, m, for this Young's modulus
    /// (Pa). A wider one breaks at once, and takes more than the energy of fracture.
    pub fn widest_band(&self, young: f64) -> f64 {
        let (onset, energy, softening) = match *self {
            Self::Rankine { strength, fracture_energy, softening, .. }
            | Self::Energy { strength, fracture_energy, softening, .. } => {
                (strength / young, fracture_energy, softening)
            }
            Self::Strain { onset, fracture_energy, softening, .. } => (onset, fracture_energy, softening),
        };
        softening.widest(energy / (young * onset * onset))
    }
}
