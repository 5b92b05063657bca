//! Boundary condition for the velocity of material at a surface: a face of the domain, or a collider.
use std::fmt;

use super::gap::{Bounds, Gap};
use super::vector::length;
use crate::text::{number, quantity};

/// Standard acceleration of gravity g (ISO 80000-3), m/s²: Voellmy's `ξ` is given for the Earth.
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// Boundary condition of material at a surface. A face of the domain is a contact with an axis as normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// The material moves with the surface.
    Sticky,
    /// No motion through the surface, free motion along it.
    Slip,
    /// No motion into the surface, free motion away from it; along it Coulomb friction while it is pressed,
    /// and cohesion while it touches.
    Separating {
        /// Coefficient of friction, tan of the friction angle; 0 is frictionless.
        friction: f64,
        /// Shear stress that holds without pressure, Pa.
        cohesion: f64,
        /// Drag coefficient c of turbulent flow along the surface: the shear stress `ρ c v²` of material of
        /// the density ρ and the velocity v relative to the surface. `c = g/ξ` is Voellmy's (1955).
        drag: f64,
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
        Self::Separating { friction: 0.0, cohesion: 0.0, drag: 0.0 }
    }
}

impl Contact {
    /// Demand of a surface under this law on material for which the gap asks this: surfaces that separate
    /// hold nothing.
    pub fn bounds(self, of_gap: Bounds) -> Bounds {
        match self {
            Self::Separating { .. } => Bounds { most: f64::INFINITY, ..of_gap },
            _ => of_gap,
        }
    }

    /// Applies the condition to a velocity relative to the surface (m/s) of material that touches it. The
    /// unit normal points to the material.
    pub fn apply<const D: usize>(self, velocity: &mut [f64; D], normal: &[f64; D]) {
        self.apply_within(Bounds::TOUCHING, velocity, normal);
    }

    /// Applies the condition to a velocity relative to the surface (m/s), whose component along the unit
    /// normal, which points to the material, has these bounds. Mirror planes ask for no gap: what lies beyond
    /// them touches whatever touches them.
    ///
    /// Friction takes away at most the tangential velocity that the normal impulse allows:
    /// `|Δv_t| ≤ μ |Δv_n|` (Coulomb's law for the impulse of one step), and what cohesion and drag allow.
    /// Drag is taken at the end of the step, so that it never turns the velocity round.
    pub fn apply_within<const D: usize>(self, bounds: Bounds, velocity: &mut [f64; D], normal: &[f64; D]) {
        let Bounds { least, most, sticking, drag } = self.bounds(bounds);
        let outward = (0..D).fold(0.0, |sum, a| velocity[a].mul_add(normal[a], sum));
        let tangential: [f64; D] = std::array::from_fn(|a| (-outward).mul_add(normal[a], velocity[a]));
        let with_normal = |along: [f64; D], outward: f64| -> [f64; D] {
            std::array::from_fn(|a| outward.mul_add(normal[a], along[a]))
        };
        // What is held moves within the bounds; what is not is stopped where it arrives.
        let is_held = most < f64::INFINITY;
        match self {
            Self::Outflow | Self::Absorbing => {}
            Self::Symmetric => *velocity = tangential,
            _ if !is_held && outward >= least && sticking <= 0.0 && drag <= 0.0 => {}
            Self::Sticky => *velocity = with_normal([0.0; D], outward.clamp(least, most)),
            Self::Slip => *velocity = with_normal(tangential, outward.clamp(least, most)),
            Self::Separating { friction, .. } => {
                let speed = length(&tangential);
                let dragged = drag * speed * speed / drag.mul_add(speed, 1.0);
                let lost = friction.mul_add((least - outward).max(0.0), sticking) + dragged;
                let kept = if speed > lost { 1.0 - lost / speed } else { 0.0 };
                *velocity = with_normal(tangential.map(|v| v * kept), outward.max(least));
            }
        }
    }

    /// Whether material moves freely over a gap to the surface. What lies beyond a mirror plane touches it.
    pub const fn has_gap(self) -> bool {
        matches!(self, Self::Sticky | Self::Slip | Self::Separating { .. })
    }

    /// Bounds that it sets across a gap to material between nodes with cells of this edge (m), in a step of
    /// length `dt`, s.
    pub fn across(self, gap: Gap, cell: f64, dt: f64) -> Bounds {
        Bounds::across(gap, cell, dt, matches!(self, Self::Sticky | Self::Slip))
    }

    /// Shear stress that holds without pressure, Pa.
    pub const fn cohesion(self) -> f64 {
        match self {
            Self::Separating { cohesion, .. } => cohesion,
            _ => 0.0,
        }
    }

