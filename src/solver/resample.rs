//! Splitting and merging of particles in a run, and the books about it.
use partition::Octant;
use partition::comm::{Comm, Disagreement};
use rayon::prelude::*;

use super::migrate::leaf_box;
use super::survey::widest;
use super::{Physics, Solver, StepError};
use crate::exact_sum::ExactSum;
use crate::kernel::Scheme;
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Tag};
use crate::particle::resample::family::separated;
use crate::particle::resample::patience::{self, Look};
use crate::particle::resample::{Merged, Setting, ids, merge, needs_split, split};

/// What splitting and merging have done since the start of the run. Sums of this rank, but for the root.
#[derive(Clone, Debug, Default)]
pub struct Books {
    /// Particles that were split.
    pub splits: u64,
    /// Particles that could not be split: their identifiers have no room for another generation.
    pub refused: u64,
    /// Particles that stand for several that were merged.
    pub merges: u64,
    /// Particles that went away in merges.
    pub removed: u64,
    /// Kinetic energy that splits took out of affine velocities, J.
    pub split_energy: ExactSum,
    /// Kinetic energy that merges removed, J.
    pub merge_energy: ExactSum,
    /// The first root that no particle's identifier has had; the same on all ranks.
    pub next_root: u64,
}

/// The books of all ranks together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BooksTotal {
    /// See [`Books::splits`].
    pub splits: u64,
    /// See [`Books::refused`].
    pub refused: u64,
    /// See [`Books::merges`].
    pub merges: u64,
    /// See [`Books::removed`].
    pub removed: u64,
    /// See [`Books::split_energy`].
    pub split_energy: f64,
    /// See [`Books::merge_energy`].
    pub merge_energy: f64,
}

impl Books {
    /// Collective. Counts of all ranks and the words of the two energies, as a checkpoint needs them.
    pub fn gather(&self, comm: &Comm) -> ([u64; 4], [ExactSum; 2]) {
        let mut counts = [self.splits, self.refused, self.merges, self.removed];
        comm.sum_u64(&mut counts);
        let mut energies = [self.split_energy.clone(), self.merge_energy.clone()];
        ExactSum::sum_over_ranks(comm, &mut energies);
        (counts, energies)
    }

    /// Collective. Totals of all ranks; energies are exact before they are rounded once.
    pub fn total(&self, comm: &Comm) -> BooksTotal {
        let ([splits, refused, merges, removed], [split_energy, merge_energy]) = self.gather(comm);
        let (split_energy, merge_energy) = (split_energy.to_f64(), merge_energy.to_f64());
        BooksTotal { splits, refused, merges, removed, split_energy, merge_energy }
    }

    fn book_split(&mut self, done: &Splits) {
        self.splits += done.split;
        self.refused += done.refused;
        done.energies.iter().for_each(|&energy| self.split_energy.add(energy));
    }
}

/// Splits in one leaf.
#[derive(Clone, Debug, Default)]
pub(super) struct Splits {
    split: u64,
    refused: u64,
    energies: Vec<f64>,
}

/// How particles follow the size of cells.
#[derive(Clone, Copy)]
pub(super) struct Resampling<'a, const D: usize> {
    scheme: &'a Scheme<'a>,
    extent: [f64; D],
    nominal: &'a [f64],
    stretch: Option<f64>,
    turn: u64,
}

impl<'a, const D: usize> Resampling<'a, D> {
    /// For a domain with its upper corner at `extent` (m); `None` if the job wants particles left alone.
    pub fn new(physics: &'a Physics<D>, scheme: &'a Scheme<'a>, extent: [f64; D], step: u64) -> Option<Self> {
        let adaptivity = physics.adaptivity.as_ref()?;
        let (nominal, stretch) = (&adaptivity.nominal[..], adaptivity.split_stretch);
        Some(Self { scheme, extent, nominal, stretch, turn: step / adaptivity.every })
    }

