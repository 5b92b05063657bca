//! Ways of particles that would lead through a face of the domain.
//!
//! Sums at nodes say how far the material over a face is, all of it together: a particle ahead of the others
//! may be let through. So the way of a particle ends at the face, and the law of the face holds for its
//! velocity. What this takes is booked as an impulse on the face.
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::solver::physics::Physics;
use crate::solver::state::Solver;
use crate::solver::state::bookings::Struck;

/// Distance from a face at which a way ends, as a share of the half width of a particle.
const CLOSE: f64 = 0.01;

/// The same for a particle that was closer already: so much of that distance keeps it in the domain.
const LEAST: f64 = 1e-6;

/// Faces of the domain that hold material back.
#[derive(Clone, Copy)]
pub(in crate::solver) struct Barrier<'a, const D: usize> {
    physics: &'a Physics<D>,
    /// Size of the domain, m.
    extent: [f64; D],
}

impl<'a, const D: usize> Barrier<'a, D> {
    /// Of a domain of this size, m.
    pub(in crate::solver) fn new(physics: &'a Physics<D>, extent: [f64; D]) -> Self {
        Self { physics, extent }
    }

    /// Whether it holds a particle with this tag. If its material does not move over gaps, no sum lets it
    /// through.
    fn holds(&self, tag: u64) -> bool {
        let body = usize::from(Tag::unpack(tag).body);
        let field = self.physics.body_contacts.field_of_body.get(body).map_or(0, |&field| field.into());
        self.physics.moves_over_gaps(field)
    }

    /// Faces that particles in a box (m) may come to in a step, as axis and side.
    fn beside(&self, (lower, upper): &([f64; D], [f64; D])) -> impl Iterator<Item = (usize, usize)> {
        let is_beside = |&(axis, side): &(usize, usize)| {
            let touches = if side == 0 { lower[axis] <= 0.0 } else { upper[axis] >= self.extent[axis] };
            touches && self.physics.faces[axis][side].has_gap()
        };
        let is_any =
            (0..self.physics.body_contacts.fields()).any(|field| self.physics.moves_over_gaps(field));
        (0..2 * D).filter(move |_| is_any).map(|face| (face / 2, face % 2)).filter(is_beside)
    }

    /// Whether there are any.
    pub(in crate::solver) fn is_beside(&self, leaf: &([f64; D], [f64; D])) -> bool {
        self.beside(leaf).next().is_some()
    }

    /// Holds back the particles of a leaf with this box (m) that have moved from `start` through a face;
    /// notes what they gave. Returns those held back, ascending.
    pub(in crate::solver) fn hold(
        &self,
        chunk: &mut Chunk<D>,
        leaf: &([f64; D], [f64; D]),
        start: &[[f64; D]],
        struck: &mut Vec<Struck<D>>,
    ) -> Vec<u32> {
        let mut held = Vec::new();
        for (axis, side) in self.beside(leaf) {
            let extent = self.extent[axis];
            let above = |x: f64| if side == 0 { x } else { extent - x };
            let law = self.physics.faces[axis][side];
            let normal: [f64; D] = std::array::from_fn(|a| match a == axis {
                true => [1.0, -1.0][side],
                false => 0.0,
            });
            for (p, start) in start.iter().enumerate() {
                let mut x = chunk.position(p);
                let half = chunk.column(Layout::<D>::HALF)[p];
                let close = CLOSE * self.physics.coordinates.half_width(half, start[0]);
                let least = close.min(above(start[axis]).max(LEAST * close));
                // One that was outside already, or is not a number, is for others to find.
                let has_passed = above(x[axis]) < least && above(start[axis]) >= 0.0;
                if !has_passed || !self.holds(chunk.tags()[p]) {
                    continue;
                }
                x[axis] = above(least);
                chunk.write(Layout::<D>::POSITION, p, &x);
                let before: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
                let mut after = before;
                law.apply(&mut after, &normal);
                chunk.write(Layout::<D>::VELOCITY, p, &after);
                let mass = chunk.column(Layout::<D>::MASS)[p];
                let impulse = std::array::from_fn(|a| mass * (before[a] - after[a]));
                struck.push(Struck { face: 2 * axis + side, impulse });
                held.push(p as u32);
            }
        }
        held.sort_unstable();
        held.dedup();
        held
    }
}

impl<const D: usize> Solver<D> {
    /// Not collective. Adds what particles gave to the faces that they met.
    pub(in crate::solver) fn book_struck(&mut self) {
        let sums = &mut self.sums.faces.of;
        for Struck { face, impulse } in self.leaf_data.struck.iter().flatten() {
            let sums = sums.get_mut(*face).into_iter().flatten();
            sums.zip(impulse).for_each(|(sum, value)| sum.add(*value));
        }
    }
}
