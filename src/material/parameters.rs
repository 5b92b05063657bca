//! Parameters of the constitutive models as they stand in a job file.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Isotropic elastic constants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Elastic {
    /// Young's modulus, Pa; above 0.
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    pub poisson: f64,
}

/// Hencky elasticity with von Mises yield and linear isotropic hardening.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VonMises {
    /// Young's modulus, Pa; above 0.
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    pub poisson: f64,
    /// Initial yield stress in uniaxial tension, Pa; above 0.
    pub yield_stress: f64,
    /// Linear hardening modulus, Pa; 0 is perfect plasticity.
    #[serde(default)]
    pub hardening: f64,
}

/// The cone through the Mohr-Coulomb pyramid on which a friction angle is matched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionMatch {
    /// Compression meridian: `alpha = sqrt(2/3) · 2 sin(phi) / (3 - sin(phi))` (Klar et al. 2016).
    #[default]
    TriaxialCompression,
    /// Non-dilatant flow in plane strain: `alpha = sqrt(2) sin(phi) / 3`.
    PlaneStrain,
}

/// Hencky elasticity with Drucker-Prager yield, non-associated flow (Klar et al. 2016).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DruckerPrager {
    /// Young's modulus, Pa; above 0.
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    pub poisson: f64,
    /// Friction angle, degrees; at least 0 and below 90.
    pub friction_angle: f64,
    /// Where the cone meets the Mohr-Coulomb friction angle.
    #[serde(default, rename = "match")]
    pub matching: FrictionMatch,
    /// Book the volume gained in tension and give it back on compression (Tampubolon et al. 2017).
    #[serde(default = "yes")]
    pub volume_correction: bool,
}

fn yes() -> bool {
    true
}

/// A constitutive model and its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum Parameters {
    /// Compressible neo-Hookean elasticity: `τ = μ (b - I) + λ ln(J) I`.
    NeoHookean(Elastic),
    /// Fixed corotated elasticity: `τ = 2μ (V² - V) + λ (J - 1) J I`.
    FixedCorotated(Elastic),
    /// Hencky elasticity: `τ = 2μ ln V + λ ln(J) I`.
    Hencky(Elastic),
    /// Von Mises plasticity.
    VonMises(VonMises),
    /// Drucker-Prager plasticity.
    DruckerPrager(DruckerPrager),
}

/// A parameter outside the range that its model needs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {value} is out of range: it must be {range}")]
pub struct OutOfRange {
    /// Name of the parameter in a job file.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// The range in words.
    pub range: &'static str,
}

impl Parameters {
    /// Checks the ranges that the models need.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let require =
            |ok: bool, key, value, range| if ok { Ok(()) } else { Err(OutOfRange { key, value, range }) };
        let elastic = |young: f64, poisson: f64| {
            require(young > 0.0 && young.is_finite(), "young", young, "above 0 (Pa)")?;
            require(poisson > -1.0 && poisson < 0.5, "poisson", poisson, "above -1 and below 0.5")
        };
        match *self {
            Self::NeoHookean(p) | Self::FixedCorotated(p) | Self::Hencky(p) => elastic(p.young, p.poisson),
            Self::VonMises(p) => {
                elastic(p.young, p.poisson)?;
                let stress = p.yield_stress;
                require(stress > 0.0 && stress.is_finite(), "yield_stress", stress, "above 0 (Pa)")?;
                let hardening = p.hardening;
                require(hardening >= 0.0 && hardening.is_finite(), "hardening", hardening, "0 or above (Pa)")
            }
            Self::DruckerPrager(p) => {
                elastic(p.young, p.poisson)?;
                let angle = p.friction_angle;
                require(
                    (0.0..90.0).contains(&angle),
                    "friction_angle",
                    angle,
                    "at least 0 and below 90 (degrees)",
                )
            }
        }
    }
}