    fn setting(&self, level: u8) -> Setting<'a, D> {
        Setting { scheme: self.scheme, extent: self.extent, level, nominal: self.nominal, turn: self.turn }
    }

    /// Splits the listed particles (ascending), whose affine state comes from cells of `level`.
    fn split(&self, chunk: &mut Chunk<D>, which: &[u32], level: u8, done: &mut Splits) {
        let cell = self.scheme.root_cell / f64::from(1u32 << level);
        let spreads: Vec<[f64; D]> = which
            .iter()
            .map(|&p| {
                let half = chunk.column(Layout::<D>::HALF)[p as usize];
                chunk.position(p as usize).map(|x| spread_on_lattice(x, half, cell))
            })
            .collect();
        let report = split(chunk, &self.setting(level), which, &spreads, &mut |e| done.energies.push(e));
        done.split += report.split;
        done.refused += report.refused;
    }

    /// Splits particles of a leaf that are too large for it until none is. Their affine state comes from cells of
    /// level `from`.
    fn fit(&self, chunk: &mut Chunk<D>, level: u8, from: u8) -> Splits {
        let mut done = Splits::default();
        loop {
            let stretch = self.stretch.filter(|&stretch| self.may_exceed(widest(chunk), level, stretch));
            let wanted = needs_split(chunk, &self.setting(level), stretch);
            if wanted.which.is_empty() {
                done.refused += wanted.refused;
                return done;
            }
            self.split(chunk, &wanted.which, from, &mut done);
        }
    }

    /// Whether boxes up to `width` (m) may be wider than `stretch` times that of an undeformed particle of a level.
    fn may_exceed(&self, width: f64, level: u8, stretch: f64) -> bool {
        let least = self.nominal.iter().copied().fold(f64::INFINITY, f64::min);
        width.is_nan() || width > 0.999 * stretch * least / f64::from(1u32 << level)
    }

    /// Splits those among `leavers` (index, level of the leaf they enter) that enter a leaf finer than they were made
    /// for. Returns whether there were any; indices are other ones then.
    pub fn enter(
        &self,
        chunk: &mut Chunk<D>,
        level: u8,
        leavers: impl Iterator<Item = (u32, u8)>,
        done: &mut Splits,
    ) -> bool {
        let is_coarse = |&(p, entered): &(u32, u8)| {
            Tag::unpack(chunk.tags()[p as usize]).level < entered
                && ids::generation(chunk.ids()[p as usize]) < ids::GENERATIONS
        };
        let which: Vec<u32> = leavers.filter(is_coarse).map(|(p, _)| p).collect();
        if which.is_empty() {
            return false;
        }
        self.split(chunk, &which, level, done);
        true
    }
}

/// Second moment of the weights of a box on a lattice of nodes, along one axis: `l²/3 + mean of d (h - d)`, where d
/// is the distance to the node below, m². The first part is that of the box, the second that of linear
/// interpolation between two nodes.
fn spread_on_lattice(x: f64, half: f64, cell: f64) -> f64 {
    let inside = |y: f64| y - cell * (y / cell).floor();
    let box_part = half * half / 3.0;
    if half < 1e-4 * cell {
        let d = inside(x);
        return f64::mul_add(d, cell - d, box_part).max(f64::MIN_POSITIVE);
    }
    // Integral of d (h - d) from 0, each whole cell h³/6.
    let integral = |y: f64| {
        let d = inside(y);
        (y / cell).floor() * cell.powi(3) / 6.0 + d * d * (cell / 2.0 - d / 3.0)
    };
    box_part + ((integral(x + half) - integral(x - half)) / (2.0 * half)).max(0.0)
}

impl<const D: usize> Solver<D> {
    /// Not collective. How the particles of each own leaf fit it.
    pub(super) fn look_at_levels(&self) -> Vec<Look> {
        let Some(adaptivity) = &self.physics.adaptivity else { return Vec::new() };
        let turn = self.clock.step / adaptivity.every;
        let leaves = self.chunks.par_iter().zip(self.forest.leaves()).with_min_len(64);
        leaves.map(|(chunk, leaf)| patience::look(chunk, leaf.level, turn)).collect()
    }

