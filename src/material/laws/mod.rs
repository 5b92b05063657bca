//! The constitutive models, one file each, and the list of them.
//!
//! A file holds the parameters of a model as they stand in a job file, with ranges and units, and its law. A
//! line of the list below makes it a choice of the job file and of `agimp material`, with schema, checks and
//! reference, and has it tested and benchmarked with the rest.
//!
//! | file | model |
//! |---|---|
//! | `neo_hookean.rs` | compressible neo-Hookean elasticity |
//! | `fixed_corotated.rs` | fixed corotated elasticity |
//! | `hencky.rs` | Hencky elasticity; elastic part of the plastic models |
//! | `von_mises.rs` `metal.rs` | metal: von Mises yield, isotropic hardening; its law |
//! | `tresca.rs` | metal, undrained clay: Tresca yield |
//! | `drucker_prager.rs` | sand: Drucker-Prager yield |
//! | `mohr_coulomb.rs` | soil, rock: Mohr-Coulomb yield |
//! | `cap/` | clay, snow and other matter that yields under pressure alone |
//! | `flow/` | fluid, gas, high explosive, dense granular flow |
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

use super::parameters::{OutOfRange, ranges};
use super::solid::Hencky;
use super::{Law, Material};

pub mod cap;
pub mod drucker_prager;
pub mod fixed_corotated;
pub mod flow;
pub mod hencky;
pub(in crate::material) mod metal;
mod model;
pub mod mohr_coulomb;
pub mod neo_hookean;
#[cfg(test)]
mod tests;
pub mod tresca;
pub mod von_mises;

pub use model::Model;

/// Makes the choice of models from a list of them.
macro_rules! materials {
    ($($(#[$description:meta])* $name:ident($law:ty),)*) => {
        /// A constitutive model and its parameters.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "model", rename_all = "snake_case")]
        pub enum Parameters {
            $($(#[$description])* $name(<$law as Model>::Parameters),)*
        }

        /// History variables that each particle has room for: as many as the model with most of them needs.
        pub const HISTORIES: usize = {
            let mut most = super::PLASTIC_VOLUME + 1;
            $(if <$law as Law>::HISTORIES > most {
                most = <$law as Law>::HISTORIES;
            })*
            most
        };

        impl Parameters {
            /// The model with these parameters and the density of the undeformed material, kg/m³.
            pub fn build(&self, density: f64) -> Box<dyn Material> {
                match self {
                    $(Self::$name(parameters) => <$law as Model>::boxed(parameters, density),)*
                }
            }

            /// Checks the ranges that the models need.
            pub fn check(&self) -> Result<(), OutOfRange> {
                // Made once: a job may have thousands of materials.
                static SCHEMA: LazyLock<serde_json::Value> =
                    LazyLock::new(|| schemars::schema_for!(Parameters).to_value());
                ranges::check(&SCHEMA, self)?;
                match self {
                    $(Self::$name(parameters) => <$law as Model>::check(parameters),)*
                }
            }

            /// The same model with its strength over `factor`; `None` for models without strength.
            pub fn weakened(&self, factor: f64) -> Option<Self> {
                match self {
                    $(Self::$name(own) => <$law as Model>::weakened(own, factor).map(Self::$name),)*
                }
            }

            /// The same model with associated flow, and the strength that goes with it.
            pub fn associated(&self) -> Self {
                match self {
                    $(Self::$name(own) => Self::$name(<$law as Model>::associated(own)),)*
                }
            }

            /// Every model with the parameters of its examples.
            pub fn examples() -> Vec<&'static str> {
                [$(<$law as Model>::examples(),)*].concat()
            }
        }

        /// Calls a function with the law of each example of each model.
        #[cfg(test)]
        pub(super) fn for_each_law(visitor: &impl Visitor) {
            $(for text in <$law as Model>::examples() {
                if let Ok(Parameters::$name(parameters)) = text.parse() {
                    visitor.visit(text, &<$law as Model>::new(&parameters, 1000.0));
                }
            })*
        }
    };
}

/// Callback of [`for_each_law`].
#[cfg(test)]
pub(super) trait Visitor {
    /// An example and its law.
    fn visit(&self, example: &str, law: &impl Law);
}

impl Parameters {
    /// Whether particles of the material can fail: it has damage.
    pub fn can_fail(&self) -> bool {
        match self {
            Self::Hencky(own) => own.damage.is_some(),
            Self::VonMises(own) => own.damage.is_some(),
            _ => false,
        }
    }
}

materials! {
    /// Compressible neo-Hookean elasticity: `τ = μ (b - I) + λ ln(J) I`.
    NeoHookean(neo_hookean::NeoHookean),
    /// Fixed corotated elasticity: `τ = 2μ (V² - V) + λ (J - 1) J I`.
    FixedCorotated(fixed_corotated::FixedCorotated),
    /// Hencky elasticity: `τ = 2μ ln V + λ ln(J) I`.
    Hencky(Hencky),
    /// Von Mises plasticity.
    VonMises(metal::VonMises),
    /// Tresca plasticity.
    Tresca(tresca::Tresca),
    /// Drucker-Prager plasticity.
    DruckerPrager(drucker_prager::DruckerPrager),
    /// Mohr-Coulomb plasticity.
    MohrCoulomb(mohr_coulomb::MohrCoulomb),
    /// Modified Cam-clay in finite strain.
    CamClay(cap::cam_clay::CamClay),
    /// Non-associated Cam-clay: matter that fractures (Wolper et al. 2019).
    NonAssociatedCamClay(cap::non_associated_cam_clay::NonAssociatedCamClay),
    /// Snow (Stomakhin et al. 2013).
    Snow(cap::snow::Snow),
    /// Dense granular flow with a friction that grows with the rate (Dunatunga and Kamrin 2015).
    MuI(flow::mu_i::MuI),
    /// Weakly compressible Newtonian fluid.
    Fluid(flow::fluid::Fluid),
    /// Ideal or stiffened gas: `p = (γ - 1) ρ e - γ p_∞`.
    Gas(flow::gas::Gas),
    /// High explosive: products after Jones, Wilkins and Lee, with a burn that starts at points.
    Explosive(flow::explosive::Explosive),
}