    /// Drag coefficient by Voellmy's ξ, m/s².
    pub fn drag_of(turbulent_friction: Option<f64>) -> f64 {
        turbulent_friction.map_or(0.0, |xi| STANDARD_GRAVITY / xi)
    }

    /// Drag coefficient of turbulent flow along the surface.
    pub const fn drag(self) -> f64 {
        match self {
            Self::Separating { drag, .. } => drag,
            _ => 0.0,
        }
    }

    /// Whether the area of the material at the surface counts.
    pub fn acts_by_area(self) -> bool {
        self.cohesion() > 0.0 || self.drag() > 0.0
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
    /// The name, the coefficient of friction, and cohesion and drag if there are any.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Separating { friction, cohesion, drag } => {
                write!(f, " with friction {}", number(*friction, 4))?;
                if *cohesion > 0.0 {
                    write!(f, ", cohesion {}", quantity(*cohesion, "Pa"))?;
                }
                if *drag > 0.0 {
                    write!(f, ", turbulent friction {} m/s²", number(STANDARD_GRAVITY / *drag, 4))?;
                }
                Ok(())
            }
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
        let contact = Contact::Separating { friction: 0.5, cohesion: 0.0, drag: 0.0 };
        let v = [1.0, 2.0, 0.5];
        assert_eq!(after(contact, v, [0.0, 0.0, 1.0]), v);
        assert_eq!(after(contact, v, [0.0, 0.0, -1.0])[2], 0.0);
        assert_eq!(after(Contact::Outflow, v, [0.0, 0.0, -1.0]), v);
    }

    #[test]
    fn friction_is_limited_by_the_normal_impulse() {
        let contact = Contact::Separating { friction: 0.5, cohesion: 0.0, drag: 0.0 };
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
    fn across_a_gap_material_moves_freely_up_to_the_surface() {
        let after = |contact: Contact, gap: f64, mut v: [f64; 2]| {
            let gap = Gap { width: gap, cover: 1.0 };
            contact.apply_within(contact.across(gap, 1.0, 0.1), &mut v, &[0.0, 1.0]);
            v
        };
        let friction = Contact::Separating { friction: 0.5, cohesion: 0.0, drag: 0.0 };
        assert_eq!(after(friction, 0.25, [3.0, -2.0]), [3.0, -2.0]);
        assert_eq!(after(friction, 0.25, [3.0, -4.5]), [2.0, -2.5]);
        // Near the surface `slip` and `sticky` let nothing go.
        assert_eq!(after(Contact::Slip, 0.25, [3.0, -2.0]), [3.0, -2.0]);
        assert_eq!(after(Contact::Slip, 0.25, [3.0, 2.0]), [3.0, 0.0]);
        assert_eq!(after(Contact::Sticky, 0.25, [3.0, -2.0]), [0.0, -2.0]);
        assert_eq!(after(Contact::Sticky, 0.75, [3.0, 2.0]), [3.0, 2.0]);
        assert_eq!(after(Contact::Sticky, 0.75, [3.0, -8.0]), [0.0, -7.5]);
        assert_eq!(after(Contact::Symmetric, 0.75, [3.0, -1.0]), [3.0, 0.0]);
    }

    #[test]
    fn cohesion_holds_without_pressure() {
        let contact = Contact::Separating { friction: 0.5, cohesion: 1e3, drag: 0.0 };
        let after = |mut v: [f64; 2]| {
            contact.apply_within(Bounds { sticking: 1.0, ..Bounds::TOUCHING }, &mut v, &[0.0, 1.0]);
            v
        };
        assert_eq!(after([3.0, 0.0]), [2.0, 0.0]);
        assert_eq!(after([0.5, 2.0]), [0.0, 2.0]);
        assert_eq!(after([3.0, -2.0]), [1.0, 0.0]);
        assert_eq!(contact.to_string(), "separating with friction 0.5, cohesion 1 kPa");
    }

    #[test]
    fn drag_slows_down_and_never_turns_round() {
        let contact = Contact::Separating { friction: 0.0, cohesion: 0.0, drag: 0.1 };
        let after = |drag: f64, mut v: [f64; 2]| {
            contact.apply_within(Bounds { drag, ..Bounds::TOUCHING }, &mut v, &[0.0, 1.0]);
            v
        };
        // v / (1 + k v): what the end of a step has of dv/dt = -k v².
        approx::assert_relative_eq!(after(0.5, [4.0, -1.0])[0], 4.0 / 3.0, epsilon = 1e-14);
        approx::assert_relative_eq!(after(1e9, [4.0, 0.0])[0], 1e-9, epsilon = 1e-15);
        assert_eq!(after(0.0, [4.0, -1.0]), [4.0, 0.0]);
        assert_eq!(contact.to_string(), "separating with friction 0, turbulent friction 98.07 m/s²");
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
