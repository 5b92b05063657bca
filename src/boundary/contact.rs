//! Boundary condition for the velocity of material at a surface: a face of the domain, or a collider.
use std::fmt;

use super::motion::length;
use crate::text::number;

/// Boundary condition of material at a surface. A face of the domain is a contact with an axis as normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// The material moves with the surface.
    Sticky,
    /// No motion through the surface, free motion along it.
    Slip,
    /// No motion into the surface, free motion away from it; Coulomb friction along it while it is pressed.
    Separating {
        /// Coefficient of friction, tan of the friction angle; 0 is frictionless.
        friction: f64,
    },
    /// Mirror plane, of faces only; for velocities the same as `slip`.
    Symmetric,
    /// No condition, of faces only: material flows out as it would without the face, and particles that cross
    /// it leave the domain.
    Outflow,
    /// Waves are absorbed, of faces only; see [`super::Absorbing`].
    Absorbing,
}

impl Default for Contact {
    /// Separating, without friction.
    fn default() -> Self {
        Self::Separating { friction: 0.0 }
    }
}

impl Contact {
    /// Applies the condition to a velocity relative to the surface (m/s). The unit normal points to the material.
    ///
    /// Friction takes away at most the tangential velocity that the normal impulse allows:
    /// `|Δv_t| ≤ μ |Δv_n|` (Coulomb's law for the impulse of one step).
    pub fn apply<const D: usize>(self, velocity: &mut [f64; D], normal: &[f64; D]) {
        let outward = (0..D).fold(0.0, |sum, a| velocity[a].mul_add(normal[a], sum));
        let tangential: [f64; D] = std::array::from_fn(|a| (-outward).mul_add(normal[a], velocity[a]));
        match self {
            Self::Outflow | Self::Absorbing => {}
            Self::Sticky => *velocity = [0.0; D],
            Self::Slip | Self::Symmetric => *velocity = tangential,
            Self::Separating { friction } => {
                if outward >= 0.0 {
                    return;
                }
                let (speed, lost) = (length(&tangential), -friction * outward);
                let kept = if speed > lost { 1.0 - lost / speed } else { 0.0 };
                *velocity = tangential.map(|v| v * kept);
            }
        }
    }

    /// Its name in job files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sticky => "sticky",
            Self::Slip => "slip",
            Self::Separating { .. } => "separating",
            Self::Symmetric => "symmetric",
            Self::Outflow => "outflow",
            Self::Absorbing => "absorbing",
        }
    }
}

impl fmt::Display for Contact {
    /// The name and the coefficient of friction.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Separating { friction } => write!(f, " with friction {}", number(*friction, 4)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A velocity after contact with a surface of this normal.
    fn after<const D: usize>(contact: Contact, mut velocity: [f64; D], normal: [f64; D]) -> [f64; D] {
        contact.apply(&mut velocity, &normal);
        velocity
    }

    #[test]
    fn separating_surfaces_let_go() {
        let contact = Contact::Separating { friction: 0.5 };
        let v = [1.0, 2.0, 0.5];
        assert_eq!(after(contact, v, [0.0, 0.0, 1.0]), v);
        assert_eq!(after(contact, v, [0.0, 0.0, -1.0])[2], 0.0);
        assert_eq!(after(Contact::Outflow, v, [0.0, 0.0, -1.0]), v);
    }

    #[test]
    fn friction_is_limited_by_the_normal_impulse() {
        let contact = Contact::Separating { friction: 0.5 };
        assert_eq!(after(contact, [3.0, -2.0], [0.0, 1.0]), [2.0, 0.0]);
        assert_eq!(after(contact, [0.5, -2.0], [0.0, 1.0]), [0.0, 0.0]);
        let v = after(contact, [3.0, 4.0, -2.0], [0.0, 0.0, 1.0]);
        approx::assert_relative_eq!(v[0], 3.0 * 0.8);
        approx::assert_relative_eq!(v[1], 4.0 * 0.8);
        assert_eq!(after(contact, [3.0, 4.0, -20.0], [0.0, 0.0, 1.0]), [0.0; 3]);
        // On a slope of 3 in 4: the same in its axes.
        let v = after(contact, [0.6 * 2.0 + 0.8 * 3.0, -0.8 * 2.0 + 0.6 * 3.0], [-0.6, 0.8]);
        approx::assert_relative_eq!(v[0], 0.8 * 2.0, epsilon = 1e-14);
        approx::assert_relative_eq!(v[1], 0.6 * 2.0, epsilon = 1e-14);
    }

    #[test]
    fn slip_keeps_the_tangent_and_sticky_nothing() {
        for contact in [Contact::Slip, Contact::Symmetric] {
            assert_eq!(after(contact, [1.0, -2.0], [0.0, 1.0]), [1.0, 0.0]);
            assert_eq!(after(contact, [0.5, 2.0], [0.0, 1.0]), [0.5, 0.0]);
        }
        assert_eq!(after(Contact::Sticky, [1.0, 0.0], [1.0, 0.0]), [0.0, 0.0]);
    }
}
