//! Forces on particles: those that they carry (tractions, pressures, point forces), that of the water in
//! their pores, and body forces that belong to places of the undeformed body. With mass scaling gravity and
//! all body forces are among them: they act on the mass of the material, not on the scaled mass.
//!
//! A particle's force f goes to the nodes with the weights of its mass: `p_j += w Δt f`. So P2G is given the
//! velocity `v + Δt f / m` in place of the particle's own: the force passes through parts of boxes and
//! constrained nodes like momentum, and no kernel handles loads.
//!
//! A force on a surface acts at the surface, with the moment `M = f ⊗ d` by its way d from the centre of
//! the particle: to first order nodes get `Δt (w f + M ∇w)`, so that uniform stress balances a uniform
//! load to round-off where boxes tile cells. At the centres it would leave half of the load in the outermost
//! row. The second term is that of a stress `−M / V₀`, which P2G is given with that of the particle: of M
//! the symmetric part, and all of it in load steps. The work is `f · Δx + Δt M : ∇v` with the
//! displacement Δx of the particle, which `follow` finds.
pub(super) mod follow;

use rayon::prelude::*;

use crate::exact_sum::ExactSum;
use crate::kernel::{Coordinates, GivenColumn};
use crate::leapfrog::Lengths;
use crate::load::{Carried, Kind, Load};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::followed::head;
use crate::particle::volume::box_volume;
use crate::simd::Vector;
use crate::solver::sorting::box_bounds::Widths;
use crate::solver::sorting::box_widths::BoxWidths;
use crate::solver::state::Solver;
use crate::solver::state::bookings::{CarriedTotals, ParticlePush};
use crate::solver::state::phases::Phase;

/// Greatest number of columns that a particle carries for a load.
const MOST: usize = 4;

/// Numbers that a particle carries for a load; `None` if all are 0.
fn numbers<const D: usize>(chunk: &Chunk<D>, carried: &Carried<D>, p: usize) -> Option<[f64; MOST]> {
    let columns = carried.force.columns();
    let number = |i: usize| chunk.carried(carried.first + i).get(p).copied().unwrap_or(0.0);
    let numbers = std::array::from_fn(|i| if i < columns { number(i) } else { 0.0 });
    numbers.iter().any(|&number| number != 0.0).then_some(numbers)
}

/// Place (m) at which a force on the surface is evaluated for a particle, whose box has these half widths
/// (m): at the surface if the force depends on the place.
fn surface_at<const D: usize>(
    chunk: &Chunk<D>,
    carried: &Carried<D>,
    numbers: &[f64],
    p: usize,
    half: &[f64; D],
) -> [f64; D] {
    let (x, way) = (chunk.position(p), carried.way_to_surface(numbers, half));
    std::array::from_fn(|a| x[a] + way[a])
}

/// Columns of a leaf from `first` on, as many as `count`, to be given with changed values in place of its
/// own.
fn columns<const D: usize>(chunk: &Chunk<D>, first: usize, count: usize) -> Vec<GivenColumn> {
    let values = |column: usize| chunk.column(column).iter().copied().collect();
    (first..first + count).map(|column| GivenColumn { column, values: values(column) }).collect()
}

/// Half widths of the box of a particle in a leaf with cells of this edge, m.
fn half_widths<const D: usize>(widths: &Widths<'_, D>, chunk: &Chunk<D>, p: usize, cell: f64) -> [f64; D] {
    widths.of_batch(chunk, &[p as u32], cell).map(|half| half.to_array()[0])
}

