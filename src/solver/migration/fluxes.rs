//! Masses that have passed planes and faces.
use partition::comm::Comm;
use rayon::prelude::*;

use super::gone::Gone;
use crate::exact_sum::ExactSum;
use crate::particle::{Chunk, Layout};
use crate::probe::{Flux, Section};

/// Masses counted for the fluxes of a job.
#[derive(Clone, Debug, Default)]
pub struct Fluxes {
    /// Where mass is counted.
    pub sections: Vec<Section>,
    /// Mass that has left the domain beyond each of them, less that beyond it at the start and what stages
    /// have added there since, or that has crossed an opening, kg; this rank's part.
    pub sums: Vec<ExactSum>,
}

impl Fluxes {
    /// Those of a job, with zero masses.
    pub fn new(fluxes: &[Flux]) -> Self {
        let sections = fluxes.iter().map(|flux| flux.section).collect();
        Self { sections, sums: vec![ExactSum::new(); fluxes.len()] }
    }

    /// Counts a particle that leaves the domain, or is deleted in it: beyond a section, it has passed it.
    pub(super) fn book(&mut self, gone: &Gone) {
        for (section, sum) in self.sections.iter().zip(&mut self.sums) {
            let is_beyond = match section {
                Section::Plane { .. } | Section::Opening { .. } => section.is_beyond(&gone.place),
                Section::Face { axis, side } => Some((*axis, *side)) == gone.face,
            };
            if is_beyond {
                sum.add(gone.mass);
            }
        }
    }

    /// Books a particle that a source has fed: what begins beyond a section has not passed it.
    pub(in crate::solver) fn book_fed(&mut self, place: &[f64], mass: f64) {
        for (section, sum) in self.sections.iter().zip(&mut self.sums) {
            if section.is_beyond(place) {
                sum.add(-mass);
            }
        }
    }

    /// Adds masses (kg, with signs) that crossed openings, each with the number of the section.
    pub(super) fn book_passed(&mut self, passed: &[(u32, f64)]) {
        passed.iter().for_each(|&(number, mass)| self.sums[number as usize].add(mass));
    }

    /// Openings among the sections, with their numbers.
    pub(in crate::solver) fn openings(&self) -> Vec<(u32, Section)> {
        let numbered = (0..).zip(self.sections.iter().copied());
        numbered.filter(|(_, section)| matches!(section, Section::Opening { .. })).collect()
    }

    /// Not collective. Adds the mass beyond each section, kg, times a sign. With -1 material that is already
    /// beyond does not count as passed: at the start, and after the changes of a stage. With +1 before these
    /// changes, they do not count either.
    pub fn add_beyond<const D: usize>(&mut self, chunks: &[Chunk<D>], sign: f64) {
        for (section, sum) in self.sections.iter().zip(&mut self.sums) {
            let leaves = chunks.par_iter().with_min_len(16).map(|chunk| {
                let mut of_leaf = ExactSum::new();
                for p in 0..chunk.len() {
                    if section.is_beyond(&chunk.position(p)) {
                        of_leaf.add(sign * chunk.column(Layout::<D>::MASS)[p]);
                    }
                }
                of_leaf
            });
            let all = leaves.reduce(ExactSum::new, |mut sum, other| {
                sum.merge(&other);
                sum
            });
            sum.merge(&all);
        }
    }

    /// Collective. Mass that has passed each section, kg.
    pub fn passed<const D: usize>(&self, comm: &Comm, chunks: &[Chunk<D>]) -> Vec<f64> {
        let mut now = self.clone();
        now.add_beyond(chunks, 1.0);
        ExactSum::sum_over_ranks(comm, &mut now.sums);
        now.sums.iter().map(ExactSum::to_f64).collect()
    }
}
