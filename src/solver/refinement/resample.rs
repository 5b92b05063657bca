//! Splitting and merging of particles in a run, and the books about it.
use partition::Octant;
use partition::comm::Comm;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::adaptivity::resample::patience::{self, Look, Turn};
use crate::adaptivity::resample::{Merged, Setting, ids, merge, needs_split, split};
use crate::exact_sum::ExactSum;
use crate::kernel::{BoxPolicy, Scheme};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Tag};
use crate::solver::migration::migrate::leaf_box;
use crate::solver::step::grid::reach_of_width;
use crate::solver::step::survey::widest;
use crate::solver::{Physics, Solver};

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
pub(in crate::solver) struct Splits {
    split: u64,
    refused: u64,
    energies: Vec<f64>,
}

/// How particles follow the size of cells.
#[derive(Clone, Copy)]
pub(in crate::solver) struct Resampling<'a, const D: usize> {
    scheme: &'a Scheme<'a>,
    extent: [f64; D],
    nominal: &'a [f64],
    stretch: Option<f64>,
}

impl<'a, const D: usize> Resampling<'a, D> {
    /// For a domain with its upper corner at `extent` (m); `None` if the job wants particles left alone.
    pub fn new(physics: &'a Physics<D>, scheme: &'a Scheme<'a>, extent: [f64; D]) -> Option<Self> {
        let adaptivity = physics.adaptivity.as_ref()?;
        let (nominal, stretch) = (&adaptivity.nominal[..], adaptivity.split_stretch);
        Some(Self { scheme, extent, nominal, stretch })
    }