/// Loads and gravity that act on particles in a step.
struct Pushing<'a, const D: usize> {
    /// Half widths of boxes.
    widths: Widths<'a, D>,
    /// Loads that act on particles, with their numbers.
    loads: Vec<(usize, &'a Load<D>)>,
    /// First column of the displacement, if particles carry it.
    displacement: Option<usize>,
    /// First column of the head of the water, if particles carry it.
    head: Option<usize>,
    /// Gravity, m/s².
    gravity: [f64; D],
    /// Gravity that acts on particles, m/s²: all where masses are scaled; else 0, as it acts on nodes.
    on_particles: [f64; D],
    /// Column of the share of the pores that is full, if particles carry it.
    saturation: Option<usize>,
    /// By material, its density, kg/m³, and that with full pores over it.
    densities: Vec<[f64; 2]>,
    /// Whether forces act on all particles, and not only on those that carry something.
    all: bool,
    /// Those of the job.
    coordinates: Coordinates,
    /// Whether affine columns hold the stress, as in load steps.
    is_in_steps: bool,
    /// Middle of the time over which forces act, s.
    middle: f64,
    /// Its length, s.
    kick: f64,
}

impl<const D: usize> Pushing<'_, D> {
    /// Adds the forces on the particles of a leaf with cells of this edge (m), which move with `scale` times
    /// their mass, to `pushes`. Returns their velocities after the impulses and, where forces act at
    /// surfaces, their stress with that of the moments; nothing where no force acts.
    fn push(
        &self,
        chunk: &Chunk<D>,
        cell: f64,
        scale: f64,
        pushes: &mut Vec<ParticlePush<D>>,
    ) -> Vec<GivenColumn> {
        let (mut velocities, mut stress) = (Vec::new(), Vec::new());
        let has_water = self.loads.iter().any(|(_, load)| matches!(load.kind, Kind::Water(_)));
        let boxes = if has_water { self.widths.of_leaf(chunk, cell) } else { Vec::new() };
        for p in 0..chunk.len() {
            let from = pushes.len();
            let own_mass = chunk.column(Layout::<D>::MASS)[p];
            // The scale is a power of two.
            let mass = own_mass * scale;
            for &(number, load) in &self.loads {
                if let Some((force, moment)) = self.force(chunk, p, load, (cell, boxes.get(p)), own_mass) {
                    let (particle, load, way) = (p as u32, number as u32, chunk.position(p));
                    pushes.push(ParticlePush { particle, load, force, moment, way, turn: 0.0 });
                }
            }
            if self.all || from < pushes.len() {
                let pushes = &pushes[from..];
                if pushes.iter().any(|push| push.moment != [[0.0; D]; D]) {
                    self.add_moments(chunk, p, pushes, &mut stress);
                }
                let velocity: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
                let falling =
                    std::array::from_fn(|a| (self.kick / scale).mul_add(self.on_particles[a], velocity[a]));
                let pushed = pushes.iter().fold(falling, |velocity: [f64; D], push| {
                    std::array::from_fn(|a| self.kick.mul_add(push.force[a] / mass, velocity[a]))
                });
                if velocities.is_empty() {
                    velocities = columns(chunk, Layout::<D>::VELOCITY, D);
                }
                velocities.iter_mut().zip(pushed).for_each(|(column, value)| column.values[p] = value);
            }
        }
        velocities.append(&mut stress);
        velocities
    }

    /// Adds `−M / V₀` with the moments M of some forces to the stress of a particle, in columns that are
    /// those of the leaf at first.
    fn add_moments(
        &self,
        chunk: &Chunk<D>,
        p: usize,
        pushes: &[ParticlePush<D>],
        stress: &mut Vec<GivenColumn>,
    ) {
        let [half] = chunk.read(Layout::<D>::HALF, p);
        let volume = box_volume::<D>(half);
        let moment = |i: usize, k: usize| pushes.iter().map(|push| push.moment[i][k]).sum::<f64>() / volume;
        if stress.is_empty() {
            *stress = match self.is_in_steps {
                true => columns(chunk, Layout::<D>::AFFINE, D * D),
                false => columns(chunk, Layout::<D>::STRESS, Layout::<D>::SYMMETRIC),
            };
        }
        for (i, k) in (0..D).flat_map(|i| (0..D).map(move |k| (i, k))) {
            match self.is_in_steps {
                true => stress[D * i + k].values[p] -= moment(i, k),
                false if i == k => stress[i].values[p] -= moment(i, i),
                false => stress[i + k + 2].values[p] -= 0.5 * moment(i, k),
            }
        }
    }

    /// Volume (m³) of a particle of this mass (kg) where its material has its density. Water that comes as
    /// pores open, and goes as they close, bears its own weight, so that of grains under water stays.
    fn volume_of_mass(&self, chunk: &Chunk<D>, p: usize, mass: f64) -> f64 {
        let [density, saturated] = self.densities[usize::from(Tag::unpack(chunk.tags()[p]).material)];
        let full = self.saturation.and_then(|column| chunk.carried(column).get(p).copied()).unwrap_or(0.0);
        mass / (density * full.mul_add(saturated - 1.0, 1.0))
    }

    /// Force of a load on a particle of this mass (kg) in a leaf with cells of this edge (m), N, if it has
    /// any, and its moment about the centre, N m. Water needs the half widths of its box, m.
    fn force(
        &self,
        chunk: &Chunk<D>,
        p: usize,
        load: &Load<D>,
        (cell, half): (f64, Option<&[f64; D]>),
        mass: f64,
    ) -> Option<([f64; D], [[f64; D]; D])> {
        let at_centre = |force: [f64; D]| (force, [[0.0; D]; D]);
        let place = |x: &[f64; D]| load.place(x, &displacement(chunk, self.displacement, p));
        match &load.kind {
            Kind::Carried(carried) => {
                let numbers = numbers(chunk, carried, p)?;
                let half = half_widths(&self.widths, chunk, p, cell);
                let x = surface_at(chunk, carried, &numbers, p, &half);
                let force = load.force(carried, &numbers, &place(&x), self.middle - load.start);
                let ahead = self.coordinates.to_mass_centre(half[0], chunk.position(p)[0]);
                Some((force, carried.moment(&numbers, &force, &half, ahead)))
            }
            Kind::Water(water) => {
                let at = place(&chunk.position(p)).now;
                let water = water.about(head(chunk, self.head, p, &load.origin));
                let per_volume = water.force(at, half?, self.middle - load.start, &self.gravity);
                (per_volume != [0.0; D]).then(|| {
                    let volume = self.volume_of_mass(chunk, p, mass);
                    at_centre(per_volume.map(|force| volume * force))
                })
            }
            _ => {
                let x = chunk.position(p);
                load.body_force(&x, &place(&x), self.middle)
                    .map(|per_mass| at_centre(per_mass.map(|a| mass * a)))
            }
        }
    }
}

