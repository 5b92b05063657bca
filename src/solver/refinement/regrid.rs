//! One regrid: criteria, refinement and coarsening, splitting and merging.
use std::time::Instant;

use partition::comm::Disagreement;
use partition::{Forest, MAX_LEVEL, Mark, Octant, Region, correspondence};
use rayon::prelude::*;

use crate::adaptivity::{Adaptivity, LeafMaxima, Value};
use crate::geometry::Aabb;
use crate::grid::leaf_geometry::{leaf_box, position_key};
use crate::leapfrog::Lengths;
use crate::particle::Chunk;
use crate::solver::migration::error::MigrateError;
use crate::solver::migration::migrate::Moved;
use crate::solver::state::phases::Phase;
use crate::solver::state::regrid_cache::{SettledTree, Wish};
use crate::solver::state::regrid_timers::Part;
use crate::solver::state::{Solver, StepError};

/// A region with the level that all leaves which intersect it must have at least.
type Request<const D: usize> = (Region<D>, u32);

/// Displacement that does not count as motion, as a share of the edge of a finest leaf: a tenth of a cell.
/// Material that creeps at rest shall not refine its surroundings.
const CREEP: f64 = 0.025;

/// An octant's box with a layer around, below and above, without its surface, so that it intersects only
/// leaves that overlap it.
fn grown<const D: usize>(octant: &Octant<D>, [below, above]: [[u32; D]; 2]) -> Region<D> {
    let (lower, upper) = (octant.lower(), octant.upper());
    Region {
        lo: std::array::from_fn(|a| (lower[a] + 1).saturating_sub(below[a])),
        hi: std::array::from_fn(|a| (upper[a] - 1).saturating_add(above[a])),
    }
}

/// Refinement of each own leaf, for files.
#[derive(Clone, Debug, Default)]
pub struct Refinement {
    /// Urgency of refinement by the most urgent criterion: 1 where refinement begins.
    pub urgency: Vec<f64>,
    /// Level that the criteria want for the leaf itself; 0 if none does.
    pub wanted: Vec<f64>,
}

impl<const D: usize> Solver<D> {
    /// Not collective. Records the bounds of each leaf's state as it is now; rates stay.
    pub(in crate::solver) fn survey_now(&mut self) {
        let Some(adaptivity) = &self.physics.adaptivity else { return };
        let watch = adaptivity.watch(0);
        self.leaf_data.maxima.resize(self.chunks.len(), LeafMaxima::default());
        self.leaf_data
            .maxima
            .iter_mut()
            .zip(&self.chunks)
            .for_each(|(maxima, chunk)| watch.look(chunk, maxima));
    }
}