    fn setting(&self, level: u8) -> Setting<'a, D> {
        let (scheme, extent, nominal) = (self.scheme, self.extent, self.nominal);
        Setting { scheme, extent, level, nominal, turn: Turn::ALL }
    }

    /// For merges in a leaf of a level.
    pub(super) fn setting_at(&self, level: u8, turn: Turn) -> Setting<'a, D> {
        Setting { turn, ..self.setting(level) }
    }

    /// Splits the listed particles (ascending), whose affine state comes from cells of `level`.
    pub fn split(&self, chunk: &mut Chunk<D>, which: &[u32], level: u8, done: &mut Splits) {
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

    /// Whether particle `p` is to be split where it enters a leaf of a level: it was made for a coarser one.
    pub fn splits_in(&self, chunk: &Chunk<D>, p: usize, level: u8) -> bool {
        Tag::unpack(chunk.tags()[p]).level < level && ids::generation(chunk.ids()[p]) < ids::GENERATIONS
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
        if self.physics.adaptivity.is_none() {
            return Vec::new();
        }
        let turns = self.turns();
        let leaves = self.chunks.par_iter().zip(self.forest.leaves()).zip(&turns).enumerate();
        let surveys = Some(&self.surveys).filter(|surveys| surveys.len() == self.chunks.len());
        let each = leaves.with_min_len(64).map(|(number, ((chunk, leaf), &turn))| {
            // Who came in this very step can wait for the next time.
            let known = surveys.and_then(|surveys| surveys[number].levels?.look(leaf.level, turn));
            known.unwrap_or_else(|| patience::look(chunk, leaf.level, turn))
        });
        each.collect()
    }

    /// Not collective. Who is to be tried in each own leaf. While the grid is not that of the tree, leaves count as not
    /// beside finer ones.
    pub(super) fn turns(&self) -> Vec<Turn> {
        let every = self.physics.adaptivity.as_ref().map_or(1, |adaptivity| adaptivity.every);
        let regrid = self.clock.step / every;
        let (lists, root_edge) = (&self.grid.lists, self.physics.root_edge);
        let is_of_tree = self.grid.plan.revision == self.forest.revision();
        let leaves = self.forest.leaves().iter().enumerate();
        let each = leaves.map(|(number, leaf)| {
            let (lower, upper) = leaf_box(leaf, root_edge);
            let centre = std::array::from_fn(|a| 0.5 * (lower[a] + upper[a]));
            let beside_finer =
                is_of_tree && lists.is_finer_within(number, &centre, 0.75 * (upper[0] - lower[0]));
            Turn::new(regrid, leaf.key(), beside_finer)
        });
        each.collect()
    }

    /// Not collective. Splits particles that are too large for their leaf. `from[i]` is the level of the cells that
    /// the affine state in leaf i comes from, if the tree has changed. Returns in which leaves any was split.
    pub(super) fn split_particles(&mut self, looks: &[Look], from: Option<&[u8]>) -> Vec<bool> {
        let scheme = self.physics.scheme();
        let extent = crate::solver::step::transfer::extent(&self.grid.plan);
        let Some(resampling) = Resampling::new(&self.physics, &scheme, extent) else {
            return Vec::new();
        };
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).zip(&self.surveys).enumerate();
        let done = leaves.with_min_len(64).map(|(number, ((chunk, leaf), survey))| {
            let too_wide = |stretch| resampling.may_exceed(survey.width, leaf.level, stretch);
            let is_wanted = looks[number].coarser || resampling.stretch.is_some_and(too_wide);
            let from = from.map_or(leaf.level, |from| from[number]);
            is_wanted.then(|| resampling.fit(chunk, leaf.level, from))
        });
        let done: Vec<Option<Splits>> = done.collect();
        let books = &mut self.books;
        // A refusal is told again at each regrid, so the count is that of now.
        books.refused = 0;
        done.iter().flatten().for_each(|done| books.book_split(done));
        done.iter().map(|done| done.as_ref().is_some_and(|done| done.split > 0)).collect()
    }

    /// Not collective. Merges particles made for finer leaves than theirs, further than a cell from the next
    /// finer leaf, in the wanted leaves; strangers only on demand. Returns per leaf those that are to be named.
    pub(super) fn merge_in_leaves(
        &mut self,
        among_strangers: bool,
        is_wanted: impl Fn(usize) -> bool + Sync,
    ) -> Vec<Merged> {
        let scheme = self.physics.scheme();
        let extent = crate::solver::step::transfer::extent(&self.grid.plan);
        let resampling = Resampling::new(&self.physics, &scheme, extent);
        let limits = self.physics.adaptivity.as_ref().and_then(|a| a.merge);
        let Some((resampling, limits)) = resampling.zip(limits) else { return Vec::new() };
        let (turns, root_edge) = (self.turns(), self.physics.root_edge);
        let (plan, lists) = (&self.grid.plan, &self.grid.lists);
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).enumerate().with_min_len(8);
        let done: Vec<(Merged, Vec<f64>)> = leaves
            .map(|(number, (chunk, leaf)): (usize, (&mut Chunk<D>, &Octant<D>))| {
                let mut energies = Vec::new();
                let mut merged = Merged::default();
                if is_wanted(number) {
                    let cell = plan.cell(leaf.level);
                    let is_far = |x: [f64; D]| !lists.is_finer_within(number, &x, cell);
                    let setting = resampling.setting_at(leaf.level, turns[number]);
                    let bounds = leaf_box(leaf, root_edge);
                    let bounds = among_strangers.then_some(&bounds);
                    merged = merge(chunk, &setting, &limits, bounds, is_far, &mut |e| energies.push(e));
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

    /// Collective. Merges particles in leaves that are coarser than they are. Returns what was done in each own leaf.
    pub(super) fn merge_particles(&mut self, looks: &[Look]) -> Vec<Merged> {
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
        reports
    }

    /// Not collective. After all merges of a regrid: counts those that were tried in vain.
    pub(super) fn count_tries(&mut self, looks: &[Look], reports: &[Merged]) {
        let turns = self.turns();
        let leaves = self.chunks.par_iter_mut().zip(self.forest.leaves()).zip(looks).enumerate();
        let tried = leaves.with_min_len(64).filter(|(_, (_, look))| look.due || look.stale);
        tried.for_each(|(number, ((chunk, leaf), _))| {
            let nobody = FxHashSet::default();
            let refused = reports.get(number).map_or(&nobody, |report| &report.refused);
            patience::count(chunk, leaf.level, turns[number], refused);
        });
    }

    /// Not collective. Reach that merges of this rank's particles may need (see [`Solver::agreed_reach`]): with that the grid needs
    /// not be made anew for them.
    pub(in crate::solver) fn reach_of_merges(&self) -> u32 {
        let Some(adaptivity) = self.physics.adaptivity.as_ref().filter(|a| a.merge.is_some()) else {
            return 0;
        };
        let stretch = match self.physics.boxes {
            BoxPolicy::Fixed => 1.0,
            BoxPolicy::Volume { max_stretch, .. } => max_stretch,
            BoxPolicy::Cell => return 0,
        };
        // Half widths and cells are those of level 0 over the same power of two.
        let nominal = adaptivity.nominal.iter().copied().fold(0.0, f64::max);
        let reach = reach_of_width(stretch * nominal / (0.25 * self.physics.root_edge));
        let has_finer = |(chunk, leaf): (&Chunk<D>, &Octant<D>)| {
            chunk.tags().iter().any(|&tag| Tag::unpack(tag).level > leaf.level)
        };
        if reach > 0 && self.chunks.iter().zip(self.forest.leaves()).any(has_finer) { reach } else { 0 }
    }

    /// Collective. The root after the highest that any living particle's identifier has.
    pub(in crate::solver) fn first_free_root(&self) -> u64 {
        let mut next = [self.chunks.iter().filter_map(ids::highest_root).max().map_or(0, |root| root + 1)];
        self.comm.max_u64(&mut next);
        next[0]
    }

    /// Books of splits on the way to other leaves.
    pub(in crate::solver) fn book_entries(&mut self, splits: &[Splits]) {
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