/// Displacement of a particle, m; 0 where particles do not carry it.
fn displacement<const D: usize>(chunk: &Chunk<D>, first: Option<usize>, p: usize) -> [f64; D] {
    let component = |axis: usize| chunk.carried(first? + axis).get(p).copied();
    std::array::from_fn(|axis| component(axis).unwrap_or(0.0))
}

impl<const D: usize> Solver<D> {
    /// Not collective. Adds the columns with which particles scatter the impulse of the forces on them, leaf
    /// by leaf; none if no force acts.
    pub(in crate::solver) fn push_particles(&mut self, lengths: Lengths, given: &mut Vec<Vec<GivenColumn>>) {
        let (physics, time) = (&self.physics, self.clock.time);
        let scaled = physics.has_scaled_masses();
        let loads = physics.loads.iter().enumerate();
        let loads: Vec<_> = loads.filter(|(_, load)| load.acts_on_particles(scaled)).collect();
        if loads.is_empty() && !scaled {
            return;
        }
        let middle = lengths.middle_of_kick(time);
        let plan = &self.grid.plan;
        let pushing = Pushing {
            widths: physics.widths(plan),
            all: scaled || loads.iter().any(|(_, load)| load.carried().is_none()),
            coordinates: physics.coordinates,
            is_in_steps: physics.quasi_static.is_some(),
            loads: loads.into_iter().filter(|(_, load)| load.is_active(time)).collect(),
            displacement: physics.followed_columns().displacement,
            head: physics.followed_columns().head,
            saturation: physics.followed_columns().saturation,
            densities: physics
                .materials
                .iter()
                .zip(&physics.saturated)
                .map(|(material, saturated)| [material.density(), *saturated])
                .collect(),
            gravity: physics.gravity.at(middle),
            on_particles: if scaled { physics.gravity.at(middle) } else { [0.0; D] },
            middle,
            kick: lengths.kick,
        };
        self.particle_forces.loads.resize_with(self.chunks.len(), Vec::new);
        given.resize_with(self.chunks.len(), Vec::new);
        let leaves = self.chunks.par_iter().zip(&mut self.particle_forces.loads).zip(given).enumerate();
        self.phases.time(Phase::Scatter, || {
            leaves.with_min_len(32).for_each(|(leaf, ((chunk, pushes), given))| {
                pushes.clear();
                if pushing.all || chunk.carried_columns() > 0 {
                    let scale = physics.mass_scale(plan.finest_level(leaf)).unwrap_or(1.0);
                    given.append(&mut pushing.push(chunk, plan.finest_cell(leaf), scale, pushes));
                }
            });
        });
    }

