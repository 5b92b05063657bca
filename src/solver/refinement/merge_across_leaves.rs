//! Merges of families that a face between leaves cuts in two.
use partition::comm::Disagreement;
use rayon::prelude::*;

use crate::adaptivity::resample::cell_fit::Resampling;
use crate::adaptivity::resample::family::separated;
use crate::adaptivity::resample::merge_backoff::{self, BackoffState};
use crate::grid::leaf_geometry::leaf_box;
use crate::particle::Chunk;
use crate::solver::migration::migrate::Moved;
use crate::solver::state::{Solver, StepError};

impl<const D: usize> Solver<D> {
    /// Collective. Merges families that a face between leaves cuts in two: their parts move to one leaf, and
    /// those that did not merge move back. Faces across one combination of axes are tried at a time, in turn
    /// from call to call. All particles must be in their leaves. Returns whether any rank merged any.
    ///
    /// # Errors
    /// On all ranks when a particle could not be moved.
    pub(super) fn reunite_families(&mut self, looks: &[BackoffState]) -> Result<bool, Disagreement> {
        let Some(adaptivity) = &self.physics.adaptivity else { return Ok(false) };
        let Some(limits) = adaptivity.merge else { return Ok(false) };
        let axes = ((self.clock.step / adaptivity.every) % ((1 << D) - 1) + 1) as usize;
        let scheme = self.physics.scheme();
        let extent = self.grid.plan.extent();
        let Some(resampling) = Resampling::new(self.physics.adaptivity.as_ref(), &scheme, extent) else {
            return Ok(false);
        };
        let (turns, root_edge) = (self.turns(), self.physics.root_edge);
        let leaves = self.chunks.par_iter().zip(self.forest.leaves()).zip(looks).zip(&turns);
        let apart: Vec<Vec<(u32, [f64; D])>> = leaves
            .with_min_len(8)
            .map(|(((chunk, leaf), look), &turn)| match look.due {
                true => {
                    let bounds = leaf_box(leaf, root_edge);
                    separated(chunk, &resampling.setting_at(leaf.level, turn), &limits, &bounds, axes)
                }
                false => Vec::new(),
            })
            .collect();
        if !self.comm.any(apart.iter().any(|apart| !apart.is_empty())) {
            return Ok(false);
        }
        let before: Vec<usize> = self.chunks.iter().map(Chunk::len).collect();
        let gathered = self.gather_in_leaves(&apart);
        // Leaves into which particles came. Counts alone do not show it where as many have gone.
        let came: Vec<bool> = (self.chunks.iter().zip(&before).zip(&apart))
            .map(|((chunk, &before), apart)| chunk.len() != before || !apart.is_empty())
            .collect();
        let reports = self.merge_in_leaves(false, |leaf| came[leaf]);
        self.chunks
            .iter_mut()
            .zip(&reports)
            .for_each(|(chunk, report)| merge_backoff::met(chunk, &report.refused));
        let merged = reports.iter().any(|report| report.merged > 0);
        let returned = self.send_home(|leaf| came[leaf]);
        self.comm.agree(gathered.and(returned))?;
        Ok(self.comm.any(merged))
    }

    /// Collective over neighbours. Moves particles of the wanted leaves that are not in their leaf to the one
    /// that contains them. None may be coarser than that.
    pub(super) fn send_home(&mut self, is_wanted: impl Fn(usize) -> bool + Sync) -> Result<Moved, StepError> {
        let root_edge = self.physics.root_edge;
        let leaves = self.chunks.par_iter().zip(self.forest.leaves()).enumerate().with_min_len(16);
        let strayed = leaves.map(|(number, (chunk, leaf))| {
            let (lower, upper) = leaf_box(leaf, root_edge);
            let particles = if is_wanted(number) { chunk.len() } else { 0 };
            let places = (0..particles).map(|p| (p as u32, chunk.position(p)));
            places.filter(|(_, x)| (0..D).any(|a| x[a] < lower[a] || x[a] >= upper[a])).collect()
        });
        let strayed: Vec<Vec<(u32, [f64; D])>> = strayed.collect();
        self.gather_in_leaves(&strayed)
    }

    /// Collective over neighbours. Moves particles of each own leaf into the leaves that contain the places
    /// with them.
    fn gather_in_leaves(&mut self, wanted: &[Vec<(u32, [f64; D])>]) -> Result<Moved, StepError> {
        let (grid, chunks) = (&mut self.grid, &mut self.chunks);
        Ok(grid.migration.gather(&grid.plan.tree, chunks, wanted)?)
    }
}