impl<const D: usize> Solver<D> {
    /// Collective. After a step: halves stretched particles, changes the tree where the job's criteria want
    /// it, and splits and merges particles, if the step is one at which this is due. Everything follows from
    /// the state alone. Returns whether anything changed.
    ///
    /// # Errors
    /// On all ranks when any rank failed.
    pub fn regrid(&mut self) -> Result<bool, Disagreement> {
        let is_halved = self.hold_together()?;
        let every = match &self.physics.adaptivity {
            Some(adaptivity) if self.clock.step.is_multiple_of(adaptivity.every) => adaptivity.every,
            _ => return Ok(is_halved),
        };
        let (start, phases) = (Instant::now(), self.phases);
        self.adaptation.timers.begin();
        if self.leaf_data.maxima.len() != self.chunks.len() {
            self.survey_now();
        }
        let levels_before = self.change_tree(every);
        let is_new = levels_before.is_some();
        let mut looks = self.look_at_levels();
        let mut split_in = self.split_particles(&looks, levels_before.as_deref());
        let is_split = split_in.contains(&true);
        self.adaptation.timers.end(Part::Split);
        if is_new && self.rebalance() {
            // Children may have come with leaves of other ranks.
            split_in = vec![true; self.chunks.len()];
        }
        if is_new || is_split {
            looks = self.look_at_levels();
        }
        let is_due = self.physics.adaptivity.as_ref().is_some_and(|adaptivity| adaptivity.merge.is_some())
            && looks.iter().any(|look| look.due || look.stale);
        let mut flags = [u64::from(is_new || is_split), u64::from(is_due)];
        self.comm.max_u64(&mut flags);
        let [is_other, is_due] = flags.map(|flag| flag > 0);
        let reports = if is_due { self.merge_particles(&looks) } else { Vec::new() };
        let mut merged = is_due && self.comm.any(reports.iter().any(|report| report.merged > 0));
        self.adaptation.timers.end(Part::Merge);
        if is_other || merged {
            // Children may lie beyond the faces of their leaf. Merged particles do not, but for rounding.
            let is_merged = |leaf: usize| reports.get(leaf).is_some_and(|report| report.merged > 0);
            let may_stray = |leaf: usize| split_in.get(leaf) == Some(&true) || is_merged(leaf);
            let moved: Result<Moved, StepError> = match is_other {
                true => self.migrate(may_stray).map_err(|error: MigrateError| error.into()),
                false => self.send_home(is_merged),
            };
            self.comm.agree(moved)?;
        }
        self.adaptation.timers.end(Part::Migrate);
        if is_due {
            merged |= self.reunite_families(&looks)?;
            self.count_tries(&looks, &reports);
            self.adaptation.timers.end(Part::Merge);
        }
        if is_other {
            // Merged particles are no faster than the fastest of their members.
            self.leaf_data.signal = self.signals_at_rest();
            let bound = self.comm.min_f64(self.local_bound());
            self.clock.bound = self.clock.bound.min(bound);
            self.adaptation.regrids += u64::from(is_new);
        }
        if is_other || merged {
            // A particle that has moved may have a box that is wide for its new leaf.
            let mut reach = [u64::from(self.reach_now())];
            self.comm.max_u64(&mut reach);
            self.provide_reach(reach[0] as u32);
        }
        self.adaptation.timers.end(Part::Migrate);
        // All of it counts as one phase.
        self.phases = phases;
        self.phases.book(Phase::Regrid, start.elapsed());
        Ok(is_halved || is_other || merged)
    }

    /// Collective. Values of the criteria in the state after P2G, for the choice of the first tree: whether
    /// the tree had to change. Particles of a changed tree are to be made anew.
    pub fn regrid_before_start(&mut self) -> bool {
        let refining = self.physics.adaptivity.as_ref().filter(|adaptivity| adaptivity.is_refining());
        let Some(steps) = refining.map(|adaptivity| adaptivity.every) else { return false };
        self.nodes_of_state();
        self.survey_now();
        self.change_tree(steps).is_some()
    }

    /// Collective. Velocities and masses of the nodes as the particles have them between two steps.
    fn nodes_of_state(&mut self) {
        let phases = self.phases;
        // A box without a bin is reported by the next step, which fails.
        let _ = self.sort_into_bins();
        self.nodes_from_particles(0.0, &[]);
        let rates = self.collider_rates(0.0);
        let _ = self.update_node_velocities(Lengths::NONE, &rates);
        self.phases = phases;
    }

    /// Collective. Refines and coarsens, and moves particles to the leaves that contain them; the partition
    /// stays. If any leaf of any rank changed: the level of the leaf that each own leaf's particles come
    /// from. The next time is in `steps`.
    fn change_tree(&mut self, steps: u64) -> Option<Vec<u8>> {
        let wishes = self.wishes(steps);
        self.adaptation.timers.end(Part::Criteria);
        let revision = self.forest.revision();
        let settled = self.adaptation.cache.settled.as_ref().filter(|settled| settled.revision == revision);
        if !self.comm.any(settled.is_none_or(|settled| settled.wishes != wishes)) {
            self.adaptation.timers.end(Part::Tree);
            return None;
        }
        let adaptivity = self.physics.adaptivity.as_ref()?;
        let requests = self.requests(adaptivity, &wishes);
        let requests = self.forest.to_owners(&self.comm, &requests);
        let marks = self.marks(adaptivity, &self.forest, &requests, true);
        let is_new = self.comm.any(settled.is_none_or(|settled| settled.marks != marks));
        let followed = is_new.then(|| self.followed(adaptivity, &requests, &marks));
        // 2:1 balance may undo the coarsening.
        let followed = followed.filter(|forest| self.comm.any(forest.leaves() != self.forest.leaves()));
        let Some(followed) = followed else {
            self.adaptation.cache.settled = Some(SettledTree { revision, wishes, marks });
            self.adaptation.timers.end(Part::Tree);
            return None;
        };
        let old = std::mem::replace(&mut self.forest, followed);
        self.adaptation.timers.end(Part::Tree);
        Some(self.move_to_leaves(old.leaves()))
    }

