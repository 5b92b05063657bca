//! How colliders move: at rest, steadily, by a table, or freely under gravity and the forces on them.
use super::rigid::Meeting;
use super::rigid::turning::{Inertia, Quaternion, UPRIGHT, matrix};
use crate::geometry::rotation;

/// Where a collider is: shifted from its place in the job and turned about its reference point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<const D: usize> {
    /// Way of the reference point from its place in the job, m.
    pub translation: [f64; D],
    /// Angle about the collider's axis, rad.
    pub angle: f64,
    /// Orientation of a body that turns about any axis.
    pub orientation: Quaternion,
    /// The rotation by angle or orientation, row by row: turned = R own.
    pub rotation: [[f64; D]; D],
}

impl<const D: usize> Pose<D> {
    /// The pose after a translation (m) and a rotation by an angle (rad) about a unit axis.
    pub fn new(translation: [f64; D], angle: f64, axis: [f64; 3]) -> Self {
        Self { translation, angle, orientation: UPRIGHT, rotation: rotation(axis, angle) }
    }

    /// The pose after a translation (m) of a body in this orientation.
    pub fn oriented(translation: [f64; D], orientation: Quaternion) -> Self {
        Self { translation, angle: 0.0, orientation, rotation: matrix(&orientation) }
    }
}

/// How fast a collider moves.
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
    /// Way of the reference point from its place in the job, m.
    pub translation: [f64; D],
    /// Angle about the collider's axis, rad.
    pub angle: f64,
}

/// A motion that is linear between rows with increasing times; at rest before the first and after the last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table<const D: usize>(pub Vec<Knot<D>>);

/// A rigid body that moves under gravity and the forces of the material.
#[derive(Clone, Debug, PartialEq)]
pub struct Free<const D: usize> {
    /// Mass, kg; in plane strain of one metre of thickness.
    pub mass: f64,
    /// Axes along which it may move.
    pub along: [bool; D],
    /// Moment of inertia about the collider's axis through the reference point, kg m²; `None`: it does not turn.
    pub inertia: Option<f64>,
    /// Inertia about the centre of mass, which is the reference point, of a body that turns about any axis.
    pub turning: Option<Inertia>,
    /// What it does to faces of the domain and to other colliders; `None`: it does not feel them.
    pub meeting: Option<Meeting>,
    /// Table that it follows along the other axes, and in its rotation unless it turns; empty: it does neither.
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
            Self::Table(table) => table.place(time),
        }
    }

    /// Mean velocity and angular velocity over a step from `time` to `time + dt` (s): the derivative of the
    /// interpolation, averaged. So the collider and the material that it carries move by the same amount, also across
    /// rows of a table. Of a free body: those at the start.
    pub fn mean_rate(&self, time: f64, dt: f64) -> Rate<D> {
        match self {
            Self::Fixed => Rate::REST,
            Self::Steady(rate) => *rate,
            Self::Free(free) => free.start,
            Self::Table(table) => table.mean_rate(time, dt),
        }
    }

    /// The greatest speed of the reference point (m/s) and the greatest angular speed (rad/s) from `time` on; of a
    /// free body those at the start.
    pub fn greatest_speeds(&self, time: f64) -> (f64, f64) {
        match self {
            Self::Fixed => (0.0, 0.0),
            Self::Steady(rate) => rate.speeds(),
            Self::Free(free) => free.start.speeds(),
            Self::Table(table) => table.greatest_speeds(time),
        }
    }
}

impl<const D: usize> Table<D> {
    /// Translation and angle at a time (s).
    pub fn place(&self, time: f64) -> ([f64; D], f64) {
        let Some((first, last)) = self.0.first().zip(self.0.last()) else { return ([0.0; D], 0.0) };
        if time <= first.time {
            return (first.translation, first.angle);
        }
        let next = self.0.partition_point(|knot| knot.time < time);
        let Some(to) = self.0.get(next) else { return (last.translation, last.angle) };
        let from = &self.0[next - 1];
        let part = (time - from.time) / (to.time - from.time);
        let between = |a: f64, b: f64| part.mul_add(b - a, a);
        let translation = std::array::from_fn(|k| between(from.translation[k], to.translation[k]));
        (translation, between(from.angle, to.angle))
    }

    /// Mean velocities over a step from `time` to `time + dt` (s).
    pub fn mean_rate(&self, time: f64, dt: f64) -> Rate<D> {
        let end = time + dt;
        let mut mean = Rate::REST;
        for pair in self.0.windows(2) {
            let overlap = end.min(pair[1].time) - time.max(pair[0].time);
            if overlap > 0.0 {
                let share = overlap / (end - time);
                let slope = slope(pair);
                for k in 0..D {
                    mean.velocity[k] = share.mul_add(slope.velocity[k], mean.velocity[k]);
                }
                mean.spin = share.mul_add(slope.spin, mean.spin);
            }
        }
        mean
    }

    /// The greatest speeds (m/s, rad/s) from a time (s) on.
    pub fn greatest_speeds(&self, time: f64) -> (f64, f64) {
        let ahead = self.0.windows(2).filter(|pair| pair[1].time > time);
        ahead
            .map(|pair| slope(pair).speeds())
            .fold((0.0, 0.0), |most: (f64, f64), one| (most.0.max(one.0), most.1.max(one.1)))
    }
}

/// Velocities between two rows.
fn slope<const D: usize>(pair: &[Knot<D>]) -> Rate<D> {
    let span = pair[1].time - pair[0].time;
    let velocity = std::array::from_fn(|k| (pair[1].translation[k] - pair[0].translation[k]) / span);
    Rate::about_axis(velocity, (pair[1].angle - pair[0].angle) / span)
}

/// Euclidean length.
pub(crate) fn length(vector: &[f64]) -> f64 {
    vector.iter().fold(0.0, |sum: f64, c| c.mul_add(*c, sum)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Motion<2> {
        let knot = |time, x, angle| Knot { time, translation: [x, 0.0], angle };
        Motion::Table(Table(vec![knot(1.0, 0.0, 0.0), knot(2.0, 4.0, 1.0), knot(4.0, 2.0, 1.0)]))
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

    /// The mean velocity of a step moves by what the table moves, rows within the step included.
    #[test]
    fn mean_rates_add_up_to_the_way() {
        let motion = table();
        let (mut time, mut way) = (0.0, 0.0);
        for step in 0..50 {
            let dt = 0.05 + 0.01 * f64::from(step % 7);
            way += dt * motion.mean_rate(time, dt).velocity[0];
            time += dt;
            assert!((way - motion.place(time).0[0]).abs() < 1e-14, "{time}");
        }
    }
}
