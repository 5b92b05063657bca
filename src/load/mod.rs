//! Loads: actions on the material beside stress, contact and the faces of the domain.
//!
//! A load acts between two times. Most kinds act on real nodes inside their region: each is a variant of
//! [`Kind`] with its effect on the velocity of a node in [`Load::apply`]. Forces on surfaces and points are
//! carried by particles ([`Kind::Carried`]), and water in the pores acts on particles ([`Kind::Water`]). The
//! solver sums impulse and work of each load from that alone.
//!
//! | file | what it holds |
//! |---|---|
//! | `mod.rs` | loads, and their effect on nodes |
//! | `gravity.rs` | gravity, and which way is up |
//! | `carried.rs` | forces that particles carry: tractions, pressures, point forces |
//! | `water.rs` | pressure of the water in the pores |
//! | `seepage.rs` | heads between which water flows |
//! | `words.rs` | quantities in words |
mod carried;
mod gravity;
pub mod seepage;
pub mod water;
mod words;

pub use carried::{Carried, CarriedForce, cofactor};
pub use gravity::{Gravity, Up};
pub use seepage::Seepage;
pub use water::Water;

use self::words::{all_in_words, in_words};
use crate::geometry::Shape;
use crate::leapfrog::Lengths;
use crate::quantity::{Place, Quantity, in_job};
use crate::text::quantity;

/// Number of columns that particles carry for some loads.
pub fn columns<const D: usize>(loads: &[Load<D>]) -> usize {
    loads.iter().filter_map(Load::carried).map(|carried| carried.force.columns()).sum()
}

/// A load of a job.
#[derive(Clone, Debug)]
pub struct Load<const D: usize> {
    /// Name; part of the names of its columns in the history.
    pub name: String,
    /// Kind and values of the load.
    pub kind: Kind<D>,
    /// Region in which it acts, relative to the lower corner of the domain; `None`: everywhere.
    pub region: Option<Shape<D>>,
    /// Time from which its own time is counted, s; infinite where it does not act.
    pub start: f64,
    /// Its own time from which it acts, s.
    pub from: f64,
    /// Its own time until which it acts, s.
    pub until: f64,
    /// Lower corner of the domain, m: expressions are in the job's coordinates.
    pub origin: [f64; D],
}

/// Effect of a load on the velocity v of a node in a step whose forces act over Δt.
#[derive(Clone, Debug)]
pub enum Kind<const D: usize> {
    /// Force per mass a (m/s²): `v += Δt a`.
    BodyForce([Quantity; D]),
    /// Prescribed velocity (m/s) along the axes that have one: `v = value`.
    Velocity([Option<Quantity>; D]),
    /// Drag in proportion to mass, with a rate r (1/s): `v *= exp(-r Δt)`.
    Damping(Quantity),
    /// Local damping (Cundall 1987), with a share α of the unbalanced force f of the step, against the
    /// velocity v at its start: `v_i -= α |Δt f_i / m| sign(v_i)`.
    LocalDamping(f64),
    /// A force that particles carry; nothing at nodes.
    Carried(Carried<D>),
    /// Pressure of the water in the pores, a force on particles; nothing at nodes.
    Water(Water),
}

impl<const D: usize> Load<D> {
    /// Force that particles carry for it, if they do.
    pub fn carried(&self) -> Option<&Carried<D>> {
        if let Kind::Carried(carried) = &self.kind { Some(carried) } else { None }
    }

    /// The water in the pores, if it is that.
    pub fn water(&self) -> Option<&Water> {
        if let Kind::Water(water) = &self.kind { Some(water) } else { None }
    }

    /// Whether it acts on particles and not on nodes: forces that they carry, the pressure of water in their
    /// pores, forces that depend on places of the undeformed body, and with scaled masses all forces.
    pub fn acts_on_particles(&self, are_masses_scaled: bool) -> bool {
        match &self.kind {
            Kind::Carried(_) | Kind::Water(_) => true,
            Kind::BodyForce(acceleration) => {
                are_masses_scaled || acceleration.iter().any(Quantity::names_undeformed)
            }
            _ => false,
        }
    }

    /// Whether it depends on places of the undeformed body.
    pub fn names_undeformed(&self) -> bool {
        match &self.kind {
            Kind::BodyForce(acceleration) => acceleration.iter().any(Quantity::names_undeformed),
            Kind::Carried(carried) => carried.force.names_undeformed(),
            _ => false,
        }
    }

