//! Thrust of the water: its pressure on the surfaces of colliders and on faces of the domain.
//!
//! Forces of colliders and faces are those of the effective stress. Water with a given pressure p presses on
//! their wet surfaces as well, in the pores of the ground and beyond it: with their outward normal n by
//! `-∮ p n dA` on a collider, and by p times the area on a face. The surface of a collider is found once, as
//! pieces in cells of a lattice that does not depend on the tree, and moves with it.
use crate::boundary::Collider;
use crate::geometry::Aabb;
use crate::geometry::surface::{Patch, Region, patches};
use crate::kernel::Coordinates;
use crate::load::{Load, Water};
use crate::quantity::in_job;
use crate::solver::state::Solver;

/// Least number of cells of the lattice along the longest edge of a collider, and of points along an edge of
/// a face, in 2D and 3D.
const FINE: [f64; 2] = [256.0, 64.0];

/// Surfaces on which water may press.
#[derive(Clone, Debug)]
pub struct Thrust<const D: usize> {
    /// Pieces of the surface of each collider, in its place in the job.
    colliders: Vec<Vec<Patch<D>>>,
    /// Edges of the domain, m.
    extent: [f64; D],
    coordinates: Coordinates,
}

/// Water at a time.
struct Acting<'a, const D: usize> {
    load: &'a Load<D>,
    water: &'a Water,
    gravity: [f64; D],
    origin: [f64; D],
    time: f64,
}

impl<const D: usize> Acting<'_, D> {
    /// Pressure at a place in the domain, Pa.
    fn pressure(&self, x: &[f64; D]) -> f64 {
        self.water.pressure(in_job(&self.origin, x), self.time - self.load.start, &self.gravity)
    }
}

impl<const D: usize> Thrust<D> {
    /// Surfaces of colliders in a domain with these edges (m), made of roots of this edge, m.
    pub fn new(
        colliders: &[Collider<D>],
        extent: [f64; D],
        root_edge: f64,
        coordinates: Coordinates,
    ) -> Self {
        let pieces = colliders.iter().map(|collider| surface(collider, &extent, root_edge));
        Self { colliders: pieces.collect(), extent, coordinates }
    }

    /// Not collective. Force of the water on each collider, N; in plane strain per metre of thickness.
    pub fn on_colliders(&self, solver: &Solver<D>) -> Vec<[f64; D]> {
        let acting = acting(solver);
        let states = solver.physics.colliders.iter().zip(&solver.contacts.states);
        let each = states.zip(&self.colliders).map(|((collider, state), pieces)| {
            let mut force = [0.0; D];
            let Some(acting) = acting.as_ref().filter(|_| collider.is_present()) else { return force };
            for piece in pieces {
                let x = collider.to_space(&piece.centre, &state.pose);
                if (0..D).all(|a| (0.0..=self.extent[a]).contains(&x[a])) {
                    let area = collider.turned(&piece.area, &state.pose);
                    let pressure = acting.pressure(&x) * self.coordinates.around(x[0]);
                    (0..D).for_each(|a| force[a] -= pressure * area[a]);
                }
            }
            force
        });
        each.collect()
    }

    /// Not collective. Force of the water on each face of the domain along its axis, N: the lower and the
    /// upper one of each axis, where no collider stands; in plane strain per metre of thickness.
    pub fn on_faces(&self, solver: &Solver<D>) -> Vec<f64> {
        let Some(acting) = acting(solver) else { return vec![0.0; 2 * D] };
        let present = solver.physics.colliders.iter().zip(&solver.contacts.states);
        let present: Vec<_> = present.filter(|(collider, _)| collider.is_present()).collect();
        let points = FINE[D - 2] as usize;
        let mut forces = Vec::new();
        for axis in 0..D {
            let along: Vec<usize> = (0..D).filter(|&a| a != axis).collect();
            let area = along.iter().fold(1.0, |area, &a| area * self.extent[a] / points as f64);
            for (side, sign) in [(0.0, -1.0), (self.extent[axis], 1.0)] {
                let mut sum = 0.0;
                for number in 0..points.pow(along.len() as u32) {
                    let mut x = [side; D];
                    let mut rest = number;
                    for &a in &along {
                        x[a] = ((rest % points) as f64 + 0.5) / points as f64 * self.extent[a];
                        rest /= points;
                    }
                    let is_bare = present.iter().all(|(c, state)| c.distance(&x, &state.pose) > 0.0);
                    let around = self.coordinates.around(x[0]);
                    sum += if is_bare { acting.pressure(&x) * around } else { 0.0 };
                }
                forces.push(sign * sum * area);
            }
        }
        forces
    }
}

