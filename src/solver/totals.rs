//! Exact sums over particles and real nodes, for history and checks.
//!
//! Every sum is exact before it is rounded once, so it does not depend on ranks, threads or order.
use partition::comm::Comm;

use super::{Physics, Solver, StepError};
use crate::exact_sum::ExactSum;
use crate::grid::mask::{bits, block_nodes};
use crate::kernel::simd::{LANES, Lanes};
use crate::particle::chunk::{Chunk, Layout, Tag};

/// Components of a torque or angular momentum, for both dimensions.
const AXES: [(usize, usize); 3] = [(1, 2), (2, 0), (0, 1)];

/// Sums over the real nodes after P2G of the current state, without forces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridTotals {
    /// Mass, kg.
    pub mass: f64,
    /// Linear momentum, kg m/s.
    pub momentum: [f64; 3],
    /// Angular momentum about the lower corner of the domain, affine part of the particles included,
    /// kg m²/s; in plane strain only the last component.
    pub angular_momentum: [f64; 3],
}

/// Sums over all particles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ParticleTotals {
    /// Number.
    pub count: u64,
    /// Mass, kg.
    pub mass: f64,
    /// Linear momentum, kg m/s.
    pub momentum: [f64; 3],
    /// Kinetic energy of the particles' velocities, J.
    pub kinetic: f64,
    /// Elastic energy, J.
    pub elastic: f64,
    /// Potential energy of gravity, zero at the lower corner of the domain, J.
    pub gravitational: f64,
    /// Plastic work done so far, J.
    pub plastic_work: f64,
}

impl<const D: usize> Solver<D> {
    /// Collective. Scatters the current state without forces and sums it over the real nodes. Changes
    /// nothing of the state.
    ///
    /// # Errors
    /// A particle whose box cannot be transferred, on the rank that has it.
    pub fn grid_totals(&mut self) -> Result<GridTotals, StepError> {
        let sorted = self.sort_into_bins();
        self.nodes_from_particles(0.0);

        let mut sums = vec![ExactSum::new(); 7];
        for (index, block) in self.grid.plan.blocks.iter().enumerate() {
            let first = index * block_nodes(D);
            for bit in bits(block.owned) {
                let node = first as u32 + bit;
                let row = self.grid.fields.rows[node as usize].0;
                let position = self.grid.plan.node_position(node);
                add_point(&mut sums, row[3], &row[..D], &position);
            }
        }
        ExactSum::sum_over_ranks(&self.comm, &mut sums);
        let of = |i: usize| sums[i].to_f64();
        sorted?;
        Ok(GridTotals {
            mass: of(0),
            momentum: [of(1), of(2), of(3)],
            angular_momentum: [of(4), of(5), of(6)],
        })
    }

    /// Collective. Sums over all particles.
    pub fn particle_totals(&self) -> ParticleTotals {
        particle_totals(&self.comm, &self.physics, &self.chunks)
    }
}

/// Adds mass, momentum and angular momentum of a point to seven sums.
fn add_point<const D: usize>(sums: &mut [ExactSum], mass: f64, momentum: &[f64], position: &[f64; D]) {
    sums[0].add(mass);
    for axis in 0..D {
        sums[1 + axis].add(momentum[axis]);
    }
    for (component, (j, k)) in AXES.into_iter().enumerate() {
        if j < D && k < D {
            // Two products, each rounded once, enter exactly.
            sums[4 + component].add(position[j] * momentum[k]);
            sums[4 + component].add(-(position[k] * momentum[j]));
        }
    }
}

/// Collective. Sums over the particles of all ranks.
pub fn particle_totals<const D: usize>(
    comm: &Comm,
    physics: &Physics<D>,
    chunks: &[Chunk<D>],
) -> ParticleTotals {
    let mut sums = vec![ExactSum::new(); 8];
    let mut count = [0u64];
    for chunk in chunks {
        count[0] += chunk.len() as u64;
        add_chunk(&mut sums, physics, chunk);
    }
    ExactSum::sum_over_ranks(comm, &mut sums);
    comm.sum_u64(&mut count);
    let of = |i: usize| sums[i].to_f64();
    ParticleTotals {
        count: count[0],
        mass: of(0),
        momentum: [of(1), of(2), of(3)],
        kinetic: of(4),
        elastic: of(5),
        gravitational: of(6),
        plastic_work: of(7),
    }
}

fn add_chunk<const D: usize>(sums: &mut [ExactSum], physics: &Physics<D>, chunk: &Chunk<D>) {
    let column = |c: usize| chunk.column(c);
    let (mass, half) = (column(Layout::<D>::MASS), column(Layout::<D>::HALF));
    let work = column(Layout::<D>::WORK);
    let energy = elastic_energy(physics, chunk);
    for p in 0..chunk.len() {
        let volume = (0..D).fold(1.0, |volume, _| volume * 2.0 * half[p]);
        let mut speed_squared = 0.0;
        let mut height = 0.0;
        for axis in 0..D {
            let v = column(Layout::<D>::VELOCITY + axis)[p];
            sums[1 + axis].add(mass[p] * v);
            speed_squared = f64::mul_add(v, v, speed_squared);
            height = physics.gravity[axis].mul_add(column(Layout::<D>::POSITION + axis)[p], height);
        }
        sums[0].add(mass[p]);
        sums[4].add(0.5 * mass[p] * speed_squared);
        sums[5].add(volume * energy[p]);
        sums[6].add(-mass[p] * height);
        sums[7].add(volume * work[p]);
    }
}

/// Elastic energy of each particle per reference volume, J/m³.
fn elastic_energy<const D: usize>(physics: &Physics<D>, chunk: &Chunk<D>) -> Vec<f64> {
    let mut energy = vec![0.0; chunk.len()];
    for first in (0..chunk.len()).step_by(LANES) {
        let at = |lane: usize| (first + lane).min(chunk.len() - 1);
        let elastic = std::array::from_fn(|c| {
            Lanes::new(std::array::from_fn(|lane| match c {
                _ if c < Layout::<D>::SYMMETRIC => chunk.column(Layout::<D>::LEFT_CAUCHY_GREEN + c)[at(lane)],
                _ => 0.0,
            }))
        });
        for lane in 0..LANES.min(chunk.len() - first) {
            let material = usize::from(Tag::unpack(chunk.tags()[first + lane]).material);
            // Lanes of one material share the call in practice; mixed batches repeat it per lane.
            if lane == 0 || Tag::unpack(chunk.tags()[first + lane - 1]).material != material as u16 {
                let values = physics.materials[material].energy(&elastic, D == 2).to_array();
                energy[first + lane..(first + LANES).min(chunk.len())]
                    .copy_from_slice(&values[lane..LANES.min(chunk.len() - first)]);
            }
        }
    }
    energy
}
