//! How rigid bodies turn: inertia, orientation, and motion without torque.
use nalgebra::{Matrix3, Unit, UnitQuaternion, Vector3};

/// The rotation of a body from its place in the job.
pub type Orientation = UnitQuaternion<f64>;

/// Greatest angle of a stage of the integration, rad: the relative error of the energy is 1e-8 there, and
/// grows with the fourth power of the angle.
const ANGLE: f64 = 0.05;

/// Inertia of a body about its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Principal moments, kg m².
    pub moments: Vector3<f64>,
    /// Columns: the principal axes in the body as defined in the job.
    pub axes: Matrix3<f64>,
}

impl Inertia {
    /// From a symmetric tensor (kg m²).
    pub fn new(tensor: [[f64; 3]; 3]) -> Self {
        let principal = Matrix3::from(tensor).symmetric_eigen();
        Self { moments: principal.eigenvalues, axes: principal.eigenvectors }
    }

    /// A vector of space along the principal axes of a body in this orientation.
    fn along_axes(&self, v: &[f64; 3], orientation: &Orientation) -> Vector3<f64> {
        self.axes.tr_mul(&orientation.inverse_transform_vector(&Vector3::from(*v)))
    }

    /// A vector along the principal axes as one of space.
    fn in_space(&self, v: &Vector3<f64>, orientation: &Orientation) -> [f64; 3] {
        (orientation * (self.axes * v)).into()
    }

    /// Angular velocity (rad/s) with an angular momentum (kg m²/s), both in space.
    pub fn spin(&self, momentum: &[f64; 3], orientation: &Orientation) -> [f64; 3] {
        let m = self.along_axes(momentum, orientation);
        self.in_space(&m.component_div(&self.moments), orientation)
    }

    /// The inverse of the inertia in space, 1/(kg m²).
    pub(super) fn inverse(&self, orientation: &Orientation) -> Matrix3<f64> {
        let axes = orientation.to_rotation_matrix() * self.axes;
        axes * Matrix3::from_diagonal(&self.moments.map(|moment| 1.0 / moment)) * axes.transpose()
    }

    /// Angular momentum (kg m²/s) with an angular velocity (rad/s), both in space.
    pub fn momentum(&self, spin: &[f64; 3], orientation: &Orientation) -> [f64; 3] {
        let w = self.along_axes(spin, orientation);
        self.in_space(&w.component_mul(&self.moments), orientation)
    }

    /// Mean angular velocity (rad/s) over a step of length `dt` (s) in which the angular momentum (kg m²/s)
    /// stays: the rotation over the step is the one about this vector by its length times dt.
    ///
    /// Euler's equations are split into turning about one principal axis after the other, each exact, so that
    /// the angular momentum in space never changes (McLachlan 1993; Reich 1994); Suzuki's composition (1990)
    /// makes of it a symmetric method of fourth order.
    pub fn mean_spin(&self, momentum: &[f64; 3], orientation: &Orientation, dt: f64) -> [f64; 3] {
        let mut m = self.along_axes(momentum, orientation);
        let spin = m.component_div(&self.moments).norm();
        if spin == 0.0 || dt == 0.0 {
            return self.spin(momentum, orientation);
        }
        let parts = (spin * dt / ANGLE).ceil().clamp(1.0, 1e4);
        let outer = 1.0 / (4.0 - libm::cbrt(4.0));
        let mut turn = Orientation::identity();
        for _ in 0..parts as usize {
            for share in [outer, outer, 1.0 - 4.0 * outer, outer, outer] {
                let h = share * dt / parts;
                for (axis, h) in [(0, 0.5 * h), (1, 0.5 * h), (2, h), (1, 0.5 * h), (0, 0.5 * h)] {
                    let angle = h * m[axis] / self.moments[axis];
                    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
                    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                    (m[i], m[j]) = (cosine * m[i] + sine * m[j], cosine * m[j] - sine * m[i]);
                    let axis = Unit::new_unchecked(Vector3::ith(axis, 1.0));
                    turn *= UnitQuaternion::from_axis_angle(&axis, angle);
                }
            }
        }
        self.in_space(&(turn.scaled_axis() / dt), orientation)
    }
}

/// An orientation turned by a rotation vector in space (rad).
pub fn advanced(orientation: &Orientation, by: &[f64; 3]) -> Orientation {
    if *by == [0.0; 3] {
        return *orientation;
    }
    let turned = UnitQuaternion::from_scaled_axis(Vector3::from(*by)) * orientation;
    // Lengths do not drift.
    UnitQuaternion::new_normalize(turned.into_inner())
}

/// The unit quaternion of an orientation: w, then the components along x, y and z.
pub fn quaternion(orientation: &Orientation) -> [f64; 4] {
    [orientation.w, orientation.i, orientation.j, orientation.k]
}