    /// Not collective. Masses with which particles move, leaf by leaf, in stages with mass scaling; nothing
    /// in others, where these are their own.
    pub(super) fn scaled_masses(&self) -> Vec<Vec<GivenColumn>> {
        let (physics, plan) = (&self.physics, &self.grid.plan);
        if !physics.has_scaled_masses() {
            return Vec::new();
        }
        let leaves = self.chunks.par_iter().enumerate().with_min_len(32);
        let masses = leaves.map(|(leaf, chunk)| {
            let scale = physics.mass_scale(plan.finest_level(leaf)).unwrap_or(1.0);
            let values = chunk.column(Layout::<D>::MASS).iter().map(|mass| mass * scale).collect();
            vec![GivenColumn { column: Layout::<D>::MASS, values }]
        });
        masses.collect()
    }

    /// Not collective. Adds impulse and work of the forces on particles to the sums of the loads, after
    /// particles have moved.
    pub(in crate::solver) fn book_pushes(&mut self, Lengths { kick, .. }: Lengths) {
        for push in self.particle_forces.loads.iter().flatten() {
            let sums = &mut self.sums.loads.of[push.load as usize];
            for a in 0..D {
                sums[a].add(kick * push.force[a]);
                sums[3].add(push.force[a] * push.way[a]);
            }
            sums[3].add(push.turn);
        }
    }

    /// Collective. Number and area of the particles that carry each load, and its force when it begins, or
    /// now if it has begun.
    pub fn carried_totals(&self) -> Vec<CarriedTotals> {
        let (mut all, moved) = (Vec::new(), self.physics.followed_columns().displacement);
        let widths = self.physics.widths(&self.grid.plan);
        for load in &self.physics.loads {
            let Some(carried) = load.carried() else { continue };
            let own = self.clock.time - load.start;
            let time = load.from.max(own);
            let (mut count, mut sums) = ([0], [(); 4].map(|()| ExactSum::new()));
            let carrying = self.chunks.iter().enumerate().filter(|(_, chunk)| chunk.carried_columns() > 0);
            for (leaf, chunk) in carrying {
                for p in 0..chunk.len() {
                    let Some(numbers) = numbers(chunk, carried, p) else { continue };
                    count[0] += 1;
                    let half = half_widths(&widths, chunk, p, self.grid.plan.finest_cell(leaf));
                    let x = surface_at(chunk, carried, &numbers, p, &half);
                    let place = load.place(&x, &displacement(chunk, moved, p));
                    let force = load.force(carried, &numbers, &place, time);
                    (0..D).for_each(|a| sums[a].add(force[a]));
                    sums[3].add(carried.area(&numbers));
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

/// Whether any particle of a chunk carries forces on surfaces.
pub(super) fn has_surfaces<const D: usize>(chunk: &Chunk<D>, on_surfaces: &[&Carried<D>]) -> bool {
    let carries = |p: usize| on_surfaces.iter().any(|carried| numbers(chunk, carried, p).is_some());
    !on_surfaces.is_empty() && chunk.carried_columns() > 0 && (0..chunk.len()).any(carries)
}
