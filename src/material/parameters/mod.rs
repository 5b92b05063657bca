//! Parameters of the constitutive models as they stand in a job file.
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use super::laws::Parameters;

pub(super) mod ranges;

/// Isotropic elastic constants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Elastic {
    /// Young's modulus, Pa; above 0.
    #[schemars(range(max = 1e13), extend("exclusiveMinimum" = 0.0))]
    pub young: f64,
    /// Poisson's ratio; above -1 and below 0.5.
    #[schemars(extend("exclusiveMinimum" = -1.0, "exclusiveMaximum" = 0.5))]
    pub poisson: f64,
}

/// Lamé's constants, Pa.
#[derive(Clone, Copy, Debug)]
pub struct Lame {
    /// First constant.
    pub lambda: f64,
    /// Shear modulus.
    pub mu: f64,
}

impl Lame {
    /// From Young's modulus (Pa) and Poisson's ratio.
    pub fn new(young: f64, poisson: f64) -> Self {
        Self {
            lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            mu: young / (2.0 * (1.0 + poisson)),
        }
    }

    /// Modulus of pressure waves, `λ + 2μ`.
    pub fn pressure_wave(&self) -> f64 {
        self.lambda + 2.0 * self.mu
    }
}

/// A parameter outside the range that its model needs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {value} is out of range: it must be {range}")]
pub struct OutOfRange {
    /// Name of the parameter in a job file; inside a table, with the table's name and a dot before it.
    pub key: String,
    /// Its value.
    pub value: f64,
    /// The range in words.
    pub range: String,
}

/// Why a text is not a model.
#[derive(Debug, thiserror::Error)]
pub enum NotAModel {
    /// It is no valid TOML, or has not the keys of a model.
    #[error("the model cannot be read: {0}")]
    Form(#[from] toml::de::Error),
    /// A parameter is out of range.
    #[error("the model cannot be used: {0}")]
    Range(#[from] OutOfRange),
}

impl FromStr for Parameters {
    type Err = NotAModel;

    /// Reads and checks the keys of a model as in a job file: `model = "hencky", young = 1e6, poisson = 0.3`,
    /// or the same on lines of their own.
    fn from_str(text: &str) -> Result<Self, NotAModel> {
        #[derive(Deserialize)]
        struct Inline {
            model: Parameters,
        }
        // One line with commas is the inside of an inline table, otherwise a document.
        let inline = toml::from_str::<Inline>(&format!("model = {{ {text} }}"));
        let parameters = match inline {
            Ok(inline) => inline.model,
            Err(_) if text.trim().contains('\n') => toml::from_str(text)?,
            Err(error) => return Err(error.into()),
        };
        parameters.check()?;
        Ok(parameters)
    }
}