/// The rotation matrix of an orientation, row by row.
pub fn matrix<const D: usize>(orientation: &Orientation) -> [[f64; D]; D] {
    let rotation = orientation.to_rotation_matrix();
    std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    type Quaternion = nalgebra::Quaternion<f64>;

    /// Principal moments and axes of a turned tensor give it back.
    #[test]
    fn inertia_is_taken_apart_and_put_together() {
        let tensor = [[4.0, 0.5, -0.3], [0.5, 3.0, 0.2], [-0.3, 0.2, 2.0]];
        let inertia = Inertia::new(tensor);
        for k in 0..3 {
            let spin = std::array::from_fn(|a| if a == k { 1.0 } else { 0.0 });
            let found = inertia.momentum(&spin, &Orientation::identity());
            assert!((0..3).all(|i| (found[i] - tensor[i][k]).abs() < 1e-14), "{found:?}");
        }
    }

    /// A top without torque that turns about its middle axis: its angular momentum is conserved, its energy
    /// to 1e-8, and its orientation after several somersaults (Dzhanibekov) agrees with Euler's equations
    /// integrated by Runge and Kutta's method in steps of a tenth.
    #[test]
    fn a_top_without_torque_keeps_what_it_must() {
        let inertia = Inertia::new([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.5]]);
        let inertia_moments = [1.0, 2.0, 2.5];
        let spin = [0.01, 3.0, 0.02];
        let momentum = inertia.momentum(&spin, &Orientation::identity());
        let energy =
            |q: &Orientation| 0.5 * (0..3).map(|k| momentum[k] * inertia.spin(&momentum, q)[k]).sum::<f64>();
        let (mut q, dt, start) = (Orientation::identity(), 0.004, energy(&Orientation::identity()));
        let (mut own, mut other, mut flips, mut side) = (spin, Quaternion::identity(), 0, 1.0);
        for _ in 0..10_000 {
            q = advanced(&q, &inertia.mean_spin(&momentum, &q, dt).map(|w| w * dt));
            assert!((energy(&q) / start - 1.0).abs() < 1e-8);
            for _ in 0..10 {
                (own, other) = runge_kutta(&inertia_moments, own, other, dt / 10.0);
            }
            let axis = q * Vector3::y();
            if axis[1] * side < -0.5 {
                (flips, side) = (flips + 1, -side);
            }
        }
        let off = (q.into_inner() - other).norm().min((q.into_inner() + other).norm());
        println!(
            "{flips} somersaults, energy off by {:.1e}, orientation by {off:.1e}",
            energy(&q) / start - 1.0
        );
        assert!(flips >= 3 && off < 1e-4, "{flips} {off}");
    }

    /// The axis of a symmetric top goes round its angular momentum with L / I₁.
    #[test]
    fn a_symmetric_top_precesses_as_the_closed_form_says() {
        let inertia = Inertia::new([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]);
        let momentum = inertia.momentum(&[0.4, 0.0, 1.0], &Orientation::identity());
        let rate = Vector3::from(momentum).norm() / 2.0;
        let steps = 2000;
        let dt = std::f64::consts::TAU / rate / f64::from(steps);
        let mut q = Orientation::identity();
        for _ in 0..steps {
            q = advanced(&q, &inertia.mean_spin(&momentum, &q, dt).map(|w| w * dt));
        }
        let axis = q * Vector3::z();
        assert!((0..3).all(|k| (axis[k] - [0.0, 0.0, 1.0][k]).abs() < 1e-9), "{axis:?}");
    }

    /// Euler's equations in the body's axes and the turning of these.
    fn runge_kutta(moments: &[f64; 3], w: [f64; 3], q: Quaternion, h: f64) -> ([f64; 3], Quaternion) {
        let slope = |w: [f64; 3], q: Quaternion| {
            let [a, b, c] = *moments;
            let dw = [(b - c) / a * w[1] * w[2], (c - a) / b * w[2] * w[0], (a - b) / c * w[0] * w[1]];
            (dw, q * Quaternion::new(0.0, w[0], w[1], w[2]) * 0.5)
        };
        let ahead = |h: f64, (dw, dq): ([f64; 3], Quaternion)| -> ([f64; 3], Quaternion) {
            (std::array::from_fn(|k| w[k] + h * dw[k]), q + dq * h)
        };
        let first = slope(w, q);
        let next = |(w, q)| slope(w, q);
        let second = next(ahead(0.5 * h, first));
        let third = next(ahead(0.5 * h, second));
        let fourth = next(ahead(h, third));
        let w = std::array::from_fn(|k| {
            w[k] + h / 6.0 * (first.0[k] + 2.0 * second.0[k] + 2.0 * third.0[k] + fourth.0[k])
        });
        (w, q + (first.1 + second.1 * 2.0 + third.1 * 2.0 + fourth.1) * (h / 6.0))
    }
}