    /// Collective. Levels that the criteria ask for in and around each own leaf for the next `steps`.
    fn wishes(&mut self, steps: u64) -> Vec<Wish<D>> {
        let values = self.indicators();
        let Some(adaptivity) = &self.physics.adaptivity else { return Vec::new() };
        let count = adaptivity.criteria.len();
        // One step more than the interval, as particles may have come from a neighbouring leaf in this one.
        let interval = (steps + 1) as f64 * self.clock.dt;
        let per_edge = adaptivity.finest_edges_per_metre(self.physics.root_edge);
        let way =
            |velocity: f64| f64::mul_add(velocity.abs() * interval, per_edge, -CREEP).ceil().max(0.0) as u32;
        let leaves =
            self.forest.leaves().par_iter().zip(&self.chunks).zip(&self.leaf_data.maxima).enumerate();
        let each = leaves.with_min_len(64).map(|(number, ((leaf, chunk), maxima))| {
            let values = &values[number * count..][..count];
            let levels = if chunk.is_empty() { 0 } else { wanted_levels(adaptivity, leaf.level, values) };
            match levels {
                0 => Wish::NONE,
                _ => Wish { levels, way: maxima.velocity.map(|side| side.map(way)) },
            }
        });
        each.collect()
    }

    /// Not collective. Requests to the leaves around that follow from the wishes.
    fn requests(&self, adaptivity: &Adaptivity<D>, wishes: &[Wish<D>]) -> Vec<Request<D>> {
        let leaves = self.forest.leaves();
        let edge = 1 << (MAX_LEVEL - adaptivity.finest_level());
        let mut requests = Vec::new();
        let mut leaf = 0;
        while leaf < leaves.len() {
            // A family whose members have the same wish makes one request; most do.
            let family = leaf..leaf + Octant::<D>::CHILDREN;
            let alike = leaves.get(family.clone()).and_then(|members| {
                let parent = members[0].parent()?;
                let whole = members.iter().enumerate().all(|(child, member)| *member == parent.child(child));
                let same = wishes[family.clone()].iter().all(|wish| wish.levels == wishes[leaf].levels);
                (whole && same).then_some(parent)
            });
            let (octant, members) = alike.map_or((leaves[leaf], leaf..leaf + 1), |parent| (parent, family));
            let way = wishes[members.clone()].iter().fold([[0; D]; 2], |most: [[u32; D]; 2], wish| {
                std::array::from_fn(|side| std::array::from_fn(|a| most[side][a].max(wish.way[side][a])))
            });
            let mut widest = None;
            for level in (0..=MAX_LEVEL).rev().filter(|level| wishes[leaf].levels >> level & 1 == 1) {
                let buffer = adaptivity.buffer << (MAX_LEVEL - level);
                // A request for a finer level over the same distance implies this one.
                if widest.replace(buffer) != Some(buffer) {
                    let growth =
                        way.map(|side| side.map(|way| buffer.saturating_add(way.saturating_mul(edge))));
                    requests.push((grown(&octant, growth), u32::from(level)));
                }
            }
            leaf = members.end;
        }
        requests
    }

    /// Not collective. Mark of each own leaf of a tree, from all requests.
    fn marks(
        &self,
        adaptivity: &Adaptivity<D>,
        forest: &Forest<D>,
        requests: &[Request<D>],
        may_coarsen: bool,
    ) -> Vec<Mark> {
        let least = |leaf: &Octant<D>| {
            let (lower, upper) = leaf_box(leaf, self.physics.root_edge);
            adaptivity.least_level(&Aabb::new(lower, upper))
        };
        let mut wanted: Vec<u8> = forest.leaves().iter().map(least).collect();
        for (region, level) in requests {
            forest.own_leaves_in(region, &mut |leaf| wanted[leaf] = wanted[leaf].max(*level as u8));
        }
        let each = forest.leaves().iter().zip(&wanted);
        each.map(|(leaf, &wanted)| match wanted.cmp(&leaf.level) {
            std::cmp::Ordering::Greater => Mark::Refine,
            std::cmp::Ordering::Less if may_coarsen => Mark::Coarsen,
            _ => Mark::Keep,
        })
        .collect()
    }

