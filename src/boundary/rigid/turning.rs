//! How rigid bodies turn: inertia, orientation, and motion without torque.
use crate::boundary::collider::cross;
use crate::boundary::motion::length;

/// A unit quaternion: w, then the components along x, y and z.
pub type Quaternion = [f64; 4];

/// No rotation.
pub const UPRIGHT: Quaternion = [1.0, 0.0, 0.0, 0.0];

/// Greatest angle of a stage of the integration, rad: the relative error of the energy is 1e-8 there, and
/// grows with the fourth power of the angle.
const ANGLE: f64 = 0.05;

/// Inertia of a body about its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// Principal moments, kg m².
    pub moments: [f64; 3],
    /// Columns: the principal axes in the body as defined in the job.
    pub axes: [[f64; 3]; 3],
}

impl Inertia {
    /// From a symmetric tensor (kg m²), by Jacobi's rotations.
    pub fn new(tensor: [[f64; 3]; 3]) -> Self {
        let (mut t, mut axes) = (tensor, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let size = t[0][0].abs().max(t[1][1].abs()).max(t[2][2].abs());
        for _ in 0..30 {
            let pairs = [(0, 1), (0, 2), (1, 2)];
            if pairs.iter().all(|&(p, q)| t[p][q].abs() <= 1e-16 * size) {
                break;
            }
            for (p, q) in pairs {
                if t[p][q] == 0.0 {
                    continue;
                }
                // Golub and Van Loan, Matrix Computations, 8.5.2.
                let tau = (t[q][q] - t[p][p]) / (2.0 * t[p][q]);
                let tangent = tau.signum() / (tau.abs() + tau.mul_add(tau, 1.0).sqrt());
                let c = 1.0 / tangent.mul_add(tangent, 1.0).sqrt();
                let s = tangent * c;
                let turn = |m: &mut [[f64; 3]; 3]| {
                    for row in m.iter_mut() {
                        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                    }
                };
                turn(&mut t);
                for k in 0..3 {
                    (t[p][k], t[q][k]) = (c * t[p][k] - s * t[q][k], s * t[p][k] + c * t[q][k]);
                }
                turn(&mut axes);
            }
        }
        Self { moments: [t[0][0], t[1][1], t[2][2]], axes }
    }

    /// A vector of space along the principal axes of a body in this orientation.
    fn along_axes(&self, v: &[f64; 3], orientation: &Quaternion) -> [f64; 3] {
        let own = turned(&conjugate(orientation), v);
        std::array::from_fn(|k| (0..3).fold(0.0, |sum, i| self.axes[i][k].mul_add(own[i], sum)))
    }

    /// A vector along the principal axes as one of space.
    fn in_space(&self, v: &[f64; 3], orientation: &Quaternion) -> [f64; 3] {
        let own = std::array::from_fn(|i| (0..3).fold(0.0, |sum, k| self.axes[i][k].mul_add(v[k], sum)));
        turned(orientation, &own)
    }

    /// Angular velocity (rad/s) with an angular momentum (kg m²/s), both in space.
    pub fn spin(&self, momentum: &[f64; 3], orientation: &Quaternion) -> [f64; 3] {
        let m = self.along_axes(momentum, orientation);
        self.in_space(&std::array::from_fn(|k| m[k] / self.moments[k]), orientation)
    }

    /// Angular momentum (kg m²/s) with an angular velocity (rad/s), both in space.
    pub fn momentum(&self, spin: &[f64; 3], orientation: &Quaternion) -> [f64; 3] {
        let w = self.along_axes(spin, orientation);
        self.in_space(&std::array::from_fn(|k| w[k] * self.moments[k]), orientation)
    }

    /// Mean angular velocity (rad/s) over a step of length `dt` (s) in which the angular momentum (kg m²/s)
    /// stays: the rotation over the step is the one about this vector by its length times dt.
    ///
    /// Euler's equations are split into turning about one principal axis after the other, each exact, so that
    /// the angular momentum in space never changes (McLachlan 1993; Reich 1994); Suzuki's composition (1990)
    /// makes of it a symmetric method of fourth order.
    pub fn mean_spin(&self, momentum: &[f64; 3], orientation: &Quaternion, dt: f64) -> [f64; 3] {
        let mut m = self.along_axes(momentum, orientation);
        let spin = length(&std::array::from_fn::<f64, 3, _>(|k| m[k] / self.moments[k]));
        if spin == 0.0 || dt == 0.0 {
            return self.spin(momentum, orientation);
        }
        let parts = (spin * dt / ANGLE).ceil().clamp(1.0, 1e4);
        let outer = 1.0 / (4.0 - libm::cbrt(4.0));
        let mut turn = UPRIGHT;
        for _ in 0..parts as usize {
            for share in [outer, outer, 1.0 - 4.0 * outer, outer, outer] {
                let h = share * dt / parts;
                for (axis, h) in [(0, 0.5 * h), (1, 0.5 * h), (2, h), (1, 0.5 * h), (0, 0.5 * h)] {
                    let angle = h * m[axis] / self.moments[axis];
                    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
                    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                    (m[i], m[j]) = (cosine * m[i] + sine * m[j], cosine * m[j] - sine * m[i]);
                    let mut one = [libm::cos(0.5 * angle), 0.0, 0.0, 0.0];
                    one[1 + axis] = libm::sin(0.5 * angle);
                    turn = product(&turn, &one);
                }
            }
        }
        self.in_space(&rotation_vector(&turn).map(|c| c / dt), orientation)
    }
}

/// Rotation vector (rad) of a unit quaternion.
fn rotation_vector(q: &Quaternion) -> [f64; 3] {
    let (w, v) = if q[0] < 0.0 { (-q[0], [-q[1], -q[2], -q[3]]) } else { (q[0], [q[1], q[2], q[3]]) };
    let sine = length(&v);
    let factor = if sine > 0.0 { 2.0 * libm::atan2(sine, w) / sine } else { 2.0 };
    v.map(|c| factor * c)
}

/// An orientation turned by a rotation vector in space (rad).
pub fn advanced(orientation: &Quaternion, by: &[f64; 3]) -> Quaternion {
    let angle = length(by);
    if angle == 0.0 {
        return *orientation;
    }
    let factor = libm::sin(0.5 * angle) / angle;
    let turn = [libm::cos(0.5 * angle), factor * by[0], factor * by[1], factor * by[2]];
    let q = product(&turn, orientation);
    let size = length(&q);
    q.map(|c| c / size)
}

/// The rotation matrix of an orientation, row by row.
pub fn matrix<const D: usize>(q: &Quaternion) -> [[f64; D]; D] {
    let columns: [[f64; 3]; 3] =
        std::array::from_fn(|k| turned(q, &std::array::from_fn(|a| if a == k { 1.0 } else { 0.0 })));
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}

fn conjugate(q: &Quaternion) -> Quaternion {
    [q[0], -q[1], -q[2], -q[3]]
}

/// A vector turned: `v + 2 w (u × v) + 2 u × (u × v)`.
fn turned(q: &Quaternion, v: &[f64; 3]) -> [f64; 3] {
    let u = [q[1], q[2], q[3]];
    let once = cross(u, *v);
    let twice = cross(u, once);
    std::array::from_fn(|a| v[a] + 2.0 * q[0].mul_add(once[a], twice[a]))
}

/// The rotation by `b`, then that by `a`.
fn product(a: &Quaternion, b: &Quaternion) -> Quaternion {
    let [aw, ax, ay, az] = *a;
    let [bw, bx, by, bz] = *b;
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Principal moments and axes of a turned tensor give it back.
    #[test]
    fn inertia_is_taken_apart_and_put_together() {
        let tensor = [[4.0, 0.5, -0.3], [0.5, 3.0, 0.2], [-0.3, 0.2, 2.0]];
        let inertia = Inertia::new(tensor);
        for k in 0..3 {
            let spin = std::array::from_fn(|a| if a == k { 1.0 } else { 0.0 });
            let found = inertia.momentum(&spin, &UPRIGHT);
            assert!((0..3).all(|i| (found[i] - tensor[i][k]).abs() < 1e-14), "{found:?}");
        }
    }

    /// A top without torque that turns about its middle axis: its angular momentum is conserved, its energy
    /// to 1e-8, and its orientation after several somersaults (Dzhanibekov) agrees with Euler's equations
    /// integrated by Runge and Kutta's method in steps of a tenth.
    #[test]
    fn a_top_without_torque_keeps_what_it_must() {
        let inertia = Inertia::new([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.5]]);
        let spin = [0.01, 3.0, 0.02];
        let momentum = inertia.momentum(&spin, &UPRIGHT);
        let energy =
            |q: &Quaternion| 0.5 * (0..3).map(|k| momentum[k] * inertia.spin(&momentum, q)[k]).sum::<f64>();
        let (mut q, dt, start) = (UPRIGHT, 0.004, energy(&UPRIGHT));
        let (mut own, mut other, mut flips, mut side) = (spin, UPRIGHT, 0, 1.0);
        for _ in 0..10_000 {
            q = advanced(&q, &inertia.mean_spin(&momentum, &q, dt).map(|w| w * dt));
            assert!((energy(&q) / start - 1.0).abs() < 1e-8);
            for _ in 0..10 {
                (own, other) = runge_kutta(&inertia.moments, own, other, dt / 10.0);
            }
            let axis = turned(&q, &[0.0, 1.0, 0.0]);
            if axis[1] * side < -0.5 {
                (flips, side) = (flips + 1, -side);
            }
        }
        let off = (0..4).map(|k| (q[k] - other[k]).abs().min((q[k] + other[k]).abs())).fold(0.0, f64::max);
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
        let momentum = inertia.momentum(&[0.4, 0.0, 1.0], &UPRIGHT);
        let rate = length(&momentum) / 2.0;
        let steps = 2000;
        let dt = std::f64::consts::TAU / rate / f64::from(steps);
        let mut q = UPRIGHT;
        for _ in 0..steps {
            q = advanced(&q, &inertia.mean_spin(&momentum, &q, dt).map(|w| w * dt));
        }
        let axis = turned(&q, &[0.0, 0.0, 1.0]);
        assert!((0..3).all(|k| (axis[k] - [0.0, 0.0, 1.0][k]).abs() < 1e-9), "{axis:?}");
    }

