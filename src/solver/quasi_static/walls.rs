//! Walls along which material slides, or which it may leave: what they hold of the nodes.
//!
//! A wall holds a node on it or inside it along its normal n, `n·u = n·s`, with its own displacement s. One
//! that separates does so only while it presses. Which of these is so is found as the iteration goes on (an
//! active set): each step begins with all nodes held; a node that is pulled leaves, one that comes too near
//! is held again. After some rounds only nodes that are most wrong change, lest they go in circles.
//!
//! Friction is the force of a stiff spring along the wall, of at most μ N (Coulomb), with its tangent in
//! Newton's matrix. In each round it begins anew from the force that it has, under the normal force N of the
//! round before, so the slip of what sticks goes to 0 (augmented Lagrangian; Simo and Laursen 1992) and
//! the stiffness stays symmetric.
//!
//! Conditions that are not along axes are kept as unit vectors at right angles to each other, and taken out
//! of displacements and forces by projection.
use partition::comm::Comm;

use super::held::{Along, Held, Holder, State, Wall, axis, without};
use super::unknowns::{Nodal, Unknowns};
use crate::solver::state::grid::inside::dot;

/// Displacement, in cells, below which a node is where it should be.
const SAME: f64 = 1e-9;
/// Part of a unit vector beside those that hold a node already from which it is another condition.
const OTHER: f64 = 0.05;

/// Stiffness of the springs of friction over that of their nodes. In each round the slip of what sticks falls
/// by about this; much stiffer springs let Newton's method go in circles between nodes that stick and slide.
const SPRING: f64 = 10.0;

/// Tangents of friction by node, N/m.
pub(super) type Springs<const D: usize> = Vec<(usize, [[f64; D]; D])>;

/// Conditions of a node, at right angles to each other.
struct Frame<const D: usize> {
    along: Vec<Along<D>>,
}

impl<const D: usize> Frame<D> {
    fn of(held: &[Option<Held>; D]) -> Self {
        let along = (0..D).filter_map(|a| held[a].map(|held| (axis(a), held)));
        Self { along: along.collect() }
    }

    /// Adds a displacement `way · direction` by a wall. Returns the part of the direction that nothing held
    /// before, as a unit vector; none if that is next to nothing.
    fn add(&mut self, direction: &[f64; D], way: &[f64; D], by: Holder) -> Option<[f64; D]> {
        let (mut rest, mut value) = (*direction, dot(direction, way));
        for (known, held) in &self.along {
            let part = dot(&rest, known);
            value = (-part).mul_add(held.way, value);
            rest = without(&rest, known);
        }
        let size = dot(&rest, &rest).sqrt();
        if size < OTHER {
            return None;
        }
        let (mut rest, mut value) = (rest.map(|x| x / size), value / size);
        let mut found = rest;
        if let Some(a) = (0..D).find(|&a| rest[a].abs() > 1.0 - SAME) {
            let sign = rest[a].signum();
            (rest, value) = (axis(a), sign * value);
            found = rest.map(|x| sign * x);
        }
        self.along.push((rest, Held { by, way: value }));
        Some(found)
    }

    /// Conditions along axes, and the others; those along axes in `fixed` stay as they are.
    fn split(self, fixed: &[Option<Held>; D]) -> ([Option<Held>; D], Vec<Along<D>>) {
        let mut held = *fixed;
        if self.along.len() == D {
            let all = |a: usize| self.along.iter().fold(0.0, |sum, (e, own)| e[a].mul_add(own.way, sum));
            let by = self.along.last().map(|(_, held)| held.by);
            for a in 0..D {
                held[a] = held[a].or(by.map(|by| Held { by, way: all(a) }));
            }
            return (held, Vec::new());
        }
        let mut turned = Vec::new();
        for (along, own) in self.along {
            match (0..D).find(|&a| along[a] == 1.0) {
                Some(a) => held[a] = held[a].or(Some(own)),
                None => turned.push((along, own)),
            }
        }
        (held, turned)
    }
}

impl<const D: usize> Unknowns<D> {
    /// Holds nodes as the states of the walls say.
    pub(super) fn hold_at_walls(&mut self) {
        self.held.clone_from(&self.fixed);
        self.turned.clear();
        for walls in self.walls.chunk_by_mut(|a, b| a.node == b.node) {
            let node = walls[0].node;
            let mut frame = Frame::of(&self.fixed[node]);
            for wall in walls {
                wall.along = [0.0; D];
                if wall.state == State::Away {
                    continue;
                }
                wall.along = frame.add(&wall.normal, &wall.way, wall.by).unwrap_or([0.0; D]);
            }
            let (held, turned) = frame.split(&self.fixed[node]);
            self.held[node] = held;
            if !turned.is_empty() {
                self.turned.push((node, turned));
            }
        }
    }

