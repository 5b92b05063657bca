//! Particles in reach of surfaces.
use rayon::prelude::*;

use super::InContact;
use crate::boundary::Touching;
use crate::boundary::motion::Rate;
use crate::geometry::Aabb;
use crate::grid::leaf_geometry::leaf_box;
use crate::kernel::{Select, domain};
use crate::leapfrog::Lengths;
use crate::particle::chunk::{Chunk, Layout};
use crate::particle::volume::volume;
use crate::solver::sorting::box_widths::BoxWidths;
use crate::solver::state::Solver;
use crate::solver::state::bookings::Near;
use crate::solver::state::phases::Phase;

/// Gap up to which particles at rest are in contact, as a share of the distance at which they touch.
const REACH: f64 = 0.25;

/// Look-ahead distance of a particle over its displacement in a step.
const AHEAD: f64 = 2.0;

impl<const D: usize> Solver<D> {
    /// Not collective. The particles of each own leaf in reach of the colliders that act on particles that
    /// move with the velocity field numbered `field`, and in `near` those of all fields so far that may reach
    /// one in this step.
    pub(super) fn find_contacts(
        &mut self,
        field: usize,
        lengths: Lengths,
        rates: &[Rate<D>],
    ) -> Vec<InContact<D>> {
        let colliders: Vec<_> =
            self.physics.colliders.iter().enumerate().zip(&self.contacts.states).zip(rates).collect();
        let scheme = self.physics.scheme();
        let group = self.physics.group(field);
        let widths = self.physics.widths(&self.grid.plan);
        let (plan, extent) = (&self.grid.plan, self.grid.plan.extent());
        self.particle_forces.near.resize_with(self.chunks.len(), Vec::new);
        let leaves =
            self.chunks.par_iter().zip(self.forest.leaves()).zip(&mut self.particle_forces.near).enumerate();
        self.phases.time(Phase::Nodes, || {
            let found = leaves.with_min_len(16).map(|(leaf, ((chunk, octant), near))| {
                if field == 0 {
                    near.clear();
                }
                let mut found = InContact::default();
                if chunk.is_empty() {
                    return found;
                }
                let (lower, upper) = leaf_box(octant, plan.root_edge);
                let aabb = Aabb::new(lower, upper);
                // No particle moves further in a step than a cell.
                let way = plan.finest_cell(leaf);
                let farthest = widths.bound(chunk) + way;
                for &(((number, collider), state), rate) in &colliders {
                    if !collider.acts_on_particles()
                        || collider.distance_to_box(&aabb, &state.pose) > farthest
                    {
                        continue;
                    }
                    let close: Vec<u32> = (0..chunk.len() as u32)
                        .filter(|&p| {
                            if group.is_some_and(|group| !group.has(chunk.tags()[p as usize])) {
                                return false;
                            }
                            let distance = collider.distance(&chunk.position(p as usize), &state.pose);
                            if distance <= way && distance >= 0.0 {
                                near.push(Near::new(number, p, chunk.position(p as usize)));
                            }
                            distance <= farthest
                        })
                        .collect();
                    let mut half = Vec::new();
                    domain::full_half_widths(
                        chunk,
                        Select::List(&close),
                        plan.cell(octant.level),
                        &extent,
                        &scheme,
                        &mut half,
                    );
                    for (&p, half) in close.iter().zip(&half) {
                        let x = chunk.position(p as usize);
                        let v: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p as usize);
                        let reach = |normal: &[f64; D], surface: &[f64; D], touching: f64| {
                            let inward =
                                (0..D).fold(0.0, |sum, a| (surface[a] - v[a]).mul_add(normal[a], sum));
                            (AHEAD * lengths.drift).mul_add(inward.max(0.0), REACH * touching)
                        };
                        let density = match collider.contact.drag() > 0.0 {
                            true => chunk.column(Layout::<D>::MASS)[p as usize] / volume(chunk, p as usize),
                            false => 0.0,
                        };
                        let of_box = (half, density);
                        if let Some(contact) =
                            Touching::new(number, collider, (&state.pose, rate), &x, of_box, lengths, reach)
                        {
                            let to_mass = scheme.coordinates.to_mass_centre(half[0], x[0]);
                            let around = scheme.coordinates.around(x[0] + contact.arm[0]);
                            let contact = contact.around(around, to_mass);
                            found.push(chunk, p as usize, contact);
                        }
                    }
                }
                found
            });
            found.collect()
        })
    }
}

impl<const D: usize> InContact<D> {
    /// Adds a contact of a particle of a chunk: a copy that has only an impulse, with a mass of 1 kg and no
    /// stress.
    fn push(&mut self, chunk: &Chunk<D>, p: usize, contact: Touching<D>) {
        let own = self.particles.len();
        self.particles.push_from(chunk, p);
        self.particles.write(Layout::<D>::STRESS, own, &[0.0; 6][..Layout::<D>::SYMMETRIC]);
        self.particles.write(Layout::<D>::MASS, own, &[1.0]);
        self.touching.push(contact);
    }
}
