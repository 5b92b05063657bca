//! Contact between bodies that deform.
//!
//! Bodies in contact move with velocity fields of their own. At a real node where two fields have mass, the
//! share that each body takes of the volume of the node's basis function, `φ = Σ V w / ∫N`, says where its
//! surface lies: a plane at a distance s of the node, in cells, leaves the share `Φ(s)` behind it, where Φ is
//! the distribution function of the hat. Boxes that tile a body make φ exact, and two surfaces in contact
//! have `φ_a + φ_b = 1` at each node, so contact begins at the surface and not a cell ahead of it. The normal
//! follows from the gradients of both volumes (Nairn 2013, average volume gradient):
//! `n ∝ Σ V_a ∇w - Σ V_b ∇w`, smoothed over the cells around where the surface is smooth.

use std::fmt;

use super::vector::length;
use crate::leapfrog::Lengths;
use crate::text::{number, quantity};

/// Velocity field of each body, and the law of contact of each pair of fields.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyContacts {
    /// Number of the velocity field of each body; empty where all move with one.
    pub field_of_body: Vec<u8>,
    /// Contacts between two fields, in the order of their numbers; other pairs stick.
    pub pairs: Vec<Pair>,
    /// Name of each contact of the job, and whether it is between two sides, so that its force has a
    /// direction.
    pub names: Vec<(String, bool)>,
}

/// Contact between two velocity fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Numbers of the fields, ascending.
    pub fields: [u8; 2],
    /// Law of contact.
    pub law: PairLaw,
    /// Number of the contact in the job.
    pub contact: u16,
    /// Whether the second field is on the first side of that contact.
    pub turned: bool,
}

/// Law of contact between two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairLaw {
    /// They move as one.
    Sticky,
    /// Bodies in contact stay together and slide freely.
    Slip,
    /// They part freely, up to a tension; Coulomb friction with cohesion.
    Separating {
        /// Coefficient of friction.
        friction: f64,
        /// Shear strength without pressure, Pa.
        cohesion: f64,
        /// Tensile strength, Pa.
        tension: f64,
    },
}

/// Two bodies at a node.
#[derive(Clone, Copy, Debug)]
pub struct Meeting<const D: usize> {
    /// Unit normal from the first to the second.
    pub normal: [f64; D],
    /// Distance between the surfaces along the normal, m; negative for an overlap.
    pub gap: f64,
    /// Area of the surface that belongs to the node, m² (in plane strain m).
    pub area: f64,
}

/// Distance between surfaces, in cells, up to which bodies count as touching for `slip`, cohesion and tensile
/// strength.
const TOUCH: f64 = 0.05;

/// Cosine of the angle between smoothed gradients and those of the node beyond which the surface has an edge
/// or a corner there, which smoothing would round: 25 degrees, three times the error of normals of bodies
/// that are sampled without a lattice.
const SMOOTH: f64 = 0.906;

/// Gap, in cells, from which surfaces at a node do not enter the normals around it.
const NEAR: f64 = 0.1;

impl BodyContacts {
    /// Number of velocity fields.
    pub fn fields(&self) -> usize {
        self.field_of_body.iter().max().map_or(1, |&last| usize::from(last) + 1)
    }

    /// Contact between two fields, whose numbers ascend; `None` if they stick.
    pub fn pair(&self, fields: [usize; 2]) -> Option<&Pair> {
        let place = self.pairs.binary_search_by_key(&fields, |pair| pair.fields.map(usize::from));
        place.ok().map(|place| &self.pairs[place])
    }
}

/// Distance of a plane from a node that leaves this share of the volume of its hat behind it, in cells, from
/// -1 to 1: the inverse of the distribution function of the hat. Hats across which a plane lies obliquely
/// have the same variance and nearly the same function.
pub fn place_of_surface(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    if share < 0.5 { (2.0 * share).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - share)).sqrt() }
}

/// Distance between two surfaces that leave these shares of the volume of a hat to the bodies behind them, in
/// cells; negative for an overlap.
pub fn gap_between([first, second]: [f64; 2]) -> f64 {
    place_of_surface(1.0 - second) - place_of_surface(first)
}

/// Weight of the surface at a node in the smoothed normal, from 0 to 1, with this gap in cells. Where bodies
/// do not touch, beside the edges of a block on a slab, surfaces at the node are not those of the contact.
pub fn part_in_normals(gap: f64) -> f64 {
    (1.0 - gap / NEAR).clamp(0.0, 1.0)
}

