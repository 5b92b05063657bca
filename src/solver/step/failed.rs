//! Particles whose material has failed: they are deleted, or become another material.
//!
//! One that becomes another keeps mass, velocity, volume and plastic work, and begins its new history. Its
//! stress is the pressure of its volume in the new law; a gain of volume stays where the law has it without
//! tension, as sand with gaps has, and is lost elsewhere. The elastic energy that goes with the rest is
//! booked.
use crate::material::{Failed, HISTORIES, Material, State, Step};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::halvings;
use crate::particle::volume::{reference_volume, volume_ratio};
use crate::simd::{Lanes, Vector};
use crate::solver::physics::Physics;
use crate::solver::state::Solver;
use crate::solver::state::bookings::FAILED_SUMS;

/// Treatment of failed particles, the same for all leaves.
pub(super) struct Failures<'a, const D: usize> {
    materials: &'a [Box<dyn Material>],
    /// By material.
    rules: &'a [Failed],
    /// Gravity in the middle of the step, m/s².
    gravity: [f64; D],
}

/// Failed particles of a leaf in one step.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// Those to be deleted, ascending.
    pub deleted: Vec<u32>,
    /// Contributions of all to the sums of the solver.
    pub sums: Vec<[f64; FAILED_SUMS]>,
    /// Greatest `c + |v|` of those that have become another material, m/s.
    pub signal: f64,
}

impl<'a, const D: usize> Failures<'a, D> {
    /// Those of a step whose middle is at a time, s; `None` if no material of the job goes when it fails.
    pub(super) fn new(physics: &'a Physics<D>, time: f64) -> Option<Self> {
        let gravity = physics.gravity.at(time);
        let (materials, rules) = (&physics.materials, &physics.failed);
        physics.can_fail().then_some(Self { materials, rules, gravity })
    }

    /// Lists the particles of a leaf that have failed and go; those that become another material do so here.
    pub(super) fn find(&self, chunk: &mut Chunk<D>) -> Found {
        let mut found = Found::default();
        for p in 0..chunk.len() {
            let tag = Tag::unpack(chunk.tags()[p]);
            let own = usize::from(tag.material);
            let rule = self.rules[own];
            if rule == Failed::Stays {
                continue;
            }
            let history: [f64; HISTORIES] = chunk.read(Layout::<D>::HISTORY, p);
            if !self.materials[own].has_failed(&history) {
                continue;
            }
            match rule {
                Failed::Stays => {}
                Failed::Delete => {
                    found.deleted.push(p as u32);
                    found.sums.push(self.deleted(chunk, p));
                }
                Failed::Becomes(other) => {
                    let [lost, signal] = self.become_other(chunk, p, Tag { material: other, ..tag });
                    let mut sums = [0.0; FAILED_SUMS];
                    (sums[1], sums[7]) = (1.0, lost);
                    found.sums.push(sums);
                    found.signal = found.signal.max(signal);
                }
            }
        }
        found
    }

    /// Sums that go with a particle that is deleted.
    fn deleted(&self, chunk: &Chunk<D>, p: usize) -> [f64; FAILED_SUMS] {
        let mass = chunk.column(Layout::<D>::MASS)[p];
        let velocity: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
        let mut sums = [0.0; FAILED_SUMS];
        (sums[0], sums[2]) = (1.0, mass);
        (0..D).for_each(|axis| sums[3 + axis] = mass * velocity[axis]);
        sums[6] = 0.5 * mass * velocity.iter().map(|v| v * v).sum::<f64>();
        let volume = reference_volume(chunk, p);
        sums[7] = volume * self.energy(&state::<D>(chunk, p), Tag::unpack(chunk.tags()[p]).material);
        let place = chunk.position(p);
        sums[8] = -mass * (0..D).map(|axis| self.gravity[axis] * place[axis]).sum::<f64>();
        sums[9] = volume * chunk.column(Layout::<D>::WORK)[p];
        sums
    }

    /// Elastic energy per reference volume, J/m³.
    fn energy(&self, state: &State, material: u16) -> f64 {
        self.materials[usize::from(material)].energy(state, D == 2).to_array()[0]
    }

    /// Undeformed material with this logarithm of the volume ratio.
    fn begun(&self, material: u16, gain: f64) -> State {
        let stretch = Lanes::splat(libm::exp(gain * (2.0 / 3.0)));
        let zero = Lanes::splat(0.0);
        let mut state = State::new([stretch, stretch, stretch, zero, zero, zero]);
        state.history = self.materials[usize::from(material)].initial_history().map(Lanes::splat);
        self.materials[usize::from(material)].update(&mut state, &Step::rest(D == 2));
        state
    }

    /// Makes a particle one with another tag; the elastic energy that is lost, J, and its `c + |v|`, m/s.
    fn become_other(&self, chunk: &mut Chunk<D>, p: usize, tag: Tag) -> [f64; 2] {
        let packed = chunk.tags()[p];
        let before = self.energy(&state::<D>(chunk, p), Tag::unpack(packed).material);
        let law = &self.materials[usize::from(tag.material)];
        let gain = libm::log(volume_ratio(chunk, p));
        let mut own = self.begun(tag.material, gain);
        if gain > 0.0 && !bears_none(&own) {
            own = self.begun(tag.material, 0.0);
        }
        for c in 0..Layout::<D>::SYMMETRIC {
            chunk.column_mut(Layout::<D>::LEFT_CAUCHY_GREEN + c)[p] = own.elastic[c].to_array()[0];
            chunk.column_mut(Layout::<D>::STRESS + c)[p] = own.stress[c].to_array()[0];
        }
        chunk.write(Layout::<D>::HISTORY, p, &own.history.map(|value| value.to_array()[0]));
        chunk.column_mut(Layout::<D>::WORK)[p] += own.work.to_array()[0];
        chunk.tags_mut()[p] = halvings::with(packed, tag);
        let velocity: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
        let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        let lost = before - self.energy(&own, tag.material) - own.work.to_array()[0];
        [lost * reference_volume(chunk, p), own.wave_speed.to_array()[0].max(law.wave_speed()) + speed]
    }
}

/// Whether a state has neither tension nor flow against one.
fn bears_none(state: &State) -> bool {
    let mean: f64 = state.stress[..3].iter().map(|normal| normal.to_array()[0]).sum();
    mean <= 0.0 && state.work.to_array()[0] <= 0.0
}

/// Elastic state and history of a particle, in all lanes.
fn state<const D: usize>(chunk: &Chunk<D>, p: usize) -> State {
    let mut state = State::new([Lanes::splat(0.0); 6]);
    for c in 0..Layout::<D>::SYMMETRIC {
        state.elastic[c] = Lanes::splat(chunk.column(Layout::<D>::LEFT_CAUCHY_GREEN + c)[p]);
    }
    let history: [f64; HISTORIES] = chunk.read(Layout::<D>::HISTORY, p);
    state.history = history.map(Lanes::splat);
    state
}

impl<const D: usize> Solver<D> {
    /// Not collective. Adds what the failed particles of a step contribute to the sums.
    pub(super) fn book_failed(&mut self) {
        let Some(sums) = self.sums.failed.of.first_mut() else { return };
        for one in self.leaf_data.failed.iter().flatten() {
            for (sum, value) in sums.iter_mut().zip(one).filter(|(_, value)| **value != 0.0) {
                sum.add(*value);
            }
        }
    }

    /// Collective. Sums over all particles that have failed and gone since the start; `None` where none can.
    pub fn failed_totals(&self) -> Option<[f64; FAILED_SUMS]> {
        self.sums.failed.totals(&self.comm).first().copied()
    }
}