/// The water of the present stage, if its pressure is given.
fn acting<const D: usize>(solver: &Solver<D>) -> Option<Acting<'_, D>> {
    let (physics, time) = (&solver.physics, solver.clock.time);
    let (load, water) = physics.water_at(time).filter(|(_, water)| water.quantity().is_some())?;
    Some(Acting { load, water, gravity: physics.gravity.at(time), origin: physics.origin, time })
}

/// Pieces of the surface of a collider; none of one that deforms.
fn surface<const D: usize>(collider: &Collider<D>, extent: &[f64; D], root_edge: f64) -> Vec<Patch<D>> {
    let shape = &collider.shape;
    let domain = Aabb::new([0.0; D], *extent);
    // Colliders that move may bring their surface in from outside.
    let reach = if collider.motion == crate::boundary::motion::Motion::Fixed {
        domain
    } else {
        domain.grown(extent.iter().fold(0.0, |longest, &edge| edge.max(longest)))
    };
    let bounds = shape.bounds().intersection(&reach);
    if collider.deforming.is_some() || bounds.is_empty() {
        return Vec::new();
    }
    let longest = (0..D).map(|a| bounds.upper[a] - bounds.lower[a]).fold(0.0, f64::max);
    let mut edge = root_edge;
    while edge * FINE[D - 2] > longest {
        edge *= 0.5;
    }
    let region = Region {
        inside: &|x| shape.contains(x),
        free: &|_| true,
        counts: &|_| true,
        project: &|x| {
            let (distance, normal) = (shape.distance(x), shape.gradient(x));
            std::array::from_fn(|a| distance.mul_add(-normal[a], x[a]))
        },
        normal: &|x| shape.gradient(x),
    };
    let first: [i64; D] = std::array::from_fn(|a| (bounds.lower[a] / edge).floor() as i64);
    let number: [i64; D] =
        std::array::from_fn(|a| ((bounds.upper[a] / edge).ceil() as i64 - first[a]).max(1));
    let mut found = Vec::new();
    for cell in 0..number.iter().product::<i64>() {
        let mut rest = cell;
        let lower = std::array::from_fn(|a| {
            let index = first[a] + rest % number[a];
            rest /= number[a];
            index as f64 * edge
        });
        let cell = Aabb::new(lower, lower.map(|c| c + edge));
        if shape.distance(&cell.centre()).abs() <= 1.001 * cell.half_diagonal() {
            found.extend(patches(&region, &cell));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::motion::Motion;
    use crate::boundary::{ActsOn, Contact};
    use crate::geometry::Shape;

    fn pieces<const D: usize>(shape: Shape<D>) -> Vec<Patch<D>> {
        let collider = Collider {
            name: "wall".into(),
            shape,
            deforming: None,
            reference: [0.0; D],
            axis: [0.0, 0.0, 1.0],
            contact: Contact::Sticky,
            acts_on: ActsOn::Nodes,
            motion: Motion::Fixed,
            start: 0.0,
        };
        surface(&collider, &[8.0; D], 4.0)
    }

    /// `∮ x_a n_b dA` is the volume where a = b, and 0 elsewhere; boxes of any place, balls, and a wall that
    /// leaves the domain, whose part beyond does not count.
    #[test]
    fn pieces_close_about_their_volume() {
        let moment = |pieces: &[Patch<3>], a: usize, b: usize| {
            pieces.iter().map(|piece| piece.centre[a] * piece.area[b]).sum::<f64>()
        };
        let block = pieces(Shape::Box(Aabb::new([1.03, 2.0, 3.1], [2.0, 3.17, 5.0])));
        let ball = pieces(Shape::Sphere { centre: [4.0, 4.1, 4.2], radius: 1.5 });
        for (pieces, volume) in [(block, 0.97 * 1.17 * 1.9), (ball, 14.137_166_941_154_069)] {
            for (a, b) in [(0, 0), (1, 1), (2, 2), (0, 1), (2, 0)] {
                let expected = if a == b { volume } else { 0.0 };
                let found = moment(&pieces, a, b);
                assert!((found - expected).abs() < 2e-3 * volume, "{a} {b}: {found} for {expected}");
            }
        }
        let wall: Vec<Patch<2>> = pieces(Shape::Box(Aabb::new([2.0, -3.0], [2.5, 6.0])));
        let side: f64 = wall.iter().map(|piece| piece.area[0].max(0.0)).sum();
        assert!((side - 6.0).abs() < 1e-9, "{side}");
        let ends: f64 = wall.iter().map(|piece| piece.area[1]).sum();
        assert!((ends - 0.5).abs() < 1e-9, "{ends}");
    }
}