    /// All quantities that it has.
    pub fn quantities(&self) -> Vec<&Quantity> {
        match &self.kind {
            Kind::BodyForce(acceleration) => acceleration.iter().collect(),
            Kind::Velocity(prescribed) => prescribed.iter().flatten().collect(),
            Kind::Damping(rate) => vec![rate],
            Kind::Carried(carried) => carried.force.quantities(),
            Kind::Water(water) => water.quantity().into_iter().collect(),
            Kind::LocalDamping(_) => Vec::new(),
        }
    }

    /// Kind, value, region and times, in words.
    pub fn describe(&self) -> String {
        let kind = match &self.kind {
            Kind::BodyForce(components) => format!("body force ({})", all_in_words(components, "m/s²")),
            Kind::Velocity(components) => {
                let given = components.iter().zip(["x", "y", "z"]);
                let given =
                    given.filter_map(|(c, axis)| Some(format!("{axis}: {}", in_words(c.as_ref()?, "m/s"))));
                format!("velocity {}", given.collect::<Vec<_>>().join(", "))
            }
            Kind::Damping(rate) => format!("damping {}", in_words(rate, "1/s")),
            Kind::Carried(carried) => carried.force.describe(),
            Kind::Water(water) => water.describe(),
            Kind::LocalDamping(factor) => format!("local damping {factor}"),
        };
        let place = if self.region.is_some() { "in a region" } else { "everywhere" };
        let [from, until] = [self.from, self.until].map(|time| quantity(time, "s"));
        match (self.from > 0.0, self.until.is_finite()) {
            (false, false) => format!("{kind}, {place}, always"),
            (_, false) => format!("{kind}, {place}, from {from} on"),
            _ => format!("{kind}, {place}, from {from} to {until}"),
        }
    }

    /// The place in the job of a point `x` (m from the lower corner of the domain) that is displaced by `u`,
    /// m.
    pub fn place(&self, x: &[f64; D], u: &[f64; D]) -> Place {
        let undeformed = std::array::from_fn(|a| x[a] - u[a]);
        Place { now: in_job(&self.origin, x), undeformed: in_job(&self.origin, &undeformed) }
    }

    /// Force per mass (m/s²) of a body force on a particle at a place and a time (s), where it is in its
    /// region; else nothing.
    pub fn body_force(&self, x: &[f64; D], place: &Place, time: f64) -> Option<[f64; D]> {
        match &self.kind {
            Kind::BodyForce(acceleration) if self.reaches(x) => {
                Some(acceleration.each_ref().map(|component| component.at(*place, time - self.start)))
            }
            _ => None,
        }
    }

    /// Whether it acts in a step that begins at `time`, s.
    pub fn is_active(&self, time: f64) -> bool {
        let own = time - self.start;
        self.from <= own && own < self.until
    }

    /// Whether it acts at a point, m from the lower corner of the domain.
    pub fn reaches(&self, x: &[f64; D]) -> bool {
        self.region.as_ref().is_none_or(|region| region.distance(x) <= 0.0)
    }

    /// Whether it needs the velocities of nodes at the start of a step.
    pub fn needs_start(&self) -> bool {
        matches!(self.kind, Kind::LocalDamping(_))
    }

    /// Applies local damping to the velocity (m/s) of a node, which was `start` at the start of the step; no
    /// effect for other kinds.
    pub fn damp(&self, velocity: &mut [f64; D], start: &[f64; D]) {
        let Kind::LocalDamping(share) = self.kind else { return };
        for (v, start) in velocity.iter_mut().zip(start).filter(|(_, start)| **start != 0.0) {
            *v -= share * (*v - start).abs() * start.signum();
        }
    }

    /// Changes the velocity (m/s) of a node at `x` in a step from the time `start` (s). Forces are taken in
    /// the middle of the time over which they act; a prescribed velocity is its value in the middle of the
    /// step, so that the displacement of the material is that of the prescribed motion to second order.
    pub fn apply(&self, velocity: &mut [f64; D], x: &[f64; D], start: f64, lengths: Lengths) {
        let (place, start, kick) = (in_job(&self.origin, x), start - self.start, lengths.kick);
        let of_forces = lengths.middle_of_kick(start);
        match &self.kind {
            Kind::BodyForce(acceleration) => {
                for axis in 0..D {
                    velocity[axis] = kick.mul_add(acceleration[axis].at(place, of_forces), velocity[axis]);
                }
            }
            Kind::Velocity(prescribed) => {
                let middle = lengths.middle_of_drift(start);
                for axis in 0..D {
                    if let Some(value) = &prescribed[axis] {
                        velocity[axis] = value.at(place, middle);
                    }
                }
            }
            Kind::Damping(rate) => {
                let kept = libm::exp(-rate.at(place, of_forces) * kick);
                velocity.iter_mut().for_each(|v| *v *= kept);
            }
            Kind::Carried(_) | Kind::LocalDamping(_) | Kind::Water(_) => {}
        }
    }

