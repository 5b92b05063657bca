//! Forces that particles carry: tractions, pressures, point forces.
//!
//! A particle's force f goes to the nodes with the weights of its mass: `p_j += w Δt f`. So for P2G the particle has the velocity
//! `v + Δt f / m`, and its own again afterwards: the force takes the way of momentum through parts of boxes and constrained nodes,
//! and no kernel knows of loads. Its work is `f · Δx` with the way Δx of the particle.
use rayon::prelude::*;

use crate::exact_sum::ExactSum;
use crate::kernel::Select;
use crate::load::{Carried, Load, cofactor};
use crate::particle::chunk::{Chunk, Layout};
use crate::solver::state::Solver;
use crate::solver::state::bookings::{CarriedTotals, ParticlePush};
use crate::solver::state::phases::Phase;

/// Velocities of particles as they were ahead of a push.
pub(in crate::solver) type Velocities<const D: usize> = Vec<(u32, [f64; D])>;

/// Numbers that a particle carries for a load; `None` if it carries nothing of it.
fn numbers<const D: usize>(chunk: &Chunk<D>, carried: &Carried<D>, p: usize) -> Option<[f64; D]> {
    let columns = carried.force.columns();
    let number = |i: usize| chunk.carried(carried.first + i).get(p).copied().unwrap_or(0.0);
    let numbers = std::array::from_fn(|i| if i < columns { number(i) } else { 0.0 });
    numbers.iter().any(|&number| number != 0.0).then_some(numbers)
}

/// Pushes the particles of a leaf. Returns what pushed them, and the velocities that they had.
fn push<const D: usize>(
    chunk: &mut Chunk<D>,
    loads: &[(usize, &Load<D>, &Carried<D>)],
    middle: f64,
    dt: f64,
    pushes: &mut Vec<ParticlePush<D>>,
) -> Velocities<D> {
    let mut before = Vec::new();
    for p in 0..chunk.len() {
        let from = pushes.len();
        for &(number, load, carried) in loads {
            if let Some(numbers) = numbers(chunk, carried, p) {
                let x = chunk.position(p);
                let force = load.force(carried, &numbers, &x, middle - load.start);
                pushes.push(ParticlePush { particle: p as u32, load: number as u32, force, way: x });
            }
        }
        if from < pushes.len() {
            let velocity: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
            before.push((p as u32, velocity));
            let mass = chunk.column(Layout::<D>::MASS)[p];
            let pushed = pushes[from..].iter().fold(velocity, |velocity, push| {
                std::array::from_fn(|a| dt.mul_add(push.force[a] / mass, velocity[a]))
            });
            chunk.write(Layout::<D>::VELOCITY, p, &pushed);
        }
    }
    before
}

impl<const D: usize> Solver<D> {
    /// Not collective. Gives particles the impulse of what they carry, for P2G. Returns the velocities that they had, by leaf, for
    /// [`Solver::take_back_push`]; nothing without such loads.
    pub(in crate::solver) fn push_particles(&mut self, dt: f64) -> Vec<Velocities<D>> {
        if self.physics.load_columns() == 0 {
            return Vec::new();
        }
        let time = self.clock.time;
        let loads = self.physics.loads.iter().enumerate().filter(|(_, load)| load.is_active(time));
        let loads: Vec<_> =
            loads.filter_map(|(number, load)| Some((number, load, load.carried()?))).collect();
        self.pushes.resize_with(self.chunks.len(), Vec::new);
        let leaves = self.chunks.par_iter_mut().zip(&mut self.pushes).with_min_len(32);
        self.phases.time(Phase::Scatter, || {
            let before = leaves.map(|(chunk, pushes)| {
                pushes.clear();
                match chunk.carried_columns() {
                    0 => Vec::new(),
                    _ => push(chunk, &loads, time + 0.5 * dt, dt, pushes),
                }
            });
            before.collect()
        })
    }

    /// Not collective. Particles have the velocities again that they had.
    pub(in crate::solver) fn take_back_push(&mut self, before: &[Velocities<D>]) {
        for (chunk, before) in self.chunks.iter_mut().zip(before) {
            before.iter().for_each(|(p, velocity)| chunk.write(Layout::<D>::VELOCITY, *p as usize, velocity));
        }
    }

