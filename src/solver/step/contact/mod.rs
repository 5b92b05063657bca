//! Contact of particles with the colliders that act on particles.
//!
//! For each particle in reach of a surface an impulse J is sought that keeps it out over the step and obeys
//! Coulomb's law ([`crate::boundary::touching`]). It goes to the nodes as the affine momentum of the particle
//! does, with the weights `W_j = w_j (1 + (x_j - x) · D⁻¹ a)` of the point of contact x + a: they
//! add up to 1 and their mean is x + a, so that momentum and angular momentum are those of J at that point,
//! and the velocity `Σ W_j v_j` of that point, which the law asks for, is the adjoint. All impulses
//! together are the solution of a problem of complementarity (Moreau 1988, Jean 1999); here it is sought from
//! zero by a fixed number of Jacobi's sweeps, each scaled by the response to uniform pressure on all
//! particles at once, which is so exact after the first. For rings x is the centre of mass, about which
//! their weights are taken, and J the impulse on the whole ring.
//!
//! The particles in contact are copied into chunks of their own, which pass through bins, sums over ranks and
//! constrained nodes like all others: no bit depends on ranks.
//!
//! | file | what it holds |
//! |---|---|
//! | `find` | particles in reach of surfaces |
//! | `behind` | nodes behind surfaces |
//! | `sweeps` | from particles to nodes and back |
//! | `guard` | paths of particles that still reach a surface |
mod behind;
mod find;
pub(super) mod guard;
pub(super) mod sweeps;

use rayon::prelude::*;

use crate::boundary::Collider;
use crate::boundary::Touching;
use crate::boundary::motion::Rate;
use crate::exact_sum::ExactSum;
use crate::leapfrog::Lengths;
use crate::particle::Chunk;
use crate::solver::sorting::box_widths::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::grid::Grid;
use crate::solver::state::phases::Phase;
use crate::solver::step::colliders::Touch;

/// Sweeps in a step.
const SWEEPS: usize = 12;

/// The particles of a leaf that are in reach of surfaces: copies, one for each contact.
#[derive(Default)]
struct InContact<const D: usize> {
    particles: Chunk<D>,
    touching: Vec<Touching<D>>,
}

impl<const D: usize> Solver<D> {
    /// Whether any collider acts on particles.
    pub(super) fn has_contact_at_particles(&self) -> bool {
        self.physics.colliders.iter().any(Collider::acts_on_particles)
    }

    /// Collective. Gives the nodes of the velocity field numbered `field` the impulses that keep its
    /// particles out of the colliders that act on particles, with the conditions of other colliders and of
    /// faces. Adds the impulses of particles on the colliders.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan, on the rank that has it.
    pub(super) fn hold_particles(
        &mut self,
        field: usize,
        lengths: Lengths,
        rates: &[Rate<D>],
        sums: &mut [[ExactSum; SUMS]],
    ) -> Result<(), BinMissing> {
        let found = self.find_contacts(field, lengths, rates);
        let (mut chunks, mut touching): (Vec<_>, Vec<_>) =
            found.into_iter().map(|leaf| (leaf.particles, leaf.touching)).unzip();
        let is_any = chunks.iter().any(|chunk: &Chunk<D>| !chunk.is_empty());
        if !self.phases.time(Phase::Reduce, || self.comm.any(is_any)) {
            return Ok(());
        }
        let behind = self.nodes_behind(field);
        let Grid { plan, exchange, contact, .. } = &mut self.grid;
        contact.provide(plan);
        let widths = (&self.physics.widths(plan), self.physics.coordinates);
        let sorted = contact.sort((plan, &exchange.seam), &mut self.phases, &chunks, widths, None);
        let spreads = self.spreads_in_contact(&chunks);
        self.find_compliances(field, &mut chunks, &spreads, &mut touching);
        for _ in 0..SWEEPS {
            self.take_velocities(field);
            let velocities = self.velocities_in_contact(&chunks, &spreads, &touching);
            let impulses: Vec<Vec<[f64; D]>> =
                touching.par_iter_mut().zip(&velocities).map(correct).collect();
            self.scatter_impulses(&mut chunks, &spreads, &touching, |leaf, p| impulses[leaf][p]);
            self.add_impulses(field);
            self.hold_at_nodes(field, rates, sums);
            self.hold_behind(field, &behind, rates, sums);
            // Faces that absorb waves have had their share of the step.
            self.apply_faces(field, Lengths::NONE, true);
        }
        let (colliders, states) = (&self.physics.colliders, &self.contacts.states);
        for (chunk, touching) in chunks.iter().zip(&touching) {
            for (p, contact) in touching.iter().enumerate() {
                let x = chunk.position(p);
                let position = std::array::from_fn(|a| x[a] + contact.arm[a]);
                let impulse = contact.impulse.map(|j| -j);
                Touch { collider: contact.collider, position, impulse }.book(colliders, states, sums);
            }
        }
        sorted
    }
}

/// Corrects the impulses of a leaf for the velocities at the points of contact.
fn correct<const D: usize>((touching, velocities): (&mut Vec<Touching<D>>, &Vec<[f64; D]>)) -> Vec<[f64; D]> {
    touching.iter_mut().zip(velocities).map(|(contact, velocity)| contact.correct(velocity)).collect()
}
