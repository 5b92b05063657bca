//! Readings of probes.
use partition::comm::Comm;
use rayon::prelude::*;

use super::pores::Pores;
use super::totals::{DoubleDouble, elastic_energy};
use crate::exact_sum::ExactSum;
use crate::particle::Layout;
use crate::particle::chunk::{Chunk, Tag};
use crate::particle::volume::{cauchy_stress, measured_volume, reference_volume};
use crate::probe::{Deposit, Measured, Probe, Readings};
use crate::simd::{LANES, Lanes, Vector};
use crate::solver::physics::Physics;
use crate::solver::state::Solver;

/// Number of sums: mass, volume, mass times place, momentum, energies, volume times stress, plastic strain
/// and pressure in pores.
const SUMS: usize = 2 + 3 + 3 + 3 + 6 + 1 + 1;

/// Quantities of particles that take extra work.
pub(super) struct Wanted<'a, const D: usize> {
    /// Elastic energy.
    energy: bool,
    /// Pressure in pores.
    pores: Option<Pores<'a, D>>,
}

impl<'a, const D: usize> Wanted<'a, D> {
    /// For these quantities.
    pub(super) fn of(solver: &'a Solver<D>, quantities: &[Measured]) -> Self {
        let has = |quantity| quantities.contains(&quantity);
        let pores = has(Measured::PorePressure).then(|| Pores::of(solver));
        Self { energy: has(Measured::ElasticEnergy), pores }
    }
}

/// Sums and extremes over particles of one or more leaves.
#[derive(Clone)]
pub(super) struct Partial<const D: usize> {
    sums: [DoubleDouble; SUMS],
    /// Greatest squared speed, and negative least and greatest coordinates.
    greatest: Vec<f64>,
}

impl<const D: usize> Solver<D> {
    /// Collective. Readings of the probes in the present state, in their order.
    pub fn read_probes(&self, probes: &[Probe<D>]) -> Vec<Readings<D>> {
        if probes.is_empty() {
            return Vec::new();
        }
        let physics = &self.physics;
        let partials = probes.iter().map(|probe| {
            let wanted = Wanted::of(self, &probe.quantities);
            let leaves = self.chunks.par_iter().with_min_len(4).map(|chunk| {
                let counts = |p| probe.counts(&chunk.position(p), Tag::unpack(chunk.tags()[p]).body);
                of_leaf(physics, chunk, &wanted, |p| f64::from(u8::from(counts(p))))
            });
            leaves.collect::<Vec<Option<Partial<D>>>>()
        });
        let mut readings = reduced(&self.comm, partials);
        for (probe, readings) in probes.iter().zip(&mut readings) {
            if let Some(foot) = &probe.foot {
                readings.deposit = self.read_deposit(probe, foot, readings.mass);
            }
        }
        readings
    }
}

/// Collective. Sums over all ranks of sets of particles, each by own leaf.
pub(super) fn reduced<const D: usize>(
    comm: &Comm,
    sets: impl Iterator<Item = Vec<Option<Partial<D>>>>,
) -> Vec<Readings<D>> {
    let (mut sums, mut greatest) = (Vec::new(), Vec::new());
    for leaves in sets {
        let mut all = Partial::<D>::nothing();
        let mut exact = vec![ExactSum::new(); SUMS];
        for leaf in leaves.iter().flatten() {
            exact.iter_mut().zip(&leaf.sums).for_each(|(sum, of_leaf)| of_leaf.enter(sum));
            all.note_greatest(leaf.greatest.iter().copied());
        }
        sums.extend(exact);
        greatest.extend(all.greatest);
    }
    // One reduction for all sets.
    ExactSum::sum_over_ranks(comm, &mut sums);
    comm.max_f64s(&mut greatest);
    let each = sums.chunks_exact(SUMS).zip(greatest.chunks_exact(1 + 2 * D));
    each.map(|(sums, greatest)| readings(|i| sums[i].to_f64(), greatest)).collect()
}

/// Readings of a probe from its sums and greatest values.
fn readings<const D: usize>(of: impl Fn(usize) -> f64, greatest: &[f64]) -> Readings<D> {
    Readings {
        mass: of(0),
        volume: of(1),
        mass_place: std::array::from_fn(|a| of(2 + a)),
        momentum: std::array::from_fn(|a| of(5 + a)),
        energies: [of(8), of(9), of(10)],
        volume_stress: std::array::from_fn(|c| of(11 + c)),
        volume_strain: of(17),
        volume_pores: of(18),
        greatest_speed: greatest[0].max(0.0).sqrt(),
        extent: [std::array::from_fn(|a| -greatest[1 + a]), std::array::from_fn(|a| greatest[1 + D + a])],
        deposit: Deposit::NONE,
    }
}

impl<const D: usize> Partial<D> {
    fn nothing() -> Self {
        Self { sums: [DoubleDouble::default(); SUMS], greatest: vec![f64::NEG_INFINITY; 1 + 2 * D] }
    }

    fn note_greatest(&mut self, values: impl Iterator<Item = f64>) {
        self.greatest.iter_mut().zip(values).for_each(|(all, one)| *all = all.max(one));
    }
}

/// Sums over the particles of a leaf, in their order, each times its weight; `None` if all weights are 0.
pub(super) fn of_leaf<const D: usize>(
    physics: &Physics<D>,
    chunk: &Chunk<D>,
    wanted: &Wanted<D>,
    weight: impl Fn(usize) -> f64,
) -> Option<Partial<D>> {
    let mut all = None;
    let mut energies = [0.0; LANES];
    let mut energies_from = usize::MAX;
    for p in 0..chunk.len() {
        let (weight, x) = (weight(p), chunk.position(p));
        if weight == 0.0 {
            continue;
        }
        let first = p / LANES * LANES;
        if wanted.energy && energies_from != first {
            energies_from = first;
            energies = Lanes::to_array(elastic_energy(physics, chunk, first));
        }
        let value = |column: usize| chunk.column(column)[p];
        let (mass, reference, volume) = (
            weight * value(Layout::<D>::MASS),
            weight * reference_volume(chunk, p),
            weight * measured_volume(chunk, p),
        );
        let velocity: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
        let speed_squared = velocity.iter().fold(0.0, |sum: f64, v| v.mul_add(*v, sum));
        let [xx, yy, zz, xy, yz, xz] = cauchy_stress(chunk, p);
        let mut values = [0.0; SUMS];
        (values[0], values[1]) = (mass, volume);
        for a in 0..D {
            (values[2 + a], values[5 + a]) = (mass * x[a], mass * velocity[a]);
        }
        values[8] = 0.5 * mass * speed_squared;
        values[9] = if wanted.energy { reference * energies[p - first] } else { 0.0 };
        values[10] = reference * value(Layout::<D>::WORK);
        values[11..17].copy_from_slice(&[xx, yy, zz, xy, xz, yz].map(|component| volume * component));
        values[17] = volume * value(Layout::<D>::PLASTIC_STRAIN);
        values[18] = wanted.pores.as_ref().map_or(0.0, |pores| volume * pores.pressure(chunk, p));
        let partial = all.get_or_insert_with(Partial::<D>::nothing);
        partial.sums.iter_mut().zip(values).for_each(|(sum, value)| sum.add(value));
        let extremes = [speed_squared].into_iter().chain(x.map(|x| -x)).chain(x);
        partial.note_greatest(extremes);
    }
    all
}
