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
