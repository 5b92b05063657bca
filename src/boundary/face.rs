//! Conditions on the faces of the domain.
/// What happens to material at one face of the domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaceCondition {
    /// No motion.
    Sticky,
    /// No motion through the face, free motion along it.
    Slip,
    /// No motion into the face, free motion away from it; Coulomb friction along it while it is pressed.
    Separating {
        /// Coefficient of friction, tan of the friction angle; 0 is frictionless.
        friction: f64,
    },
    /// Mirror plane; for velocities the same as `slip`.
    Symmetric,
    /// None: material moves out as it would without the face, and particles that cross it leave the domain.
    Outflow,
}

impl Default for FaceCondition {
    /// Separating, without friction.
    fn default() -> Self {
        Self::Separating { friction: 0.0 }
    }
}

impl FaceCondition {
    /// Applies the condition to a node's velocity (m/s). `axis` is the face's normal axis, `inward` is +1 at
    /// lower and -1 at upper faces.
    ///
    /// Friction takes away at most the tangential velocity that the normal impulse allows:
    /// `|Δv_t| ≤ μ |Δv_n|` (Coulomb's law for the impulse of one step).
    pub fn apply<const D: usize>(self, velocity: &mut [f64; D], axis: usize, inward: f64) {
        match self {
            Self::Outflow => {}
            Self::Sticky => *velocity = [0.0; D],
            Self::Slip | Self::Symmetric => velocity[axis] = 0.0,
            Self::Separating { friction } => {
                let normal = inward * velocity[axis];
                if normal >= 0.0 {
                    return;
                }
                velocity[axis] = 0.0;
                let tangential = velocity.iter().fold(0.0, |sum: f64, v| v.mul_add(*v, sum)).sqrt();
                let lost = -friction * normal;
                let kept = if tangential > lost { 1.0 - lost / tangential } else { 0.0 };
                for (k, v) in velocity.iter_mut().enumerate() {
                    if k != axis {
                        *v *= kept;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separating_face_lets_go() {
        let mut v = [1.0, 2.0, 0.5];
        FaceCondition::Separating { friction: 0.5 }.apply(&mut v, 2, 1.0);
        assert_eq!(v, [1.0, 2.0, 0.5]);
        FaceCondition::Separating { friction: 0.5 }.apply(&mut v, 2, -1.0);
        assert_eq!(v[2], 0.0);
    }

    #[test]
    fn friction_is_limited_by_the_normal_impulse() {
        let mut v = [3.0, 4.0, -2.0];
        FaceCondition::Separating { friction: 0.5 }.apply(&mut v, 2, 1.0);
        approx::assert_relative_eq!(v[0], 3.0 * 0.8);
        approx::assert_relative_eq!(v[1], 4.0 * 0.8);
        let mut v = [3.0, 4.0, -20.0];
        FaceCondition::Separating { friction: 0.5 }.apply(&mut v, 2, 1.0);
        assert_eq!(v, [0.0, 0.0, 0.0]);
    }

    #[test]
    fn slip_keeps_the_tangent_and_sticky_nothing() {
        let mut v = [1.0, -2.0];
        FaceCondition::Slip.apply(&mut v, 1, 1.0);
        assert_eq!(v, [1.0, 0.0]);
        FaceCondition::Sticky.apply(&mut v, 0, 1.0);
        assert_eq!(v, [0.0, 0.0]);
    }
}
