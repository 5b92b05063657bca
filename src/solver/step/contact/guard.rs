//! Paths of particles that still reach a surface.
//!
//! The impulses on nodes keep particles out as far as a few sweeps can. The rest is small, but a surface of
//! no thickness must never let a particle pass. So the path of each particle near a surface is followed, and
//! one that reaches it ends there; the rest of the path goes along the surface, and the law of the surface
//! applies to the velocity of the particle. The momentum that this takes is an impulse on the collider.
use crate::boundary::motion::{Pose, Rate};
use crate::boundary::{Collider, ColliderState, meets};
use crate::exact_sum::ExactSum;
use crate::particle::chunk::{Chunk, Layout};
use crate::solver::state::Solver;
use crate::solver::state::bookings::{Near, SUMS};
use crate::solver::step::colliders::Touch;

/// Distance from a surface at which a path ends, as a share of the half width of a particle.
const CLOSE: f64 = 0.01;

/// The colliders over one step.
pub(in crate::solver) struct Guard<'a, const D: usize> {
    colliders: &'a [Collider<D>],
    states: &'a [ColliderState<D>],
    rates: &'a [Rate<D>],
    /// Poses after the step.
    next: Vec<Pose<D>>,
    /// Size of the domain, m.
    extent: [f64; D],
}

impl<'a, const D: usize> Guard<'a, D> {
    /// Over a step to the time `to` (s) of length `dt`, in a domain of this size (m); `None` without
    /// colliders that act on particles.
    pub(in crate::solver) fn new(
        colliders: &'a [Collider<D>],
        states: &'a [ColliderState<D>],
        rates: &'a [Rate<D>],
        [to, dt]: [f64; 2],
        extent: [f64; D],
    ) -> Option<Self> {
        let next = colliders.iter().zip(states).zip(rates);
        let next = next.map(|((collider, state), rate)| collider.next_pose(state, rate, [to, dt]));
        let is_any = colliders.iter().any(Collider::acts_on_particles);
        is_any.then(|| Self { colliders, states, rates, next: next.collect(), extent })
    }

    /// Stops the particles of a leaf that have moved through a surface, and records their impulses. Returns
    /// those stopped, ascending.
    pub(in crate::solver) fn hold(&self, chunk: &mut Chunk<D>, near: &mut [Near<D>]) -> Vec<u32> {
        let mut held = Vec::new();
        for near in near {
            let (p, c) = (near.particle as usize, near.collider as usize);
            let (collider, pose) = (&self.colliders[c], &self.next[c]);
            let to = chunk.position(p);
            let from = collider.to_own(&near.place, &self.states[c].pose);
            let close = CLOSE * chunk.column(Layout::<D>::HALF)[p];
            let mut place = collider.to_own(&to, pose);
            let Some(met) = meets(collider, &from, &place, close) else { continue };
            // The rest of the path, along the surface.
            let rest: [f64; D] = std::array::from_fn(|a| place[a] - met.place[a]);
            let inward = (0..D).fold(0.0, |sum, a| rest[a].mul_add(met.normal[a], sum)).min(0.0);
            place = std::array::from_fn(|a| (-inward).mul_add(met.normal[a], met.place[a] + rest[a]));
            if let Some(again) = meets(collider, &met.place, &place, close) {
                place = again.place;
            }
            // The rest of the path ends at a face of the domain that the particle's own path has not reached.
            // It is shortened: a place moved along an axis could be on the other side of an inclined sheet.
            let (start, mut at) = (collider.to_space(&met.place, pose), collider.to_space(&place, pose));
            let edge = 1e-6 * close;
            let bounds: [_; D] =
                std::array::from_fn(|a| (edge.min(to[a]), (self.extent[a] - edge).max(to[a])));
            let inside: [f64; D] = std::array::from_fn(|a| at[a].max(bounds[a].0).min(bounds[a].1));
            if inside != at {
                let share = (0..D).filter(|&a| inside[a] != at[a]).fold(1.0_f64, |share, a| {
                    share.min(((inside[a] - start[a]) / (at[a] - start[a])).max(0.0))
                });
                at = std::array::from_fn(|a| {
                    let place = share.mul_add(at[a] - start[a], start[a]);
                    place.max(bounds[a].0).min(bounds[a].1)
                });
            }
            chunk.write(Layout::<D>::POSITION, p, &at);
            let (normal, surface) =
                (collider.turned(&met.normal, pose), collider.velocity_at(&at, pose, &self.rates[c]));
            let before: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
            let mut relative: [f64; D] = std::array::from_fn(|a| before[a] - surface[a]);
            collider.contact.apply(&mut relative, &normal);
            let after: [f64; D] = std::array::from_fn(|a| surface[a] + relative[a]);
            chunk.write(Layout::<D>::VELOCITY, p, &after);
            let mass = chunk.column(Layout::<D>::MASS)[p];
            (near.place, near.impulse) = (at, std::array::from_fn(|a| mass * (before[a] - after[a])));
            held.push(near.particle);
        }
        held.sort_unstable();
        held.dedup();
        held
    }
}

impl<const D: usize> Solver<D> {
    /// Not collective. Adds the impulses of particles on the colliders whose surface they reached.
    pub(in crate::solver) fn book_met(&self, sums: &mut [[ExactSum; SUMS]]) {
        for near in self.particle_forces.near.iter().flatten().filter(|near| near.impulse != [0.0; D]) {
            let touch =
                Touch { collider: near.collider as usize, position: near.place, impulse: near.impulse };
            touch.book(&self.physics.colliders, &self.contacts.states, sums);
        }
    }
}
