//! Cost of leaves: integers from measured time, the same on all ranks.
//!
//! The time of scatter and gather of a leaf is measured in one step of many, and divided among classes: the
//! material of the particles, and the kind of their leaf. Sums over all ranks give the cost of a particle of
//! each class; the arena of the leaf counts as additional particles. Steps in which nodes are summed and
//! updated give the cost of a leaf beside them. Costs steer the partition, which changes no bit of the state.
use crate::particle::Chunk;
use crate::particle::chunk::Tag;
use crate::solver::state::leaf_data::MEASURE_EVERY;

/// Cost of a leaf with particles, without these, over that of a leaf without particles.
const EMPTY: u64 = 8;
/// Unit of measured costs, s.
pub(in crate::solver) const UNIT: f64 = 1e-11;
/// A class needs so many measured particles to have a cost of its own.
const FEW: u64 = 500;

/// How the boxes of a leaf are transferred.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// All in one bin without constrained nodes.
    Plain,
    /// Beside a change of level.
    Jump,
    /// Some boxes are cut into parts.
    Cut,
}

pub(in crate::solver) const KINDS: usize = 3;

/// Cost of the arena of a leaf in scatter and gather, in particles. Measured: 46 to 158 in 3D, the latter in
/// sand that has a free surface, and 24 in 2D; less where few particles touch a part of it.
pub(in crate::solver) fn arena_cost(d: usize, particles: u64) -> u64 {
    particles.min(if d == 2 { 24 } else { 64 })
}

/// Cost of the nodes of a leaf with particles before anything is measured, in particles.
const fn node_cost(d: usize) -> u64 {
    if d == 2 { 6 } else { 40 }
}

/// Costs of leaves and what they are measured from.
#[derive(Debug, Default)]
pub struct Costs {
    /// Cost of a particle by material and kind; empty before the first measurement.
    particle: Vec<[u64; KINDS]>,
    /// Cost of a leaf with particles beside them.
    leaf: u64,
    /// Step at which this process began.
    first_step: u64,
    /// Steps and seconds of node work up to the last agreement.
    pub(in crate::solver) agreed_step: u64,
    pub(in crate::solver) agreed_seconds: f64,
}

/// Cost of a leaf in particles, as long as no time is measured.
pub fn leaf_weight<const D: usize>(chunk: &Chunk<D>) -> u64 {
    leaf_cost::<D>(chunk.len() as u64)
}

/// As [`leaf_weight`], for a leaf with so many particles.
pub fn leaf_cost<const D: usize>(particles: u64) -> u64 {
    if particles == 0 {
        node_cost(D) / EMPTY + 1
    } else {
        node_cost(D) + arena_cost(D, particles) + particles
    }
}

impl Costs {
    /// No costs yet, in a run that starts or goes on at a step.
    pub(in crate::solver) fn new(step: u64) -> Self {
        Self { first_step: step, agreed_step: step, ..Self::default() }
    }

    /// Whether time has been taken of all leaves.
    pub(in crate::solver) fn are_measured(&self) -> bool {
        self.agreed_step - self.first_step >= MEASURE_EVERY
    }

    /// Cost of a leaf.
    pub(in crate::solver) fn of<const D: usize>(&self, chunk: &Chunk<D>, kind: Kind) -> u64 {
        if self.particle.is_empty() {
            return leaf_weight(chunk);
        }
        if chunk.is_empty() {
            return (self.leaf / EMPTY).max(1);
        }
        let particles = loads(chunk, self.particle.len());
        let cost = particles.iter().zip(&self.particle).map(|(count, cost)| count * cost[kind as usize]);
        self.leaf + cost.sum::<u64>()
    }
}

/// Particles of a chunk by material.
fn counts<const D: usize>(chunk: &Chunk<D>, materials: usize) -> Vec<u64> {
    let mut counts = vec![0; materials];
    match materials {
        1 => counts[0] = chunk.len() as u64,
        _ => chunk.tags().iter().for_each(|&tag| counts[usize::from(Tag::unpack(tag).material)] += 1),
    }
    counts
}

/// As [`counts`], with the leaf's arena shared out to the materials. The chunk is not empty.
pub(in crate::solver) fn loads<const D: usize>(chunk: &Chunk<D>, materials: usize) -> Vec<u64> {
    let (mut loads, len) = (counts(chunk, materials), chunk.len() as u64);
    loads.iter_mut().for_each(|count| *count += arena_cost(D, len) * *count / len);
    loads
}

/// New cost of a class: `new` mixed with what was found before.
fn smoothed(old: u64, new: u64) -> u64 {
    if old == 0 { new } else { (7 * old + new).div_ceil(8) }.max(1)
}

/// Time of a class and the particles that took it, over all ranks, in units of cost per particle.
fn per_particle(units: u64, particles: u64) -> Option<u64> {
    (particles >= FEW).then(|| (units / particles).max(1))
}

impl Costs {
    /// Updates costs from sums over all ranks, in the layout of [`Solver::agree_on_costs`].
    pub(in crate::solver) fn take_in(&mut self, sums: &[u64], materials: usize) {
        let (times, rest) = sums.split_at(KINDS * materials);
        let (particles, nodes) = rest.split_at(KINDS * materials);
        let Some(mean) = per_particle(times.iter().sum(), particles.iter().sum()) else { return };
        self.particle.resize(materials, [0; KINDS]);
        for (class, cost) in self.particle.as_flattened_mut().iter_mut().enumerate() {
            // A class of few particles costs little in any case; its measured time may be noise.
            let new = per_particle(times[class], particles[class]).unwrap_or(mean);
            *cost = smoothed(*cost, new);
        }
        if let Some(new) = nodes[0].checked_div(nodes[1]) {
            self.leaf = smoothed(self.leaf, new);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_follow_what_is_measured() {
        let mut costs = Costs::default();
        // One material: plain leaves at 10 units a particle, jumps at 30, hardly any cut ones.
        costs.take_in(&[10_000, 30_000, 900, 1000, 1000, 3, 5000, 50], 1);
        assert_eq!(costs.particle, [[10, 30, 20]]);
        assert_eq!(costs.leaf, 100);
        costs.take_in(&[90_000, 30_000, 0, 1000, 1000, 0, 5000, 50], 1);
        assert_eq!(costs.particle, [[20, 30, 25]]);
        // Nothing was measured: everything stays.
        costs.take_in(&[0; 8], 1);
        assert_eq!((costs.particle[0], costs.leaf), ([20, 30, 25], 100));
    }
}
