//! How colliders move: at rest, steadily, by a table, or freely under gravity and the forces on them.
use super::rigid::Meeting;
use super::rigid::turning::{Inertia, Orientation, matrix};
use super::vector::length;
use crate::geometry::rotation;
use crate::quantity::smooth_step;

/// Pose of a collider: translation from its place in the job and rotation about its reference point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<const D: usize> {
    /// Displacement of the reference point from its place in the job, m.
    pub translation: [f64; D],
    /// Angle about the collider's axis, rad.
    pub angle: f64,
    /// Orientation of a body that turns about any axis.
    pub orientation: Orientation,
    /// The rotation by angle or orientation, row by row: turned = R own.
    pub rotation: [[f64; D]; D],
}

impl<const D: usize> Pose<D> {
    /// The pose after a translation (m) and a rotation by an angle (rad) about a unit axis.
    pub fn new(translation: [f64; D], angle: f64, axis: [f64; 3]) -> Self {
        Self { translation, angle, orientation: Orientation::identity(), rotation: rotation(axis, angle) }
    }

    /// The pose after a translation (m) of a body in this orientation.
    pub fn oriented(translation: [f64; D], orientation: Orientation) -> Self {
        Self { translation, angle: 0.0, orientation, rotation: matrix(&orientation) }
    }
}

/// Velocities of a collider.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate<const D: usize> {
    /// Velocity of the reference point, m/s.
    pub velocity: [f64; D],
    /// Angular velocity about the collider's axis, rad/s.
    pub spin: f64,
    /// Angular velocity of a body that turns about any axis, rad/s.
    pub turning: [f64; 3],
}

impl<const D: usize> Rate<D> {
    /// No motion.
    pub const REST: Self = Self { velocity: [0.0; D], spin: 0.0, turning: [0.0; 3] };

    /// Velocity (m/s) and angular velocity about a fixed axis (rad/s).
    pub fn about_axis(velocity: [f64; D], spin: f64) -> Self {
        Self { velocity, spin, turning: [0.0; 3] }
    }

    /// The speed of the reference point (m/s) and the angular speed (rad/s).
    pub fn speeds(&self) -> (f64, f64) {
        (length(&self.velocity), self.spin.abs().max(length(&self.turning)))
    }
}

/// One row of a table of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot<const D: usize> {
    /// Time, s.
    pub time: f64,
    /// Displacement of the reference point from its place in the job, m.
    pub translation: [f64; D],
    /// Angle about the collider's axis, rad.
    pub angle: f64,
}

/// A motion between rows with increasing times; at rest before the first and after the last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table<const D: usize> {
    /// The rows.
    pub rows: Vec<Knot<D>>,
    /// Whether it comes to rest at each row, on half a period of a cosine from one to the next; else it is
    /// linear.
    pub is_smooth: bool,
}

/// A rigid body that moves under gravity and the forces of the material.
#[derive(Clone, Debug, PartialEq)]
pub struct Free<const D: usize> {
    /// Mass, kg; in plane strain of one metre of thickness.
    pub mass: f64,
    /// Axes along which it may move.
    pub along: [bool; D],
    /// Moment of inertia about the collider's axis through the reference point, kg m²; `None`: it does not
    /// turn.
    pub inertia: Option<f64>,
    /// Inertia about the centre of mass, which is the reference point, of a body that turns about any axis.
    pub turning: Option<Inertia>,
    /// Friction and restitution in collisions with faces of the domain and other colliders; `None`: it does
    /// not collide.
    pub meeting: Option<Meeting>,
    /// Table that it follows along the other axes, and in its rotation unless it turns; empty: it does
    /// neither.
    pub driven: Table<D>,
    /// Velocity and angular velocity at the start.
    pub start: Rate<D>,
}

impl<const D: usize> Free<D> {
    /// Whether it turns by itself.
    pub fn turns(&self) -> bool {
        self.inertia.is_some() || self.turning.is_some()
    }
}

/// The motion of a collider.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion<const D: usize> {
    /// At rest.
    Fixed,
    /// Velocity and angular velocity that never change.
    Steady(Rate<D>),
    /// The same after a smooth start from rest, on half a period of a cosine over this time, s.
    Rising(Rate<D>, f64),
    /// By a table.
    Table(Table<D>),
    /// A rigid body.
    Free(Free<D>),
}

