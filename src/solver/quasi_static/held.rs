//! Supports of a node in a load step: faces, grips and colliders along axes, and walls along which it slides
//! or which it may leave.
use crate::solver::state::inside::dot;

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
    Slides,
    /// It holds the node in all directions.
    Sticks,
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
    /// Coefficient of friction.
    pub(super) friction: f64,
    /// Whether the node may leave.
    pub(super) separates: bool,
    pub(super) state: State,
    /// The direction that it alone holds: its normal without what else holds the node; 0 where that is all.
    pub(super) along: [f64; D],
    /// Friction on a node that slides, N.
    pub(super) push: [f64; D],
}

impl<const D: usize> Wall<D> {
    /// A wall at a node, with which a step begins.
    pub(super) fn new(
        (node, by): (usize, Holder),
        normal: [f64; D],
        way: [f64; D],
        (friction, separates): (f64, bool),
    ) -> Self {
        let state = if friction > 0.0 { State::Sticks } else { State::Slides };
        Self { node, by, normal, way, friction, separates, state, along: [0.0; D], push: [0.0; D] }
    }

    /// The state that a node with this displacement (m) and this force that the wall has to bear (N) should
    /// have; displacements up to `near` (m) and forces up to `slack` (N) count as none. `free` takes out of a
    /// vector the directions that other supports hold. A node goes from sticking to leaving and back over
    /// sliding: what sticks may pull though what slides presses.
    pub(super) fn next(
        &self,
        way: &[f64; D],
        rest: &[f64; D],
        (near, slack): (f64, f64),
        free: impl Fn([f64; D]) -> [f64; D],
    ) -> Next<D> {
        let off: [f64; D] = std::array::from_fn(|a| way[a] - self.way[a]);
        let stays = Next { state: self.state, push: self.push, excess: 0.0 };
        let slides = |push: [f64; D], excess: f64| Next { state: State::Slides, push, excess };
        if self.state == State::Away {
            let into = -dot(&off, &self.normal);
            return if into > near { slides([0.0; D], slack / near * into) } else { stays };
        }
        let share = dot(&self.normal, &self.along);
        if share <= 0.0 {
            return stays;
        }
        let pressure = -dot(rest, &self.along) / share;
        let is_pulled = self.separates && pressure < -slack;
        let most = self.friction * pressure.max(0.0);
        let tangential = |v: [f64; D]| without(&free(v), &self.along);
        let size_of = |v: &[f64; D]| dot(v, v).sqrt();
        match self.state {
            State::Sticks => {
                let needed = tangential(rest.map(|force| -force));
                let size = size_of(&needed);
                let push = if size > 0.0 { needed.map(|force| most / size * force) } else { needed };
                let is_held = !is_pulled && size <= most + slack;
                if is_held { stays } else { slides(push, (size - most).max(-pressure)) }
            }
            _ if is_pulled => Next { state: State::Away, push: [0.0; D], excess: -pressure },
            _ if self.friction > 0.0 => {
                let slip = tangential(off);
                let (size, bears) = (size_of(&slip), size_of(&self.push));
                let along = dot(&slip, &self.push);
                if size > near && along > 0.0 {
                    return Next {
                        state: State::Sticks,
                        push: [0.0; D],
                        excess: slack / near * along / bears,
                    };
                }
                let push = if size > near {
                    slip.map(|slip| -most / size * slip)
                } else if bears > 0.0 {
                    self.push.map(|force| most / bears * force)
                } else {
                    self.push
                };
                Next { push, ..stays }
            }
            _ => stays,
        }
    }
}

/// The state that a node should have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Next<const D: usize> {
    pub(super) state: State,
    /// Friction, N.
    pub(super) push: [f64; D],
    /// Force by which the present state is wrong, N.
    pub(super) excess: f64,
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

    const WALL: Holder = Holder::Collider(0);

    /// State and friction of a node at a wall below with this displacement that bears this force.
    fn next(state: State, way: [f64; 2], rest: [f64; 2]) -> (State, [f64; 2]) {
        let mut wall = Wall::new((0, WALL), [0.0, 1.0], [0.0; 2], (0.5, true));
        (wall.state, wall.along, wall.push) = (state, [0.0, 1.0], [1.0, 0.0]);
        let next = wall.next(&way, &rest, (1e-9, 1e-9), |v| v);
        assert!(next.excess > 0.0 || next.state == state, "{next:?}");
        (next.state, next.push)
    }

    #[test]
    fn nodes_leave_stick_and_slide_as_they_should() {
        assert_eq!(next(State::Sticks, [0.0; 2], [4.9, -10.0]).0, State::Sticks);
        assert_eq!(next(State::Sticks, [0.0; 2], [8.0, -10.0]), (State::Slides, [-5.0, 0.0]));
        // Against its slip, under the present force; it sticks where friction would drive it.
        assert_eq!(next(State::Slides, [-0.1, 0.0], [0.0, -4.0]), (State::Slides, [2.0, 0.0]));
        assert_eq!(next(State::Slides, [0.1, 0.0], [0.0, -4.0]).0, State::Sticks);
        // What is pulled slides before it leaves.
        assert_eq!(next(State::Sticks, [0.0; 2], [0.0, 1.0]).0, State::Slides);
        assert_eq!(next(State::Slides, [0.0; 2], [0.0, 1.0]).0, State::Away);
        assert_eq!(next(State::Away, [0.0, 0.1], [0.0; 2]).0, State::Away);
        assert_eq!(next(State::Away, [0.0, -0.1], [0.0; 2]), (State::Slides, [0.0; 2]));
    }
}