    /// Collective. The tree with own leaves refined to what is requested, families coarsened by one level
    /// where nothing objects, and balanced. `marks` are those of the first pass.
    fn followed(&self, adaptivity: &Adaptivity<D>, requests: &[Request<D>], marks: &[Mark]) -> Forest<D> {
        let mut forest = self.forest.clone();
        if !forest.adapt(&self.comm, marks) {
            return forest;
        }
        // The partition keeps families together until the tree changes, so only the first pass may coarsen.
        while forest.adapt(&self.comm, &self.marks(adaptivity, &forest, requests, false)) {}
        if self.physics.graded {
            forest.balance(&self.comm);
        }
        forest
    }

    /// Moves particles from old leaves to those that contain them now. Returns the level of the old leaf of
    /// each.
    fn move_to_leaves(&mut self, old: &[Octant<D>]) -> Vec<u8> {
        let new = self.forest.leaves();
        let mut sources = std::mem::take(&mut self.chunks);
        let mut levels = vec![0; new.len()];
        let mut chunks: Vec<Chunk<D>> = new.iter().map(|_| Chunk::new()).collect();
        // The bounds of leaves that change are unknown; an infinite width has their particles examined.
        let mut maxima = vec![LeafMaxima { width: f64::INFINITY, ..LeafMaxima::default() }; new.len()];
        let (roots, root_edge) = (self.forest.brick().roots, self.physics.root_edge);
        for (from, to) in correspondence(old, new) {
            let finest = old[from.clone()].iter().map(|leaf| leaf.level).max().unwrap_or(0);
            levels[to.clone()].fill(finest);
            if from.len() == 1 && to.len() == 1 {
                chunks[to.start] = std::mem::take(&mut sources[from.start]);
                maxima[to.start] = self.leaf_data.maxima[from.start];
                continue;
            }
            let room = sources[from.clone()].iter().map(Chunk::len).sum::<usize>();
            chunks[to.clone()].iter_mut().for_each(|chunk| chunk.reserve_exact(room / to.len()));
            for source in &mut sources[from] {
                for p in 0..source.len() {
                    let key = position_key(source.position(p), roots, root_edge);
                    let inside = self.forest.find(key).filter(|leaf| to.contains(leaf));
                    // All particles of a leaf lie in it, and the new leaves cover the old.
                    chunks[inside.unwrap_or(to.start)].push_from(source, p);
                }
                *source = Chunk::new();
            }
        }
        self.chunks = chunks;
        self.leaf_data.maxima = maxima;
        levels
    }

    /// Collective. Urgency and wanted level of each own leaf by the criteria, for files.
    pub fn refinement(&mut self) -> Option<Refinement> {
        self.physics.adaptivity.as_ref().filter(|adaptivity| adaptivity.is_refining())?;
        self.nodes_of_state();
        self.survey_now();
        let values = self.indicators();
        let adaptivity = self.physics.adaptivity.as_ref()?;
        let count = adaptivity.criteria.len();
        let (mut urgency, mut wanted) = (Vec::new(), Vec::new());
        for (number, (leaf, chunk)) in self.forest.leaves().iter().zip(&self.chunks).enumerate() {
            let values = if chunk.is_empty() { &[] } else { &values[number * count..][..count] };
            let each = || adaptivity.criteria.iter().zip(values);
            urgency.push(each().map(|(c, &value)| c.urgency(value.leaf)).fold(0.0, f64::max));
            let levels = each().map(|(c, &value)| c.wanted_level(value, leaf.level));
            wanted.push(f64::from(levels.max().unwrap_or(0)));
        }
        Some(Refinement { urgency, wanted })
    }
}

/// Levels, a bit each, that the criteria want for a leaf of `level`.
fn wanted_levels<const D: usize>(adaptivity: &Adaptivity<D>, level: u8, values: &[Value]) -> u32 {
    let each = adaptivity.criteria.iter().zip(values);
    let levels = each.map(|(criterion, &value)| criterion.wanted_level(value, level));
    levels.filter(|&level| level > adaptivity.base_level).fold(0, |bits, level| bits | 1 << level)
}