impl<const D: usize> Motion<D> {
    /// Translation and angle at a time (s); for a free body those at the start.
    pub fn place(&self, time: f64) -> ([f64; D], f64) {
        match self {
            Self::Fixed | Self::Free(_) => ([0.0; D], 0.0),
            Self::Steady(rate) => (rate.velocity.map(|v| v * time), rate.spin * time),
            Self::Rising(rate, span) => {
                let time = risen(time, *span);
                (rate.velocity.map(|v| v * time), rate.spin * time)
            }
            Self::Table(table) => table.place(time),
        }
    }

    /// Mean velocity and angular velocity over a step from `time` to `time + dt` (s): the derivative of the
    /// interpolation, averaged. So the collider and the material that it carries move by the same amount,
    /// also across rows of a table. Of a free body: those at the start.
    pub fn mean_rate(&self, time: f64, dt: f64) -> Rate<D> {
        match self {
            Self::Fixed => Rate::REST,
            Self::Steady(rate) => *rate,
            Self::Rising(rate, span) => {
                let share = (risen(time + dt, *span) - risen(time, *span)) / dt;
                Rate::about_axis(rate.velocity.map(|v| share * v), share * rate.spin)
            }
            Self::Free(free) => free.start,
            Self::Table(table) => table.mean_rate(time, dt),
        }
    }

    /// The greatest speed of the reference point (m/s) and the greatest angular speed (rad/s) from `time` on;
    /// of a free body those at the start.
    pub fn greatest_speeds(&self, time: f64) -> (f64, f64) {
        match self {
            Self::Fixed => (0.0, 0.0),
            Self::Steady(rate) | Self::Rising(rate, _) => rate.speeds(),
            Self::Free(free) => free.start.speeds(),
            Self::Table(table) => table.greatest_speeds(time),
        }
    }
}

/// The time (s) in which a steady motion goes as far as one with a smooth start over `span` (s) until `time`:
/// `∫ (1 - cos(π t / T)) / 2 dt`.
fn risen(time: f64, span: f64) -> f64 {
    if time <= 0.0 {
        0.0
    } else if time < span {
        0.5 * (time - span / std::f64::consts::PI * libm::sin(std::f64::consts::PI * time / span))
    } else {
        time - 0.5 * span
    }
}

impl<const D: usize> Table<D> {
    /// Share of the change from one row to the next at this share of the time between them.
    fn progress(&self, part: f64) -> f64 {
        if self.is_smooth { smooth_step(part) } else { part }
    }

    /// Translation and angle at a time (s).
    pub fn place(&self, time: f64) -> ([f64; D], f64) {
        let Some((first, last)) = self.rows.first().zip(self.rows.last()) else { return ([0.0; D], 0.0) };
        if time <= first.time {
            return (first.translation, first.angle);
        }
        let next = self.rows.partition_point(|knot| knot.time < time);
        let Some(to) = self.rows.get(next) else { return (last.translation, last.angle) };
        let from = &self.rows[next - 1];
        let part = self.progress((time - from.time) / (to.time - from.time));
        let between = |a: f64, b: f64| part.mul_add(b - a, a);
        let translation = std::array::from_fn(|k| between(from.translation[k], to.translation[k]));
        (translation, between(from.angle, to.angle))
    }

    /// The rows from the last one that is not after a time (s) on.
    fn ahead(&self, time: f64) -> &[Knot<D>] {
        let next = self.rows.partition_point(|knot| knot.time <= time);
        &self.rows[next.saturating_sub(1)..]
    }

    /// Mean velocities over a step from `time` to `time + dt` (s).
    pub fn mean_rate(&self, time: f64, dt: f64) -> Rate<D> {
        let end = time + dt;
        let mut mean = Rate::REST;
        for pair in self.ahead(time).windows(2).take_while(|pair| pair[0].time < end) {
            let (from, to) = (time.max(pair[0].time), end.min(pair[1].time));
            let overlap = to - from;
            if overlap > 0.0 {
                let mut share = overlap / (end - time);
                if self.is_smooth {
                    let span = pair[1].time - pair[0].time;
                    let part = |time: f64| smooth_step((time - pair[0].time) / span);
                    share = (part(to) - part(from)) * (span / (end - time));
                }
                let slope = slope(pair);
                for k in 0..D {
                    mean.velocity[k] = share.mul_add(slope.velocity[k], mean.velocity[k]);
                }
                mean.spin = share.mul_add(slope.spin, mean.spin);
            }
        }
        mean
    }

    /// The greatest speeds (m/s, rad/s) from a time (s) on: of a smooth motion half π times those of a linear
    /// one.
    pub fn greatest_speeds(&self, time: f64) -> (f64, f64) {
        let peak = if self.is_smooth { std::f64::consts::FRAC_PI_2 } else { 1.0 };
        let speeds = self.ahead(time).windows(2).map(|pair| slope(pair).speeds());
        let most = speeds.fold((0.0, 0.0), |most: (f64, f64), one| (most.0.max(one.0), most.1.max(one.1)));
        (peak * most.0, peak * most.1)
    }
}

