//! Fluxes: the mass that has passed a plane, or left through a face of the domain.
//!
//! The mass beyond a plane, plus the mass that has left the domain beyond it, less the mass beyond it at the
//! start: each is an exact sum, so inside and outside make up the whole. At an opening, a part of a plane,
//! masses are summed up as particles cross.

/// Where mass is counted.
#[derive(Clone, Debug, PartialEq)]
pub struct Flux {
    /// Name; part of the name of its column in the history.
    pub name: String,
    /// Where.
    pub section: Section,
}

/// A plane, an opening in it, or a face of the domain. Components along z are 0 in plane strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Section {
    /// A plane through a point (m from the lower corner of the domain); the side to which the normal points
    /// is beyond.
    Plane {
        /// The point, m.
        point: [f64; 3],
        /// The normal; its length does not matter.
        normal: [f64; 3],
    },
    /// A part of a plane: mass that crosses it between the start and the end of a step, along a straight
    /// line.
    Opening {
        /// A point of the plane, m.
        point: [f64; 3],
        /// The normal; its length does not matter.
        normal: [f64; 3],
        /// Lower and upper corner of a box that holds the part, m.
        bounds: [[f64; 3]; 2],
    },
    /// The lower (0) or upper (1) face of the domain along an axis: mass that has left through it.
    Face {
        /// The axis.
        axis: usize,
        /// The side.
        side: usize,
    },
}

impl Section {
    /// Whether a place in or out of the domain lies beyond a whole plane; nothing in the domain lies beyond a
    /// face.
    pub fn is_beyond(&self, x: &[f64]) -> bool {
        match self {
            Self::Plane { point, normal } => distance(x, point, normal) > 0.0,
            Self::Opening { .. } | Self::Face { .. } => false,
        }
    }

    /// Whether a way between two places (m) leads through an opening: 1 in the direction of its normal, -1
    /// against it, else 0.
    pub fn passes(&self, from: &[f64], to: &[f64]) -> f64 {
        let Self::Opening { point, normal, bounds: [lower, upper] } = self else { return 0.0 };
        let [start, end] = [from, to].map(|x| distance(x, point, normal));
        if (start > 0.0) == (end > 0.0) {
            return 0.0;
        }
        let share = start / (start - end);
        let is_inside = (0..from.len()).all(|a| {
            let crossing = share.mul_add(to[a] - from[a], from[a]);
            lower[a] <= crossing && crossing <= upper[a]
        });
        if is_inside { f64::from(i8::from(end > 0.0)) * 2.0 - 1.0 } else { 0.0 }
    }
}

/// Distance beyond a plane, times the length of its normal.
fn distance(x: &[f64], point: &[f64; 3], normal: &[f64; 3]) -> f64 {
    (0..x.len()).fold(0.0, |sum: f64, a| (x[a] - point[a]).mul_add(normal[a], sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mass that crosses the plane beside the opening does not count; mass that comes back counts against.
    #[test]
    fn ways_lead_through_an_opening_or_past_it() {
        let bounds = [[1.0, -1.0, 0.0], [2.0, 1.0, 0.0]];
        let slot = Section::Opening { point: [0.0; 3], normal: [0.0, -2.0, 0.0], bounds };
        assert_eq!(slot.passes(&[1.5, 0.25], &[1.5, -0.25]), 1.0);
        assert_eq!(slot.passes(&[1.5, -0.25], &[1.5, 0.0]), -1.0);
        assert_eq!(slot.passes(&[1.5, 0.0], &[1.5, -0.25]), 1.0);
        assert_eq!(slot.passes(&[1.5, 0.5], &[1.5, 0.25]), 0.0);
        // Crosses at x = 1.25 and at x = 0.75.
        assert_eq!(slot.passes(&[0.5, 0.75], &[1.5, -0.25]), 1.0);
        assert_eq!(slot.passes(&[0.5, 0.25], &[1.5, -0.75]), 0.0);
    }
}
