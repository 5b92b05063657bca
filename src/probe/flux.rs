//! Fluxes: the mass that has passed a plane, or left through a face of the domain.
//!
//! The mass beyond a plane, with what has left the domain beyond it, less the mass beyond it at the start: each is an exact sum, so
//! inside and outside make up the whole.

/// Where mass is counted.
#[derive(Clone, Debug, PartialEq)]
pub struct Flux {
    /// Name; part of the name of its column in the history.
    pub name: String,
    /// Where.
    pub section: Section,
}

/// A plane or a face of the domain. Components along z are 0 in plane strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Section {
    /// A plane through a point (m from the lower corner of the domain); what lies where the normal points is beyond.
    Plane {
        /// The point, m.
        point: [f64; 3],
        /// The normal; its length does not matter.
        normal: [f64; 3],
    },
    /// The lower (0) or upper (1) face of the domain along an axis: what has left beyond it.
    Face {
        /// The axis.
        axis: usize,
        /// The side.
        side: usize,
    },
}

impl Section {
    /// Whether a place in or out of the domain lies beyond a plane; nothing in the domain lies beyond a face.
    pub fn is_beyond(&self, x: &[f64]) -> bool {
        match self {
            Self::Plane { point, normal } => {
                (0..x.len()).fold(0.0, |sum: f64, a| (x[a] - point[a]).mul_add(normal[a], sum)) > 0.0
            }
            Self::Face { .. } => false,
        }
    }
}