    /// Not collective. Books impulse and work of what particles carry, once they have moved.
    pub(in crate::solver) fn book_pushes(&mut self, dt: f64) {
        for push in self.pushes.iter().flatten() {
            let sums = &mut self.load_sums.of[push.load as usize];
            for a in 0..D {
                sums[a].add(dt * push.force[a]);
                sums[3].add(push.force[a] * push.way[a]);
            }
        }
    }

    /// Collective. What particles carry now of each load that they carry, and its force when it begins, or now if it has begun.
    pub fn carried_totals(&self) -> Vec<CarriedTotals> {
        let mut all = Vec::new();
        for load in &self.physics.loads {
            let Some(carried) = load.carried() else { continue };
            let own = self.clock.time - load.start;
            let time = load.from.max(own);
            let (mut count, mut sums) = ([0], [(); 4].map(|()| ExactSum::new()));
            for chunk in self.chunks.iter().filter(|chunk| chunk.carried_columns() > 0) {
                for p in 0..chunk.len() {
                    let Some(numbers) = numbers(chunk, carried, p) else { continue };
                    count[0] += 1;
                    let force = load.force(carried, &numbers, &chunk.position(p), time);
                    (0..D).for_each(|a| sums[a].add(force[a]));
                    sums[3].add(numbers.iter().map(|c| c * c).sum::<f64>().sqrt());
                }
            }
            self.comm.sum_u64(&mut count);
            ExactSum::sum_over_ranks(&self.comm, &mut sums);
            let [x, y, z, area] = sums.each_ref().map(ExactSum::to_f64);
            let area = carried.force.is_on_surface().then_some(area);
            all.push(CarriedTotals { particles: count[0], area, force: [x, y, z] });
        }
        all
    }
}

/// The ways that pushed particles of a leaf went, now that they have moved.
pub(super) fn note_ways<const D: usize>(chunk: &Chunk<D>, pushes: &mut [ParticlePush<D>]) {
    for push in pushes {
        let x = chunk.position(push.particle as usize);
        // Exact, since a step is short.
        push.way = std::array::from_fn(|a| x[a] - push.way[a]);
    }
}

/// Positions of all particles, m.
pub(super) fn positions<const D: usize>(chunk: &Chunk<D>) -> Vec<[f64; D]> {
    (0..chunk.len()).map(|p| chunk.position(p)).collect()
}

/// Adds the way of a step to the displacements that particles carry from column `first` on.
pub(super) fn add_ways<const D: usize>(chunk: &mut Chunk<D>, first: usize, start: &[[f64; D]]) {
    let end = positions(chunk);
    if end == *start {
        return;
    }
    chunk.carry(first + D);
    for axis in 0..D {
        let ways = start.iter().zip(&end).map(|(start, end)| end[axis] - start[axis]);
        chunk.carried_mut(first + axis).iter_mut().zip(ways).for_each(|(sum, way)| *sum += way);
    }
}

/// Those of some particles of a chunk that carry areas which follow the deformation.
pub(super) fn followers<const D: usize>(
    chunk: &Chunk<D>,
    following: &[&Carried<D>],
    select: Select,
) -> Vec<u32> {
    let carries = |p: usize| following.iter().any(|carried| numbers(chunk, carried, p).is_some());
    match select {
        Select::All => (0..chunk.len() as u32).filter(|&p| carries(p as usize)).collect(),
        Select::List(list) => list.iter().copied().filter(|&p| carries(p as usize)).collect(),
    }
}

/// Areas that a particle carries follow a step with this velocity gradient (1/s): `da ← J f⁻ᵀ da`, `f = 1 + Δt ∇v`.
pub(super) fn follow<const D: usize>(
    chunk: &mut Chunk<D>,
    following: &[&Carried<D>],
    p: usize,
    gradient: &[[f64; D]; D],
    dt: f64,
) {
    let f = std::array::from_fn(|i| {
        std::array::from_fn(|j| dt.mul_add(gradient[i][j], if i == j { 1.0 } else { 0.0 }))
    });
    let turn = cofactor::<D>(&f);
    for carried in following {
        let Some(area) = numbers(chunk, carried, p) else { continue };
        for i in 0..D {
            let turned = (0..D).fold(0.0, |sum, j| turn[i][j].mul_add(area[j], sum));
            chunk.carried_mut(carried.first + i)[p] = turned;
        }
    }
}
