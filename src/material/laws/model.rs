//! A model: a law with its parameters.
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::material::parameters::OutOfRange;
use crate::material::{Law, Material};

/// A constitutive model with the form of its parameters.
pub trait Model: Law {
    /// Parameters as they stand in a job file. Descriptions and ranges of the keys are those of the schema.
    type Parameters: Clone + std::fmt::Debug + PartialEq + Serialize + DeserializeOwned + JsonSchema;

    /// The model with these parameters and the density of the undeformed material, kg/m³.
    fn new(parameters: &Self::Parameters, density: f64) -> Self;

    /// The same, as the solver calls it: a model may choose a law with less history for parameters that need
    /// no more.
    fn boxed(parameters: &Self::Parameters, density: f64) -> Box<dyn Material>
    where
        Self: Sized + 'static,
    {
        Box::new(Self::new(parameters, density))
    }

    /// Checks conditions beyond the ranges of single keys.
    fn check(_parameters: &Self::Parameters) -> Result<(), OutOfRange> {
        Ok(())
    }

    /// The parameters with the strength over `factor`, for factors of safety: cohesion, yield stress and the
    /// tangents of the angles of friction; dilation at most that of the new friction. `None` for models
    /// without strength.
    fn weakened(_parameters: &Self::Parameters, _factor: f64) -> Option<Self::Parameters> {
        None
    }

    /// The parameters with associated flow, and with cohesion and friction so much less that the strength is
    /// about the same (Davis 1968). Models whose flow is associated keep theirs.
    fn associated(parameters: &Self::Parameters) -> Self::Parameters {
        parameters.clone()
    }

    /// Sets of parameters, in the form of a job file, that together cover every branch of the law: for tests
    /// and benches. Strengths are such that some percent of strain makes it flow; densities are 1000 kg/m³.
    fn examples() -> &'static [&'static str];
}