impl<const D: usize> Meeting<D> {
    /// Two bodies at a node with cells of this edge (m) and a hat of this volume, from the sums `Σ V ∇w` and
    /// `Σ V w` of each, and the difference of the former smoothed over the cells around. `None` where these
    /// define no surface between them.
    pub fn new(
        sums: [([f64; D], f64); 2],
        smoothed: [f64; D],
        volume: f64,
        cell: f64,
        on_faces: u8,
    ) -> Option<Self> {
        let [(first, a), (second, b)] = sums;
        // A face of the domain is no surface of either body.
        let off_faces =
            |v: [f64; D]| std::array::from_fn(|k| if on_faces >> (2 * k) & 3 != 0 { 0.0 } else { v[k] });
        let across: [f64; D] = off_faces(std::array::from_fn(|k| first[k] - second[k]));
        let size = length(&across);
        // The smallest share counts: the strain of its particle does not vanish with the share.
        if !(size > 0.0 && a.min(b) > 0.0) {
            return None;
        }
        let smoothed: [f64; D] = off_faces(smoothed);
        let smooth_size = length(&smoothed);
        let both = (0..D).fold(0.0, |sum, k| smoothed[k].mul_add(across[k], sum));
        let normal = match both > SMOOTH * size * smooth_size {
            true => smoothed.map(|component| component / smooth_size),
            false => across.map(|component| component / size),
        };
        let gap = cell * gap_between([a / volume, b / volume]);
        Some(Self { normal, gap, area: 0.5 * size })
    }
}

impl fmt::Display for PairLaw {
    /// Name and parameters.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sticky => f.write_str("sticky"),
            Self::Slip => f.write_str("slip"),
            Self::Separating { friction, cohesion, tension } => {
                write!(f, "separating with friction {}", number(*friction, 4))?;
                let given = [("cohesion", cohesion), ("tension", tension)];
                let mut given = given.into_iter().filter(|(_, value)| **value > 0.0);
                given.try_for_each(|(name, value)| write!(f, ", {name} {}", quantity(*value, "Pa")))
            }
        }
    }
}

