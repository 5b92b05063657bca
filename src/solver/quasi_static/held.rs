//! Supports of a node in a load step: faces, grips and colliders along axes, and walls along which it slides
//! or which it may leave.
use crate::solver::state::grid::inside::dot;

/// Source of a prescribed displacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Holder {
    /// A load that prescribes velocities, by its number.
    Grip(usize),
    /// A collider, by its number.
    Collider(usize),
    /// A face of the domain: `2 axis` for the lower, one more for the upper.
    Face(usize),
}

/// A prescribed displacement along an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub(super) by: Holder,
    /// Displacement in the step, m.
    pub(super) way: f64,
}

/// A unit vector, and the displacement along it.
pub(super) type Along<const D: usize> = ([f64; D], Held);

/// Hold of a wall on a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// Nothing: the node has left.
    Away,
    /// It holds the node along its normal.
    Touches,
}

/// A wall at a node.
#[derive(Clone, Debug)]
pub(super) struct Wall<const D: usize> {
    /// Number of the node.
    pub(super) node: usize,
    pub(super) by: Holder,
    /// Unit normal, to the material.
    pub(super) normal: [f64; D],
    /// Displacement of the wall in the step, m.
    pub(super) way: [f64; D],
    /// Whether the node may leave.
    pub(super) separates: bool,
    pub(super) state: State,
    /// The direction that it alone holds: its normal without what else holds the node; 0 where that is all.
    pub(super) along: [f64; D],
    pub(super) friction: Friction<D>,
}

/// Friction of a wall on a node: that of a spring along the wall, which slides under the greatest friction.
#[derive(Clone, Debug)]
pub(super) struct Friction<const D: usize> {
    /// Coefficient μ.
    pub(super) coefficient: f64,
    /// Stiffness of the spring, N/m.
    pub(super) spring: f64,
    /// Force of the spring without slip, N.
    force: [f64; D],
    /// Greatest friction, N: μ times the last known pressure.
    most: f64,
    /// Whether the node slid in the last round.
    pub(super) slides: bool,
}

impl<const D: usize> Wall<D> {
    /// A wall at a node, with which a step begins. It touches, and friction holds all.
    pub(super) fn new(
        (node, by): (usize, Holder),
        normal: [f64; D],
        way: [f64; D],
        (coefficient, separates): (f64, bool),
    ) -> Self {
        let friction =
            Friction { coefficient, spring: 0.0, force: [0.0; D], most: f64::INFINITY, slides: false };
        Self { node, by, normal, way, separates, state: State::Touches, along: [0.0; D], friction }
    }

    /// The state that a node with this displacement (m) and this force that the wall has to bear (N) should
    /// have, and by how much the present one is wrong, N; displacements up to `near` (m) and forces up to
    /// `slack` (N) count as none.
    pub(super) fn next(&self, way: &[f64; D], rest: &[f64; D], (near, slack): (f64, f64)) -> (State, f64) {
        if self.state == State::Away {
            let into = -dot(&self.off(way), &self.normal);
            return if into > near { (State::Touches, slack / near * into) } else { (State::Away, 0.0) };
        }
        match self.pressure(rest) {
            Some(pressure) if self.separates && pressure < -slack => (State::Away, -pressure),
            _ => (State::Touches, 0.0),
        }
    }

