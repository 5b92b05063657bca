//! Exact sums over particles and real nodes, for history and checks.
//!
//! Sums over nodes are exact before they are rounded once. Particles are added up leaf by leaf, in their
//! order and with twice the usual precision, and the sums of the leaves exactly. So no sum depends on ranks
//! and threads.
use partition::comm::Comm;
use rayon::prelude::*;

use crate::exact_sum::ExactSum;
use crate::grid::NodeFields;
use crate::grid::mask::{bits, block_nodes};
use crate::material::State;
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::simd::{LANES, Lanes, Mask, Vector, VectorMask};
use crate::solver::physics::Physics;
use crate::solver::state::phases::Phase;
use crate::solver::state::{Solver, StepError, Weighed};

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
        self.nodes_from_particles(0.0, &[]);
        self.note_surface();

        let plan = &self.grid.plan;
        // Exact sums do not depend on the order of their parts.
        let together = |mut sums: Vec<ExactSum>, others: Vec<ExactSum>| {
            sums.iter_mut().zip(&others).for_each(|(sum, other)| sum.merge(other));
            sums
        };
        let of_field = |fields: &NodeFields<D>| {
            let blocks = plan.blocks.par_iter().enumerate().with_min_len(64);
            let active = blocks.filter(|(index, _)| fields.active[*index]);
            let each = active.fold(empty_sums, |mut sums, (index, block)| {
                for bit in bits(block.owned) {
                    let node = index * block_nodes(D) + bit as usize;
                    let row = fields.rows[node].0;
                    if row != [0.0; 4] {
                        add_point(&mut sums, row[3], &row[..D], &plan.node_position(node as u32));
                    }
                }
                sums
            });
            each.reduce(empty_sums, together)
        };
        let mut sums = self.grid.all_fields().map(of_field).fold(empty_sums(), together);
        ExactSum::sum_over_ranks(&self.comm, &mut sums);
        let of = |i: usize| sums[i].to_f64();
        sorted?;
        Ok(GridTotals {
            mass: of(0),
            momentum: [of(1), of(2), of(3)],
            angular_momentum: [of(4), of(5), of(6)],
        })
    }

    /// Not collective. Has the next step add up the mass on nodes and of particles once nodes have their
    /// sums; on all ranks or none. That is much cheaper than [`Solver::grid_totals`], which scatters once
    /// more.
    pub fn weigh_next_step(&mut self) {
        self.balance.is_to_weigh = true;
    }

    /// Not collective. Adds up the mass of the particles, if that is requested, before a step.
    pub(in crate::solver) fn weigh_particles(&mut self) {
        if !self.balance.is_to_weigh {
            return;
        }
        let chunks = &self.chunks;
        let particles = self.phases.time(Phase::Output, || {
            let leaves = chunks.par_iter().with_min_len(64).fold(ExactSum::new, |mut sum, chunk| {
                leaf_mass(chunk).enter(&mut sum);
                sum
            });
            leaves.reduce(ExactSum::new, together)
        });
        self.balance.weighed = Some(Weighed { particles, nodes: ExactSum::new() });
    }

    /// Not collective. Adds up the mass on the nodes, if that is requested, after a step that has summed it.
    pub(in crate::solver) fn weigh_nodes(&mut self) {
        if !std::mem::take(&mut self.balance.is_to_weigh) {
            return;
        }
        self.note_surface();
        let grid = &self.grid;
        let nodes = self.phases.time(Phase::Output, || {
            let of_field = |fields: &NodeFields<D>| {
                let blocks = grid.plan.blocks.par_iter().enumerate().with_min_len(64);
                let active = blocks.filter(|(index, _)| fields.active[*index]);
                let sums = active.fold(ExactSum::new, |mut sum, (index, block)| {
                    let rows = &fields.rows[index * block_nodes(D)..];
                    bits(block.owned).for_each(|bit| sum.add(rows[bit as usize].0[3]));
                    sum
                });
                sums.reduce(ExactSum::new, together)
            };
            grid.all_fields().map(of_field).fold(ExactSum::new(), together)
        });
        self.balance.weighed.iter_mut().for_each(|weighed| weighed.nodes = nodes.clone());
    }

    /// Collective. Difference between the mass on the real nodes and that of the particles, relative to the
    /// latter, as a step measured it last; `None` if none has since the last call.
    pub fn weighed_mass_error(&mut self) -> Option<f64> {
        let Weighed { particles, nodes } = self.balance.weighed.take()?;
        let mut sums = [nodes, particles];
        ExactSum::sum_over_ranks(&self.comm, &mut sums);
        let [nodes, particles] = sums.map(|sum| sum.to_f64());
        Some(mass_error(nodes, particles))
    }

    /// Collective. Sums over all particles.
    pub fn particle_totals(&self) -> ParticleTotals {
        particle_totals(&self.comm, &self.physics, &self.chunks, self.clock.time)
    }
}

