//! Parameters of the constitutive models as they stand in a job file.
//!
//! | file | what it holds |
//! |---|---|
//! | `elastic` | elastic constants |
//! | `ranges`, `out_of_range` | ranges, and a parameter outside its own |
//! | this | reading from text |
use std::str::FromStr;

use serde::Deserialize;

pub use super::laws::Parameters;

mod elastic;
mod out_of_range;
pub(super) mod ranges;

pub use elastic::{Elastic, Lame};
pub use out_of_range::OutOfRange;

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