    /// Displacement of the node from the wall's, m.
    fn off(&self, way: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|a| way[a] - self.way[a])
    }

    /// Force with which the node presses on the wall, N; `None` where others hold it along the normal.
    fn pressure(&self, rest: &[f64; D]) -> Option<f64> {
        let share = dot(&self.normal, &self.along);
        (share > 0.0).then(|| -dot(rest, &self.along) / share)
    }

    /// Whether friction can act on the node.
    pub(super) fn rubs(&self) -> bool {
        self.state == State::Touches && self.friction.coefficient > 0.0 && self.along != [0.0; D]
    }

    /// Force of the spring if nothing slid (N), and its size.
    fn trial(&self, way: &[f64; D]) -> ([f64; D], f64) {
        let slip = without(&self.off(way), &self.normal);
        let own = &self.friction;
        let force: [f64; D] = std::array::from_fn(|a| (-own.spring).mul_add(slip[a], own.force[a]));
        (force, dot(&force, &force).sqrt())
    }

    /// Friction on the node, N.
    pub(super) fn shear(&self, way: &[f64; D]) -> [f64; D] {
        let (force, size) = self.trial(way);
        let most = self.friction.most;
        if size > most { force.map(|force| most / size * force) } else { force }
    }

    /// Change of the friction with the displacement of the node, with the sign turned, N/m. A symmetric
    /// matrix, as the greatest friction stays.
    pub(super) fn tangent(&self, way: &[f64; D]) -> [[f64; D]; D] {
        let (force, size) = self.trial(way);
        let own = &self.friction;
        let slides = size > own.most;
        let stiffness = if slides { own.most / size * own.spring } else { own.spring };
        let along = if slides { force.map(|force| force / size) } else { [0.0; D] };
        std::array::from_fn(|i| {
            let unit = axis::<D>(i);
            std::array::from_fn(|k| {
                stiffness * (unit[k] - self.normal[i] * self.normal[k] - along[i] * along[k])
            })
        })
    }

    /// Takes the present friction as that without slip, under the present pressure. Returns the slip (m) that
    /// a node which sticks has to take back.
    pub(super) fn settle(&mut self, way: &[f64; D], rest: &[f64; D]) -> [f64; D] {
        let Some(pressure) = self.pressure(rest).filter(|_| self.rubs()) else { return [0.0; D] };
        self.friction.most = self.friction.coefficient * pressure.max(0.0);
        self.friction.slides = self.trial(way).1 > self.friction.most;
        self.friction.force = self.shear(way);
        if self.friction.slides { [0.0; D] } else { without(&self.off(way), &self.normal) }
    }

    /// Begins to touch, without friction so far, or leaves.
    pub(super) fn change(&mut self, state: State) {
        self.state = state;
        (self.friction.force, self.friction.most) = ([0.0; D], 0.0);
    }
}

/// Unit vector along an axis.
pub(super) fn axis<const D: usize>(a: usize) -> [f64; D] {
    std::array::from_fn(|b| if a == b { 1.0 } else { 0.0 })
}

/// A vector without its part along a unit vector.
pub(super) fn without<const D: usize>(v: &[f64; D], along: &[f64; D]) -> [f64; D] {
    let part = dot(v, along);
    std::array::from_fn(|a| (-part).mul_add(along[a], v[a]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall below with friction 0.5 whose spring has 64 N/m and begins with 1 N.
    fn wall(most: f64) -> Wall<2> {
        let mut wall = Wall::new((0, Holder::Collider(0)), [0.0, 1.0], [0.0; 2], (0.5, true));
        wall.along = [0.0, 1.0];
        wall.friction = Friction { coefficient: 0.5, spring: 64.0, force: [1.0, 0.0], most, slides: false };
        wall
    }

    #[test]
    fn nodes_leave_and_come_back_as_they_should() {
        let next = |state: State, way: f64, rest: f64| {
            let mut wall = wall(1.0);
            wall.state = state;
            let (next, excess) = wall.next(&[0.0, way], &[0.0, rest], (1e-9, 1e-9));
            assert!(excess > 0.0 || next == state);
            next
        };
        assert_eq!(next(State::Touches, 0.0, -1.0), State::Touches);
        assert_eq!(next(State::Touches, 0.0, 1.0), State::Away);
        assert_eq!(next(State::Away, 0.1, 0.0), State::Away);
        assert_eq!(next(State::Away, -0.1, 0.0), State::Touches);
    }

    #[test]
    fn friction_sticks_below_its_bound_and_slides_at_it() {
        let wall = wall(2.0);
        assert_eq!(wall.shear(&[0.015625, 5.0]), [0.0, 0.0]);
        assert_eq!(wall.tangent(&[0.015625, 5.0]), [[64.0, 0.0], [0.0, 0.0]]);
        assert_eq!(wall.shear(&[0.125, 0.0]), [-2.0, 0.0]);
        assert_eq!(wall.tangent(&[0.125, 0.0]), [[0.0; 2]; 2]);
        // Under 10 N it bears 5 N; what has slid within that sticks where it is from now on.
        let mut pressed = wall;
        assert_eq!(pressed.settle(&[0.046875, 0.0], &[0.0, -10.0]), [0.046875, 0.0]);
        assert_eq!((pressed.friction.force, pressed.friction.most), ([-2.0, 0.0], 5.0));
    }
}
