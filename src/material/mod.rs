//! Constitutive models.
pub mod parameters;
