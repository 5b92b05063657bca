//! Why particles could not be migrated.
use crate::text::{number, place, quantity};

/// Why particles could not be migrated.
#[derive(Debug, thiserror::Error)]
pub enum MigrateError {
    /// A particle has left the domain and the job does not allow it.
    #[error(
        "particle {id} left the domain at {}, {} beyond `{face}`; set `boundaries.leaving` for such particles, or use a face of kind `outflow`",
        place(position),
        quantity(*beyond, "m")
    )]
    Left {
        /// Identifier of the particle.
        id: u64,
        /// Position in the coordinates of the job, m.
        position: Vec<f64>,
        /// The face that it is farthest beyond.
        face: &'static str,
        /// How far, m.
        beyond: f64,
    },
    /// The state of a particle is not one that material can have.
    #[error(
        "particle {id} at {} has {quantity} {}; the run has become unstable",
        place(position),
        number(*value, 4)
    )]
    Unsound {
        /// Identifier of the particle.
        id: u64,
        /// Position in the coordinates of the job, m.
        position: Vec<f64>,
        /// The impossible quantity.
        quantity: &'static str,
        /// Its value, SI units.
        value: f64,
    },
    /// A particle moved beyond the leaves around its own in one step, or its position is not finite.
    #[error("particle {id} moved too far in one step, to {}; the run has become unstable", place(position))]
    TooFar {
        /// Identifier of the particle.
        id: u64,
        /// Position in the coordinates of the job, m.
        position: Vec<f64>,
    },
}