/// Exact sums do not depend on the order of their parts.
fn together(mut sum: ExactSum, other: ExactSum) -> ExactSum {
    sum.merge(&other);
    sum
}

/// Difference between the mass on the nodes and that of the particles, relative to the latter; 0 where there
/// is no mass.
pub fn mass_error(nodes: f64, particles: f64) -> f64 {
    if nodes == particles { 0.0 } else { (nodes - particles) / particles }
}

/// Zero sums of mass, momentum and angular momentum.
fn empty_sums() -> Vec<ExactSum> {
    vec![ExactSum::new(); 7]
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

/// Collective. Sums over the particles of all ranks, with gravity at a time, s.
pub fn particle_totals<const D: usize>(
    comm: &Comm,
    physics: &Physics<D>,
    chunks: &[Chunk<D>],
    time: f64,
) -> ParticleTotals {
    let gravity = physics.gravity.at(time);
    let of_leaves: Vec<[DoubleDouble; SUMS]> =
        chunks.par_iter().with_min_len(4).map(|chunk| leaf_totals(physics, &gravity, chunk)).collect();
    let mut sums = vec![ExactSum::new(); SUMS];
    for leaf in &of_leaves {
        sums.iter_mut().zip(leaf).for_each(|(sum, of_leaf)| of_leaf.enter(sum));
    }
    let mut count = [chunks.iter().map(|chunk| chunk.len() as u64).sum()];
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

/// Number of sums over particles.
const SUMS: usize = 8;

/// A sum of twice the usual precision: the rounding errors of `high` add up in `low` (Knuth's two-sum).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    /// Adds a number or a sum.
    pub(super) fn add(&mut self, other: impl Into<Self>) {
        let other = other.into();
        let sum = self.high + other.high;
        let part = sum - self.high;
        let error = (self.high - (sum - part)) + (other.high - part);
        *self = Self { high: sum, low: self.low + (error + other.low) };
    }

    /// Adds this to an exact sum. Without the errors, which are no numbers, where the sum is not finite.
    pub(super) fn enter(&self, sum: &mut ExactSum) {
        sum.add(self.high);
        if self.low.is_finite() {
            sum.add(self.low);
        }
    }
}

impl From<f64> for DoubleDouble {
    fn from(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
}

/// [`DoubleDouble`] for each lane.
#[derive(Clone, Copy)]
struct DoubleDoubleLanes {
    high: Lanes,
    low: Lanes,
}

impl DoubleDoubleLanes {
    fn new() -> Self {
        Self { high: Lanes::splat(0.0), low: Lanes::splat(0.0) }
    }

    fn add(&mut self, value: Lanes) {
        let sum = self.high + value;
        let part = sum - self.high;
        self.low += (self.high - (sum - part)) + (value - part);
        self.high = sum;
    }

    /// All lanes together.
    fn total(self) -> DoubleDouble {
        let (high, low) = (self.high.to_array(), self.low.to_array());
        let lanes = high.into_iter().zip(low).map(|(high, low)| DoubleDouble { high, low });
        lanes.fold(DoubleDouble::default(), |mut total, lane| {
            total.add(lane);
            total
        })
    }
}

/// Mass of the particles of one leaf, added up as by [`leaf_totals`].
fn leaf_mass<const D: usize>(chunk: &Chunk<D>) -> DoubleDouble {
    let (lines, rest) = chunk.column(Layout::<D>::MASS).lines();
    let mut sum = DoubleDoubleLanes::new();
    lines.for_each(|line| sum.add(Lanes::load(line)));
    let rest = std::array::from_fn(|lane| rest.get(lane).copied().unwrap_or(0.0));
    sum.add(Lanes::new(rest));
    sum.total()
}

/// Sums over the particles of one leaf, in their order.
fn leaf_totals<const D: usize>(
    physics: &Physics<D>,
    gravity: &[f64; D],
    chunk: &Chunk<D>,
) -> [DoubleDouble; SUMS] {
    let mut sums = [DoubleDoubleLanes::new(); SUMS];
    for first in (0..chunk.len()).step_by(LANES) {
        let members = Mask::from_bits((1 << LANES.min(chunk.len() - first)) - 1);
        let load = |column: usize| members.select(Lanes::new(chunk.values(column, first)), Lanes::splat(0.0));
        let (mass, width) = (load(Layout::<D>::MASS), load(Layout::<D>::HALF) * 2.0);
        let volume = (0..D).fold(Lanes::splat(1.0), |volume, _| volume * width);
        let (mut speed_squared, mut height) = (Lanes::splat(0.0), Lanes::splat(0.0));
        for axis in 0..D {
            let v = load(Layout::<D>::VELOCITY + axis);
            sums[1 + axis].add(mass * v);
            speed_squared = v.mul_add(v, speed_squared);
            height = Lanes::splat(gravity[axis]).mul_add(load(Layout::<D>::POSITION + axis), height);
        }
        sums[0].add(mass);
        sums[4].add(mass * 0.5 * speed_squared);
        let energy = volume * elastic_energy(physics, chunk, first);
        sums[5].add(members.select(energy, Lanes::splat(0.0)));
        sums[6].add(-mass * height);
        sums[7].add(volume * load(Layout::<D>::WORK));
    }
    sums.map(DoubleDoubleLanes::total)
}

/// Elastic energy of the particles from `first` on per reference volume, J/m³.
pub(super) fn elastic_energy<const D: usize>(physics: &Physics<D>, chunk: &Chunk<D>, first: usize) -> Lanes {
    let mut state = State::new([Lanes::splat(0.0); 6]);
    for (c, elastic) in state.elastic.iter_mut().enumerate().take(Layout::<D>::SYMMETRIC) {
        *elastic = Lanes::new(chunk.values(Layout::<D>::LEFT_CAUCHY_GREEN + c, first));
    }
    for (h, history) in state.history.iter_mut().enumerate() {
        *history = Lanes::new(chunk.values(Layout::<D>::HISTORY + h, first));
    }
    let tags = &chunk.tags()[first..chunk.len().min(first + LANES)];
    let material = |lane: usize| Tag::unpack(tags[lane]).material;
    let mut energy = Lanes::splat(0.0);
    // A batch of one material, as nearly all are, takes one pass.
    let mut left = (1u32 << tags.len()) - 1;
    while left != 0 {
        let index = material(left.trailing_zeros() as usize);
        let same =
            (0..tags.len()).filter(|&lane| material(lane) == index).fold(0, |bits, lane| bits | 1 << lane);
        let values = physics.materials[usize::from(index)].energy(&state, D == 2);
        energy = Mask::from_bits(same).select(values, energy);
        left &= !same;
    }
    energy
}
