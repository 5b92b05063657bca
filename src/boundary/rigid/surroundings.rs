//! Colliders and faces that free bodies may touch, and the impulses on them.
use super::Features;
use crate::boundary::{Collider, ColliderState, Contact};

/// Colliders and faces of the domain that bodies may touch in a step.
pub struct Surroundings<'a, const D: usize> {
    /// All colliders, in their order.
    pub colliders: &'a [Collider<D>],
    /// Their states at the start of the step.
    pub states: &'a [ColliderState<D>],
    /// Points of each collider that may touch something.
    pub features: &'a [Features<D>],
    /// Conditions on the lower and upper face of the domain along each axis.
    pub faces: &'a [[Contact; 2]; D],
    /// Upper corner of the domain, m.
    pub extent: [f64; D],
}

/// Impulse (kg m/s) and angular impulse about the reference point (kg m²/s) on a collider in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Push {
    /// Impulse.
    pub impulse: [f64; 3],
    /// Angular impulse.
    pub turn: [f64; 3],
}