impl PairLaw {
    /// Impulse on the second of two bodies with these masses (kg) that meet at a node, kg m/s; the first
    /// takes the opposite. `relative` is the velocity of the first less that of the second, m/s, in a step of
    /// these lengths.
    ///
    /// A gap may close within the step, so bodies approach freely at up to the gap over its drift. The
    /// impulse of friction is bounded by Coulomb's law for that of the step, `|J_t| ≤ μ J_n + c A Δt`, with
    /// its kick Δt.
    pub fn impulse<const D: usize>(
        &self,
        relative: &[f64; D],
        masses: [f64; 2],
        meeting: &Meeting<D>,
        cell: f64,
        Lengths { kick, drift }: Lengths,
    ) -> [f64; D] {
        let mass = masses[0] * masses[1] / (masses[0] + masses[1]);
        let Meeting { normal, gap, area } = meeting;
        let closing = (0..D).fold(0.0, |sum, a| relative[a].mul_add(normal[a], sum));
        let along: [f64; D] = std::array::from_fn(|a| (-closing).mul_add(normal[a], relative[a]));
        let excess = closing - gap.max(0.0) / drift;
        let touching = excess > 0.0 || *gap <= TOUCH * cell;
        let (pressed, dragged) = match *self {
            Self::Sticky => return relative.map(|v| mass * v),
            Self::Slip => (if touching { mass * closing } else { 0.0 }, 0.0),
            Self::Separating { friction, cohesion, tension } => {
                let pressed = match excess > 0.0 {
                    true => mass * excess,
                    false if touching => (mass * closing).max(-tension * area * kick).min(0.0),
                    false => 0.0,
                };
                let sticking = if touching { cohesion * area * kick } else { 0.0 };
                (pressed, friction.mul_add(pressed.max(0.0), sticking))
            }
        };
        let speed = length(&along);
        let share = if dragged > 0.0 { (dragged / (mass * speed)).min(1.0) } else { 0.0 };
        std::array::from_fn(|a| pressed.mul_add(normal[a], mass * share * along[a]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRICTION: PairLaw = PairLaw::Separating { friction: 0.5, cohesion: 0.0, tension: 0.0 };

    const STEP: Lengths = Lengths { kick: 0.01, drift: 0.01 };

    fn meeting(gap: f64) -> Meeting<2> {
        Meeting { normal: [0.0, 1.0], gap, area: 1.0 }
    }

    #[test]
    fn surfaces_that_touch_have_no_gap_wherever_the_node_is() {
        for share in [0.1, 0.3, 0.5, 0.7, 0.9] {
            let sums = [([0.0, 1.0], share), ([0.0, -1.0], 1.0 - share)];
            let meeting = Meeting::<2>::new(sums, [0.0, 1.0], 1.0, 0.5, 0).unwrap();
            assert!(meeting.gap.abs() < 1e-15, "{meeting:?}");
            assert_eq!(meeting.normal, [0.0, 1.0]);
        }
    }

    /// Two half spaces with a gap across a node in its middle: the hat has `½ (1 - g / 2)²` on each side.
    #[test]
    fn gaps_are_measured_in_full() {
        for gap in [0.0, 0.1, 0.5, 1.5] {
            let share = 0.5 * (1.0 - 0.5_f64 * gap).powi(2);
            let sums = [([0.0, 1.0], share), ([0.0, -1.0], share)];
            let meeting = Meeting::<2>::new(sums, [0.0, 1.0], 1.0, 2.0, 0).unwrap();
            approx::assert_relative_eq!(meeting.gap, 2.0 * gap, epsilon = 1e-14);
        }
    }

    /// The normal of a smooth surface is that of the cells around; at edges and corners it is that of the
    /// node; on a face of the domain it lies along the face.
    #[test]
    fn normals_are_smoothed_where_surfaces_are_smooth() {
        let degrees = |angle: f64| [angle.to_radians().sin(), angle.to_radians().cos()];
        let sums = [([0.0, 1.0], 0.5), ([0.0, -1.0], 0.5)];
        for (angle, found) in [(0.0, 0.0), (24.0, 24.0), (26.0, 0.0), (180.0, 0.0)] {
            let meeting = Meeting::<2>::new(sums, degrees(angle), 1.0, 1.0, 0).unwrap();
            for (got, wanted) in meeting.normal.iter().zip(degrees(found)) {
                approx::assert_relative_eq!(*got, wanted, epsilon = 1e-15);
            }
            assert_eq!(meeting.area, 1.0);
        }
        assert_eq!(Meeting::<2>::new(sums, degrees(24.0), 1.0, 1.0, 1).unwrap().normal, [0.0, 1.0]);
        assert_eq!(Meeting::<2>::new(sums, [0.0; 2], 1.0, 1.0, 0).unwrap().normal, [0.0, 1.0]);
    }

    #[test]
    fn gaps_close_freely_and_no_further() {
        let masses = [1.0, 1.0];
        assert_eq!(FRICTION.impulse(&[0.0, 1.0], masses, &meeting(0.02), 1.0, STEP), [0.0; 2]);
        let impulse = FRICTION.impulse(&[0.0, 3.0], masses, &meeting(0.02), 1.0, STEP);
        approx::assert_relative_eq!(impulse[1], 0.5, epsilon = 1e-14);
        assert_eq!(FRICTION.impulse(&[0.0, -3.0], masses, &meeting(0.0), 1.0, STEP), [0.0; 2]);
    }

    #[test]
    fn friction_is_bounded_by_pressure_and_cohesion() {
        let masses = [2.0, 2.0];
        let slides = FRICTION.impulse(&[3.0, 1.0], masses, &meeting(0.0), 1.0, STEP);
        assert_eq!(slides, [0.5, 1.0]);
        let sticks = FRICTION.impulse(&[0.25, 1.0], masses, &meeting(0.0), 1.0, STEP);
        assert_eq!(sticks, [0.25, 1.0]);
        let glue = PairLaw::Separating { friction: 0.0, cohesion: 20.0, tension: 10.0 };
        let held = glue.impulse(&[3.0, -3.0], masses, &meeting(0.0), 1.0, STEP);
        approx::assert_relative_eq!(held[0], 0.2, epsilon = 1e-14);
        approx::assert_relative_eq!(held[1], -0.1, epsilon = 1e-14);
        assert_eq!(glue.impulse(&[3.0, -3.0], masses, &meeting(0.1), 1.0, STEP), [0.0; 2]);
    }

    #[test]
    fn slip_holds_together_and_sticky_stops_all() {
        let masses = [1.0, 3.0];
        assert_eq!(PairLaw::Slip.impulse(&[3.0, -4.0], masses, &meeting(0.0), 1.0, STEP), [0.0, -3.0]);
        assert_eq!(PairLaw::Sticky.impulse(&[4.0, -4.0], masses, &meeting(0.0), 1.0, STEP), [3.0, -3.0]);
    }
}
