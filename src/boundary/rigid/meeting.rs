//! The law of collisions of free bodies.

/// Friction and restitution of a free body in collisions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Coefficient of friction.
    pub friction: f64,
    /// Coefficient of restitution: speed after over speed before the collision.
    pub restitution: f64,
}