/// Velocities between two rows.
fn slope<const D: usize>(pair: &[Knot<D>]) -> Rate<D> {
    let span = pair[1].time - pair[0].time;
    let velocity = std::array::from_fn(|k| (pair[1].translation[k] - pair[0].translation[k]) / span);
    Rate::about_axis(velocity, (pair[1].angle - pair[0].angle) / span)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Motion<2> {
        let knot = |time, x, angle| Knot { time, translation: [x, 0.0], angle };
        let rows = vec![knot(1.0, 0.0, 0.0), knot(2.0, 4.0, 1.0), knot(4.0, 2.0, 1.0)];
        Motion::Table(Table { rows, is_smooth: false })
    }

    #[test]
    fn tables_are_linear_between_rows_and_rest_outside() {
        let motion = table();
        assert_eq!(motion.place(0.5), ([0.0, 0.0], 0.0));
        assert_eq!(motion.place(1.25), ([1.0, 0.0], 0.25));
        assert_eq!(motion.place(3.0), ([3.0, 0.0], 1.0));
        assert_eq!(motion.place(9.0), ([2.0, 0.0], 1.0));
        assert_eq!(motion.mean_rate(0.0, 0.5), Rate::REST);
        assert_eq!(motion.mean_rate(1.0, 0.5), Rate::about_axis([4.0, 0.0], 1.0));
        assert_eq!(motion.greatest_speeds(0.0), (4.0, 1.0));
        assert_eq!(motion.greatest_speeds(2.0), (1.0, 0.0));
    }

    fn smooth() -> Motion<2> {
        let Motion::Table(table) = table() else { unreachable!("a table") };
        Motion::Table(Table { is_smooth: true, ..table })
    }

    /// The mean velocity of a step gives the displacement of the motion, rows within the step included.
    #[test]
    fn mean_rates_add_up_to_the_way() {
        for motion in [table(), smooth(), Motion::Rising(Rate::about_axis([3.0, 0.0], 1.0), 1.7)] {
            let (mut time, mut way) = (0.0, 0.0);
            for step in 0..50 {
                let dt = 0.05 + 0.01 * f64::from(step % 7);
                way += dt * motion.mean_rate(time, dt).velocity[0];
                time += dt;
                assert!((way - motion.place(time).0[0]).abs() < 2e-14, "{motion:?} {time}");
            }
        }
    }

    /// Through the rows, at rest at each, halfway in between; the greatest speed is π/2 of the mean one.
    #[test]
    fn smooth_tables_rest_at_their_rows() {
        let motion = smooth();
        for (time, x) in [(0.0, 0.0), (1.0, 0.0), (1.5, 2.0), (2.0, 4.0), (3.0, 3.0), (4.0, 2.0), (9.0, 2.0)]
        {
            assert!((motion.place(time).0[0] - x).abs() < 1e-15, "{time}");
        }
        assert!((motion.place(1.25).0[0] - 4.0 * 0.5 * (1.0 - 0.5_f64.sqrt())).abs() < 1e-15);
        for time in [1.0, 2.0 - 1e-6, 2.0, 4.0 - 1e-6] {
            assert!(motion.mean_rate(time, 1e-6).velocity[0].abs() < 1e-4, "{time}");
        }
        let peak = std::f64::consts::FRAC_PI_2;
        assert!((motion.mean_rate(1.5 - 5e-7, 1e-6).velocity[0] - 4.0 * peak).abs() < 1e-9);
        assert_eq!(motion.greatest_speeds(0.0), (4.0 * peak, peak));
    }

    /// The start costs half of the steady displacement.
    #[test]
    fn a_rising_motion_becomes_steady() {
        let motion = Motion::<2>::Rising(Rate::about_axis([2.0, 0.0], -1.0), 0.5);
        assert_eq!(motion.place(0.5), ([0.5, 0.0], -0.25));
        assert_eq!(motion.place(1.5), ([2.5, 0.0], -1.25));
        assert!(motion.mean_rate(0.0, 1e-6).velocity[0] < 1e-4);
        assert!((motion.mean_rate(0.25 - 5e-7, 1e-6).velocity[0] - 1.0).abs() < 1e-9);
        assert!((motion.mean_rate(0.7, 0.1).spin + 1.0).abs() < 1e-14);
        assert_eq!(motion.greatest_speeds(0.0), (2.0, 1.0));
    }
}