    /// Collective, with one reduction. Finds the states of the walls, and friction, from displacements (m),
    /// the forces that are left (N) and the stiffness of the nodes, N/m; forces up to `slack` (N) count as
    /// none. States change where they are most wrong: down to a `share` of the greatest excess. Returns
    /// whether any is another on this rank.
    pub(super) fn settle_walls(
        &mut self,
        comm: &Comm,
        (way, rest): (&mut Nodal<D>, &Nodal<D>),
        stiffness: &[f64],
        (slack, share): (f64, f64),
    ) -> bool {
        let next = |wall: &Wall<D>| {
            let node = wall.node;
            let least = SAME * self.cells[node];
            let near = if stiffness[node] > 0.0 { (slack / stiffness[node]).max(least) } else { least };
            wall.next(&way[node], &rest[node], (near, slack))
        };
        let all: Vec<(State, f64)> = self.walls.iter().map(next).collect();
        let most = comm.max_f64(all.iter().map(|(_, excess)| *excess).fold(0.0, f64::max));
        let (mut is_other, mut back) = (false, Vec::new());
        for (wall, (state, excess)) in self.walls.iter_mut().zip(all) {
            if wall.state == state {
                let slip = wall.settle(&way[wall.node], &rest[wall.node]);
                back.push((wall.node, slip));
            } else if excess >= share * most {
                wall.change(state);
                is_other = true;
            }
        }
        for (node, slip) in back {
            let held = self.along_turned(node, &slip);
            for a in (0..D).filter(|&a| self.held[node][a].is_none()) {
                way[node][a] -= slip[a] - held[a];
            }
        }
        is_other
    }

    /// Gives friction its springs, from the stiffness of the nodes, N/m; that of a tied node is its corners'.
    pub(super) fn set_springs(&mut self, stiffness: &[f64]) {
        let mut own = stiffness.to_vec();
        for (node, corners) in self.ties() {
            own[*node] = corners.iter().map(|(corner, _)| stiffness[*corner]).fold(0.0, f64::max);
        }
        for wall in &mut self.walls {
            wall.friction.spring = SPRING * own[wall.node];
        }
    }

    /// Adds friction at these displacements (m) to forces, N.
    pub(super) fn add_friction(&self, way: &Nodal<D>, forces: &mut Nodal<D>) {
        for wall in self.walls.iter().filter(|wall| wall.rubs()) {
            let shear = wall.shear(&way[wall.node]);
            (0..D).for_each(|a| forces[wall.node][a] += shear[a]);
        }
    }

    /// Its tangents at these displacements (m) by node, N/m.
    pub(super) fn springs(&self, way: &Nodal<D>) -> Springs<D> {
        let rub = self.walls.iter().filter(|wall| wall.rubs());
        rub.map(|wall| (wall.node, wall.tangent(&way[wall.node]))).collect()
    }

    /// Whether any node of this rank slides against friction, and whether friction holds any.
    pub(super) fn slides(&self) -> [bool; 2] {
        [true, false]
            .map(|slides| self.walls.iter().any(|wall| wall.rubs() && wall.friction.slides == slides))
    }

    /// Way to the prescribed displacements; 0 for directions that are free.
    pub(super) fn way_to_held(&self, way: &Nodal<D>) -> Nodal<D> {
        let along = |(way, held): (&[f64; D], &[Option<Held>; D])| {
            std::array::from_fn(|a| held[a].map_or(0.0, |held| held.way - way[a]))
        };
        let mut left: Nodal<D> = way.iter().zip(&self.held).map(along).collect();
        for (node, turned) in &self.turned {
            for (along, held) in turned {
                let off = held.way - dot(along, &way[*node]);
                (0..D).for_each(|a| left[*node][a] = off.mul_add(along[a], left[*node][a]));
            }
        }
        left
    }

    /// Whether any node of this rank is not where it is held.
    pub(super) fn is_off(&self, way: &Nodal<D>) -> bool {
        let left = self.way_to_held(way);
        left.iter().zip(&self.cells).any(|(left, cell)| left.iter().any(|left| left.abs() > SAME * cell))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: Holder = Holder::Collider(0);

    /// Whatever else holds a node, it moves with the wall along its normal.
    #[test]
    fn conditions_along_all_directions_hold_at_once() {
        let fixed = [None, Some(Held { by: Holder::Face(2), way: 0.25 }), None];
        let walls = [([0.6, 0.0, 0.8], [1.0, 2.0, 3.0]), ([0.0, 0.6, -0.8], [-1.0, 0.5, 0.0])];
        let mut frame = Frame::of(&fixed);
        assert!(walls.iter().all(|(normal, way)| frame.add(normal, way, WALL).is_some()));
        let (held, turned) = frame.split(&fixed);
        assert!(turned.is_empty());
        let way = held.map(|held| held.map_or(f64::NAN, |held| held.way));
        assert_eq!(way[1], 0.25);
        for (normal, of_wall) in walls {
            assert!((dot(&normal, &way) - dot(&normal, &of_wall)).abs() < 1e-14, "{way:?}");
        }
    }

    #[test]
    fn a_normal_that_a_face_holds_already_adds_nothing() {
        let fixed = [Some(Held { by: Holder::Face(0), way: 0.0 }), None];
        assert!(Frame::of(&fixed).add(&[-1.0, 0.0], &[1.0, 1.0], WALL).is_none());
        let mut frame = Frame::of(&fixed);
        assert_eq!(frame.add(&[0.6, -0.8], &[0.0, 1.0], WALL), Some([0.0, -1.0]));
        let (held, turned) = frame.split(&fixed);
        // Along 0.6 x - 0.8 y the wall moves by -0.8, and x is fixed.
        assert!(turned.is_empty() && held[1].is_some_and(|held| (held.way - 1.0).abs() < 1e-14), "{held:?}");
    }
}
