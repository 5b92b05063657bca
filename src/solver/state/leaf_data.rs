//! Data of each own leaf beside its particles.
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::adaptivity::LeafMaxima;
use crate::material::SHOCK_SUMS;
use crate::particle::Chunk;
use crate::particle::chunk::Place;
use crate::solver::state::bookings::{FAILED_SUMS, Struck};
use crate::solver::state::phases::thread_time;

/// Steps between measurements of time in a leaf; neighbours along the curve have theirs in different steps.
/// Reading the processor time takes as long as several particles.
pub(in crate::solver) const MEASURE_EVERY: u64 = 32;

/// Data of each own leaf beside its particles: arrays that run parallel to the leaves, and are reset together
/// when these change.
#[derive(Debug, Default)]
pub struct LeafData<const D: usize> {
    /// Greatest sum of wave speed and particle speed after the last step, m/s; 0 if that is not known.
    pub(in crate::solver) signal: Vec<f64>,
    /// Bounds on the particles after the last step; empty if that step had other leaves.
    pub(in crate::solver) maxima: Vec<LeafMaxima<D>>,
    /// Mass times the shift that keeps fluids in their volume, summed over particles in the last step, kg m.
    pub(in crate::solver) shifts: Vec<[f64; D]>,
    /// Work of artificial viscosity in the last step and the part of it that is heat of the material, J.
    pub(in crate::solver) shocks: Vec<[f64; SHOCK_SUMS]>,
    /// Impulses of particles on faces of the domain in the last step.
    pub(in crate::solver) struck: Vec<Vec<Struck<D>>>,
    /// Contributions of particles that failed in the last step to sums.
    pub(in crate::solver) failed: Vec<Vec<[f64; FAILED_SUMS]>>,
    /// Where the particles were in memory at the start of the last G2P.
    pub(in crate::solver) places: Vec<Place>,
    /// Processor time of the particles' work.
    pub(in crate::solver) times: LeafTimes,
}

impl<const D: usize> LeafData<D> {
    /// Not collective. Clears the data, for so many own leaves.
    pub(in crate::solver) fn reset(&mut self, leaves: usize) {
        self.signal.clear();
        self.signal.resize(leaves, 0.0);
        self.maxima.clear();
        self.shifts.clear();
        self.shocks.clear();
        self.struck.clear();
        self.failed.clear();
        self.places.clear();
        self.times.reset(leaves);
    }

    /// Not collective. Begins the step of this number, which fills all anew.
    pub(in crate::solver) fn begin_step(&mut self, step: u64, leaves: usize) {
        if self.signal.len() != leaves || self.times.nanoseconds.len() != leaves {
            self.reset(leaves);
        }
        let first = if self.times.steps.is_empty() { step } else { self.times.steps.start };
        self.times.steps = first..step + 1;
        self.times.is_step = true;
    }

    /// Not collective. Makes room for the results of G2P.
    pub(in crate::solver) fn begin_gather(&mut self, chunks: &[Chunk<D>]) {
        self.signal.resize(chunks.len(), 0.0);
        self.maxima.resize(chunks.len(), LeafMaxima::default());
        self.shifts.resize(chunks.len(), [0.0; D]);
        self.shocks.resize(chunks.len(), [0.0; SHOCK_SUMS]);
        self.struck.iter_mut().for_each(Vec::clear);
        self.struck.resize_with(chunks.len(), Vec::new);
        self.failed.iter_mut().for_each(Vec::clear);
        self.failed.resize_with(chunks.len(), Vec::new);
        self.places.clear();
        self.places.extend(chunks.iter().map(Chunk::place));
    }
}

/// Processor time that P2G and G2P take in each own leaf, summed over some steps.
#[derive(Debug, Default)]
pub(in crate::solver) struct LeafTimes {
    /// Nanoseconds per own leaf.
    pub nanoseconds: Vec<AtomicU64>,
    /// The steps, the one under way included.
    pub steps: Range<u64>,
    /// Whether particles are transferred for a step, not for a row of the history.
    is_step: bool,
}

impl LeafTimes {
    /// Not collective. Forgets what was measured.
    pub(crate) fn reset(&mut self, leaves: usize) {
        self.nanoseconds = std::iter::repeat_with(AtomicU64::default).take(leaves).collect();
        self.steps = 0..0;
    }

    /// Not collective. The step is over.
    pub(crate) fn end_step(&mut self) {
        self.is_step = false;
    }

    /// Runs work on the particles of a leaf, on any thread.
    pub(crate) fn time<R>(&self, leaf: usize, work: impl FnOnce() -> R) -> R {
        if !self.is_step || !is_measured(leaf, self.steps.end) {
            return work();
        }
        let start = thread_time();
        let result = work();
        self.nanoseconds[leaf].fetch_add((thread_time() - start).as_nanos() as u64, Ordering::Relaxed);
        result
    }

    /// Number of the steps in which the time of a leaf was measured.
    pub(crate) fn measurements(&self, leaf: usize) -> u64 {
        let before = |end: u64| (leaf as u64 + end) / MEASURE_EVERY;
        before(self.steps.end) - before(self.steps.start)
    }
}

/// Whether the time of a leaf is measured in the step before `end`.
fn is_measured(leaf: usize, end: u64) -> bool {
    (leaf as u64 + end).is_multiple_of(MEASURE_EVERY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_are_counted() {
        for leaf in 0..70 {
            for steps in [0..1, 5..5, 3..40, 31..200, 64..64 + MEASURE_EVERY] {
                let each = steps.clone().filter(|step| is_measured(leaf, step + 1)).count() as u64;
                assert_eq!(LeafTimes { steps, ..LeafTimes::default() }.measurements(leaf), each);
            }
        }
    }

    /// Data of other leaves are never taken for those of these, not even if there are as many.
    #[test]
    fn one_reset_forgets_all_that_was_noted() {
        let mut data = LeafData::<2>::default();
        data.begin_step(7, 3);
        data.begin_gather(&vec![Chunk::new(); 3]);
        data.signal[1] = 5.0;
        data.times.nanoseconds[1].store(9, Ordering::Relaxed);
        data.reset(3);
        assert_eq!(data.signal, [0.0; 3]);
        assert!(data.maxima.is_empty() && data.places.is_empty() && data.times.steps.is_empty());
        assert!(data.times.nanoseconds.iter().all(|time| time.load(Ordering::Relaxed) == 0));
    }
}