    /// Euler's equations in the body's axes and the turning of these.
    fn runge_kutta(moments: &[f64; 3], w: [f64; 3], q: Quaternion, h: f64) -> ([f64; 3], Quaternion) {
        let slope = |w: [f64; 3], q: Quaternion| {
            let [a, b, c] = *moments;
            let dw = [(b - c) / a * w[1] * w[2], (c - a) / b * w[2] * w[0], (a - b) / c * w[0] * w[1]];
            (dw, product(&q, &[0.0, w[0], w[1], w[2]]).map(|c| 0.5 * c))
        };
        let ahead = |h: f64, (dw, dq): ([f64; 3], Quaternion)| {
            (std::array::from_fn(|k| w[k] + h * dw[k]), std::array::from_fn(|k| q[k] + h * dq[k]))
        };
        let first = slope(w, q);
        let next = |(w, q)| slope(w, q);
        let second = next(ahead(0.5 * h, first));
        let third = next(ahead(0.5 * h, second));
        let fourth = next(ahead(h, third));
        let w = std::array::from_fn(|k| {
            w[k] + h / 6.0 * (first.0[k] + 2.0 * second.0[k] + 2.0 * third.0[k] + fourth.0[k])
        });
        let q = std::array::from_fn(|k| {
            q[k] + h / 6.0 * (first.1[k] + 2.0 * second.1[k] + 2.0 * third.1[k] + fourth.1[k])
        });
        (w, q)
    }
}