    /// Force (N) on a particle at a place that carries these numbers in the columns of `carried`, which
    /// belongs to this load, at a time of the load, s.
    pub fn force(&self, carried: &Carried<D>, numbers: &[f64], place: &Place, time: f64) -> [f64; D] {
        let place = *place;
        match &carried.force {
            CarriedForce::Traction(per_number) | CarriedForce::Point { force: per_number, .. } => {
                per_number.each_ref().map(|component| component.at(place, time) * numbers[0])
            }
            CarriedForce::Pressure { pressure, .. } => {
                let pressure = pressure.at(place, time);
                std::array::from_fn(|axis| -pressure * numbers[axis])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::{Expression, Table};

    const STEP: Lengths = Lengths { kick: 0.1, drift: 0.1 };

    fn load(kind: Kind<2>) -> Load<2> {
        Load {
            name: "load".into(),
            kind,
            region: None,
            start: 0.0,
            from: 1.0,
            until: 2.0,
            origin: [10.0, 0.0],
        }
    }

    #[test]
    fn body_forces_are_taken_in_the_middle_of_the_kick_at_the_place_in_the_job() {
        let x = Quantity::Expression(Box::new(Expression::parse("x * t").unwrap()));
        let force = load(Kind::BodyForce([x, Quantity::Constant(-9.81)]));
        let mut velocity = [1.0, 0.0];
        force.apply(&mut velocity, &[0.5, 3.0], 1.5, STEP);
        assert_eq!(velocity, [1.0 + 0.1 * (10.5 * 1.5), 0.1 * -9.81]);
        assert!(!force.is_active(0.99) && force.is_active(1.0) && !force.is_active(2.0));
    }

    #[test]
    fn a_grip_leaves_free_axes_alone() {
        let table = Table::new(&[(0.0, 0.0), (2.0, 4.0)]).unwrap();
        let grip = load(Kind::Velocity([None, Some(Quantity::Table(table))]));
        let mut velocity = [7.0, 8.0];
        grip.apply(&mut velocity, &[0.0, 0.0], 1.5, STEP);
        // In the middle of the step.
        assert_eq!(velocity, [7.0, 2.0 * 1.55]);
    }

    /// In stages, times of a load are those since the first stage in which it acts.
    #[test]
    fn a_load_of_a_later_stage_has_a_time_of_its_own() {
        let mut ramp = load(Kind::BodyForce([
            Quantity::Table(Table::new(&[(1.0, 0.0), (2.0, 8.0)]).unwrap()),
            Quantity::default(),
        ]));
        ramp.start = 100.0;
        let mut velocity = [0.0; 2];
        ramp.apply(&mut velocity, &[0.0; 2], 101.5, Lengths { kick: 0.5, drift: 0.5 });
        assert_eq!(velocity, [2.0, 0.0]);
        assert!(!ramp.is_active(1.5) && ramp.is_active(101.5));
        ramp.start = f64::INFINITY;
        assert!(!ramp.is_active(1.5) && !ramp.is_active(101.5));
    }

    /// A force that accelerates the node acts with 1 - α, one that slows it down with 1 + α; at rest there is
    /// no damping.
    #[test]
    fn local_damping_is_a_share_of_the_unbalanced_force() {
        let damping = load(Kind::LocalDamping(0.25));
        let mut velocity = [3.0, 1.0];
        damping.damp(&mut velocity, &[2.0, 2.0]);
        assert_eq!(velocity, [2.75, 0.75]);
        let mut velocity = [-3.0, 1.0];
        damping.damp(&mut velocity, &[-2.0, 0.0]);
        assert_eq!(velocity, [-2.75, 1.0]);
    }

    /// Two half steps damp as much as a whole one.
    #[test]
    fn damping_does_not_depend_on_the_step() {
        let damping = load(Kind::Damping(Quantity::Constant(3.0)));
        let (mut whole, mut halves) = ([2.0, -1.0], [2.0, -1.0]);
        damping.apply(&mut whole, &[0.0; 2], 1.5, Lengths { kick: 0.2, drift: 0.2 });
        damping.apply(&mut halves, &[0.0; 2], 1.5, STEP);
        damping.apply(&mut halves, &[0.0; 2], 1.6, STEP);
        for axis in 0..2 {
            assert!((whole[axis] - halves[axis]).abs() <= 4.0 * f64::EPSILON * whole[axis].abs());
        }
    }
}
