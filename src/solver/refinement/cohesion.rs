//! Elastic bodies that are stretched hold together: their particles are halved, and become whole again.
use std::time::Instant;

use partition::comm::Disagreement;
use rayon::prelude::*;

use crate::adaptivity::resample::cell_fit::Splits;
use crate::adaptivity::resample::halve::{self, may_be_wide};
use crate::adaptivity::resample::merge_backoff::RetrySlot;
use crate::adaptivity::resample::{Limits, Setting};
use crate::particle::halvings;
use crate::solver::state::phases::Phase;
use crate::solver::state::{Solver, StepError};

/// Steps from one look at the widths of boxes to the next.
const WIDTHS_EVERY: u64 = 8;
/// Steps from one look for halves that may become one to the next.
const HALVES_EVERY: u64 = 64;

impl<const D: usize> Solver<D> {
    /// Not collective. Whether the widths of elastic boxes are looked at after the step of a number (the
    /// first is 1).
    pub(in crate::solver) fn looks_at_widths(&self, step: u64) -> bool {
        self.physics.cohesion.is_some() && step.is_multiple_of(WIDTHS_EVERY)
    }

    /// Not collective. After a step: whether boxes of this rank may have to be halved.
    pub(in crate::solver) fn has_wide_boxes(&self) -> bool {
        let leaves = self.forest.leaves().iter().zip(&self.leaf_data.maxima);
        let mut wide = leaves.map(|(leaf, maxima)| {
            may_be_wide(maxima.elastic_width, self.physics.root_edge / f64::from(4_u32 << leaf.level))
        });
        self.looks_at_widths(self.clock.step) && wide.any(|is_wide| is_wide)
    }

    /// Collective. Whether any particle has been halved.
    pub(in crate::solver) fn find_halves(&self) -> bool {
        let own = self.chunks.iter().any(|chunk| halvings::is_any(chunk.tags().iter().copied()));
        self.comm.any(own)
    }

    /// Collective. After a step: halves elastic particles that have become too wide, and makes whole again
    /// those that no longer are, if the step is one at which this is due. Returns whether anything changed.
    ///
    /// # Errors
    /// On all ranks when a particle could not be moved.
    pub(super) fn hold_together(&mut self) -> Result<bool, Disagreement> {
        let Some(cohesion) = &self.physics.cohesion else { return Ok(false) };
        let halves = std::mem::take(&mut self.adaptation.has_wide);
        let rejoins = self.physics.has_halves && self.clock.step.is_multiple_of(HALVES_EVERY);
        if !halves && !rejoins {
            return Ok(false);
        }
        let (start, phases) = (Instant::now(), self.phases);
        let scheme = self.physics.scheme();
        let (extent, root_edge) = (self.grid.plan.extent(), self.physics.root_edge);
        let nominal = &cohesion.nominal[..];
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).zip(&self.leaf_data.maxima);
        let done = leaves.with_min_len(16).map(|((chunk, leaf), maxima)| {
            let (level, turn) = (leaf.level, RetrySlot::ALL);
            let setting = Setting { scheme: &scheme, extent, level, nominal, turn, solid_strangers: false };
            let mut splits = Splits::default();
            let cell = root_edge / f64::from(4_u32 << leaf.level);
            if halves && may_be_wide(maxima.elastic_width, cell) {
                let energies = &mut splits.energies;
                let report = halve::halve(chunk, &setting, &mut |e| energies.push(e));
                (splits.split, splits.refused) = (report.split, report.refused);
            }
            let mut energies = Vec::new();
            let is_any = rejoins && halvings::is_any(chunk.tags().iter().copied());
            let merged = if is_any {
                halve::rejoin(chunk, &setting, &Limits::default(), &mut |e| energies.push(e)).merged
            } else {
                0
            };
            (splits, merged, energies)
        });
        let done: Vec<(Splits, u64, Vec<f64>)> = done.collect();
        for (splits, merged, energies) in &done {
            self.adaptation.ledger.halved += splits.split;
            self.adaptation.ledger.enter_splits(splits);
            (self.adaptation.ledger.merges, self.adaptation.ledger.removed) =
                (self.adaptation.ledger.merges + merged, self.adaptation.ledger.removed + merged);
            energies.iter().for_each(|&energy| self.adaptation.ledger.merge_energy.add(energy));
        }
        let is_changed = |leaf: usize| done[leaf].0.is_any() || done[leaf].1 > 0;
        let is_any = [done.iter().any(|done| done.0.is_any()), (0..done.len()).any(is_changed)];
        let mut flags = is_any.map(u64::from);
        self.comm.max_u64(&mut flags);
        let [is_halved, is_other] = flags.map(|flag| flag > 0);
        if is_halved && !self.physics.has_halves {
            self.physics.has_halves = true;
            self.adaptation.pieces_before = self.pieces().unwrap_or_default();
        }
        if is_other {
            let moved = self.migrate(is_changed).map_err(StepError::from);
            self.comm.agree(moved)?;
            self.leaf_data.signal = self.signals_at_rest();
            let bound = self.comm.min_f64(self.local_bound());
            self.clock.bound = self.clock.bound.min(bound);
            let mut reach = [u64::from(self.reach_now())];
            self.comm.max_u64(&mut reach);
            self.provide_reach(reach[0] as u32);
        }
        // One phase for all of it.
        self.phases = phases;
        self.phases.book(Phase::Regrid, start.elapsed());
        Ok(is_other)
    }
}