    /// Not collective. Splits particles that are too large for their leaf. `from[i]` is the level of the cells that
    /// the affine state in leaf i comes from, if the tree has changed. Returns whether any was split.
    pub(super) fn split_particles(&mut self, looks: &[Look], from: Option<&[u8]>) -> bool {
        let scheme = self.physics.scheme();
        let extent = super::transfer::extent(&self.grid.plan);
        let Some(resampling) = Resampling::new(&self.physics, &scheme, extent, self.clock.step) else {
            return false;
        };
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).zip(&self.surveys).enumerate();
        let done = leaves.with_min_len(64).filter_map(|(number, ((chunk, leaf), survey))| {
            let too_wide = |stretch| resampling.may_exceed(survey.width, leaf.level, stretch);
            let is_wanted = looks[number].coarser || resampling.stretch.is_some_and(too_wide);
            let from = from.map_or(leaf.level, |from| from[number]);
            is_wanted.then(|| resampling.fit(chunk, leaf.level, from))
        });
        let done: Vec<Splits> = done.collect();
        let books = &mut self.books;
        // A refusal is told again at each regrid, so the count is that of now.
        books.refused = 0;
        done.iter().for_each(|done| books.book_split(done));
        done.iter().any(|done| done.split > 0)
    }

    /// Not collective. Merges particles made for finer leaves than theirs, further than a cell from the next
    /// finer leaf, in the wanted leaves; strangers only on demand. Returns per leaf those that are to be named.
    fn merge_in_leaves(
        &mut self,
        among_strangers: bool,
        is_wanted: impl Fn(usize) -> bool + Sync,
    ) -> Vec<Merged> {
        let scheme = self.physics.scheme();
        let extent = super::transfer::extent(&self.grid.plan);
        let resampling = Resampling::new(&self.physics, &scheme, extent, self.clock.step);
        let limits = self.physics.adaptivity.as_ref().and_then(|a| a.merge);
        let Some((resampling, limits)) = resampling.zip(limits) else { return Vec::new() };
        let (plan, lists) = (&self.grid.plan, &self.grid.lists);
        let root_edge = self.physics.root_edge;
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).enumerate().with_min_len(8);
        let done: Vec<(Merged, Vec<f64>)> = leaves
            .map(|(number, (chunk, leaf)): (usize, (&mut Chunk<D>, &Octant<D>))| {
                let mut energies = Vec::new();
                let mut merged = Merged::default();
                if is_wanted(number) {
                    let cell = plan.cell(leaf.level);
                    let is_far = |x: [f64; D]| !lists.is_finer_within(number, &x, cell);
                    let setting = resampling.setting(leaf.level);
                    let bounds = leaf_box(leaf, root_edge);
                    let bounds = among_strangers.then_some(&bounds);
                    merged = merge(chunk, &setting, &limits, bounds, is_far, &mut |e| energies.push(e));
                    patience::count_refused(chunk, &merged.refused);
                }
                (merged, energies)
            })
            .collect();
        let mut reports = Vec::with_capacity(done.len());
        for (merged, energies) in done {
            self.books.merges += merged.merged;
            self.books.removed += merged.removed;
            energies.iter().for_each(|&energy| self.books.merge_energy.add(energy));
            reports.push(merged);
        }
        reports
    }

    /// Collective. Merges families that a face between leaves cuts in two: their parts meet in one leaf, and those that did not merge go
    /// back. Faces across one combination of axes are tried at a time, in turn from call to call. All particles must be
    /// in their leaves. Returns whether any rank merged any.
    ///
    /// # Errors
    /// On all ranks when a particle could not be moved.
    pub(super) fn reunite_families(&mut self, looks: &[Look]) -> Result<bool, Disagreement> {
        let Some(adaptivity) = &self.physics.adaptivity else { return Ok(false) };
        let Some(limits) = adaptivity.merge else { return Ok(false) };
        let axes = ((self.clock.step / adaptivity.every) % ((1 << D) - 1) + 1) as usize;
        let scheme = self.physics.scheme();
        let extent = super::transfer::extent(&self.grid.plan);
        let Some(resampling) = Resampling::new(&self.physics, &scheme, extent, self.clock.step) else {
            return Ok(false);
        };
        let root_edge = self.physics.root_edge;
        let leaves = self.chunks.par_iter().zip(self.forest.leaves()).zip(looks).with_min_len(8);
        let apart: Vec<Vec<(u32, [f64; D])>> = leaves
            .map(|((chunk, leaf), look)| match look.due {
                true => {
                    let bounds = leaf_box(leaf, root_edge);
                    separated(chunk, &resampling.setting(leaf.level), &limits, &bounds, axes)
                }
                false => Vec::new(),
            })
            .collect();
        if !self.comm.any(apart.iter().any(|apart| !apart.is_empty())) {
            return Ok(false);
        }
        let (grid, chunks) = (&mut self.grid, &mut self.chunks);
        let before: Vec<usize> = chunks.iter().map(Chunk::len).collect();
        let gathered = grid.migration.gather(&grid.plan.tree, chunks, &apart);
        let gathered = gathered.map_err(StepError::from);
        // Where somebody came; numbers tell unless as many went.
        let came: Vec<bool> = (self.chunks.iter().zip(&before).zip(&apart))
            .map(|((chunk, &before), apart)| chunk.len() != before || !apart.is_empty())
            .collect();
        let merged = self.merge_in_leaves(false, |leaf| came[leaf]).iter().any(|report| report.merged > 0);
        let returned = self.migrate().map_err(StepError::from);
        self.comm.agree(gathered.and(returned))?;
        Ok(self.comm.any(merged))
    }

    /// Collective. Merges particles in leaves that are coarser than they are. Returns whether this rank merged any.
    pub(super) fn merge_particles(&mut self, looks: &[Look]) -> bool {
        let reports = self.merge_in_leaves(true, |leaf| looks[leaf].due);
        // Groups that are no family get roots of their own, counted along the curve.
        let strangers: u64 = reports.iter().map(|report| report.unnamed.len() as u64).sum();
        let mut total = [strangers];
        self.comm.sum_u64(&mut total);
        if total[0] > 0 && self.books.next_root + total[0] <= ids::roots(D) {
            let mut root = self.books.next_root + self.comm.exclusive_sum_u64(strangers);
            for (chunk, report) in self.chunks.iter_mut().zip(&reports) {
                for &p in &report.unnamed {
                    chunk.ids_mut()[p as usize] = root;
                    root += 1;
                }
            }
            self.books.next_root += total[0];
        }
        reports.iter().any(|report| report.merged > 0)
    }

    /// Not collective. After all merges of a regrid: counts those that were tried in vain.
    pub(super) fn count_tries(&mut self, looks: &[Look]) {
        let Some(adaptivity) = &self.physics.adaptivity else { return };
        let turn = self.clock.step / adaptivity.every;
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).zip(looks).with_min_len(64);
        leaves.filter(|(_, look)| look.due || look.stale).for_each(|((chunk, leaf), _)| {
            patience::count(chunk, leaf.level, turn);
        });
    }

    /// Collective. The root after the highest that any living particle's identifier has.
    pub(super) fn first_free_root(&self) -> u64 {
        let mut next = [self.chunks.iter().filter_map(ids::highest_root).max().map_or(0, |root| root + 1)];
        self.comm.max_u64(&mut next);
        next[0]
    }

    /// Books of splits on the way to other leaves.
    pub(super) fn book_entries(&mut self, splits: &[Splits]) {
        splits.iter().for_each(|done| self.books.book_split(done));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the sums over nodes and points of a fine quadrature.
    #[test]
    fn spread_is_the_second_moment_of_the_weights() {
        let cell = 0.2;
        for (x, half) in [(0.53, 0.05), (0.6, 0.1), (0.47, 0.1), (0.71, 0.02), (0.65, 0.25), (0.55, 1e-7)] {
            let (mut sum, points) = (0.0, 20_000);
            for i in 0..points {
                let y: f64 = x + half * (2.0 * (f64::from(i) + 0.5) / f64::from(points) - 1.0);
                let below = (y / cell).floor();
                let share = y / cell - below;
                let squared = |node: f64| (node * cell - x) * (node * cell - x);
                sum += (1.0 - share) * squared(below) + share * squared(below + 1.0);
            }
            approx::assert_relative_eq!(
                spread_on_lattice(x, half, cell),
                sum / f64::from(points),
                max_relative = 1e-6
            );
        }
    }
}
