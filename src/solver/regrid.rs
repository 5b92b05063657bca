//! The tree follows the material: criteria, refinement and coarsening, splitting and merging.
use std::time::Instant;

use partition::comm::Disagreement;
use partition::{MAX_LEVEL, Mark, Octant, Region, correspondence};

use super::migrate::{MigrateError, Moved, position_key};
use super::phases::Phase;
use super::{Solver, StepError};
use crate::adaptivity::{Adaptivity, Value};
use crate::particle::Chunk;

/// A region with the level that all leaves which meet it must have at least.
type Request<const D: usize> = (Region<D>, u32);

/// What a leaf wants for itself and the leaves around.
struct Wish<const D: usize> {
    /// Levels, ascending, each with its own width of buffer.
    levels: Vec<u8>,
    /// Way that the material can go down and up along each axis until the tree changes next, on the finest lattice.
    way: [[u32; D]; 2],
}

/// An octant's box with a layer around, below and above, without its surface, so that it meets only leaves that
/// overlap it.
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
    /// How urgent refinement is by the most urgent criterion: 1 where it begins.
    pub urgency: Vec<f64>,
    /// Level that the criteria want for the leaf itself; 0 if none does.
    pub wanted: Vec<f64>,
}

impl<const D: usize> Solver<D> {
    /// Collective. After a step: changes the tree where the job's criteria want it, and splits and merges particles,
    /// if the step is one at which this is due. Everything follows from the state alone. Returns whether anything changed.
    ///
    /// # Errors
    /// On all ranks when any rank failed.
    pub fn regrid(&mut self) -> Result<bool, Disagreement> {
        match &self.physics.adaptivity {
            Some(adaptivity) if self.clock.step.is_multiple_of(adaptivity.every) => {}
            _ => return Ok(false),
        }
        let (start, phases) = (Instant::now(), self.phases);
        let levels_before = self.change_tree();
        let is_new = levels_before.is_some();
        let from = levels_before.unwrap_or_else(|| self.forest.leaves().iter().map(|l| l.level).collect());
        let split = self.split_particles(&from);
        if is_new {
            self.rebalance();
            self.plastic_rate.clear();
            let reach = self.agreed_reach();
            if reach != self.grid.plan.tree.reach() {
                self.rebuild_grid(reach);
            }
        }
        let merged = self.merge_particles();
        let changed = self.comm.any(is_new || split || merged);
        if changed {
            // Boxes of children may reach over the faces of their leaf, and with them their centres.
            let moved = self.migrate();
            let moved: Result<Moved, StepError> = moved.map_err(|error: MigrateError| error.into());
            self.comm.agree(moved)?;
        }
        let changed = self.reunite_families()? || changed;
        if changed {
            self.signal = self.chunks.iter().map(|chunk| self.signal_at_rest(chunk)).collect();
            let bound = self.comm.min_f64(self.local_bound());
            self.clock.bound = self.clock.bound.min(bound);
            self.regrids += u64::from(is_new);
        }
        // One phase for all of it.
        self.phases = phases;
        self.phases.book(Phase::Regrid, start.elapsed());
        Ok(changed)
    }

    /// Collective. Values of the criteria in the state after P2G, for the choice of the first tree: whether the
    /// tree had to change. Particles of a changed tree are to be made anew.
    pub fn regrid_before_start(&mut self) -> bool {
        if self.physics.adaptivity.is_none() {
            return false;
        }
        self.nodes_of_state();
        self.change_tree().is_some()
    }

    /// Collective. Velocities and masses of the nodes as the particles have them between two steps.
    fn nodes_of_state(&mut self) {
        let phases = self.phases;
        // A box without a bin stops the next step, which says so.
        let _ = self.sort_into_bins();
        self.nodes_from_particles(0.0);
        let rates = self.collider_rates(0.0);
        self.update_nodes(0.0, &rates);
        self.phases = phases;
    }

    /// Collective. Refines and coarsens, and moves particles to the leaves that contain them; the partition stays. If
    /// any leaf of any rank changed: the level of the leaf that each own leaf's particles come from.
    fn change_tree(&mut self) -> Option<Vec<u8>> {
        let adaptivity = self.physics.adaptivity.as_ref()?;
        let requests = self.requests(adaptivity);
        let requests = self.forest.to_owners(&self.comm, &requests);
        let old = self.forest.leaves().to_vec();
        if !self.follow(&requests) {
            return None;
        }
        let is_new = old != self.forest.leaves();
        self.comm.any(is_new).then(|| self.move_to_leaves(&old))
    }

    /// Collective. What the criteria want for and around each occupied leaf.
    fn requests(&self, adaptivity: &Adaptivity<D>) -> Vec<Request<D>> {
        let indicators = self.indicators(&adaptivity.criteria);
        let wishes: Vec<Wish<D>> =
            indicators.iter().enumerate().map(|(leaf, values)| self.wish(adaptivity, leaf, values)).collect();
        let leaves = self.forest.leaves();
        let mut requests = Vec::new();
        let mut leaf = 0;
        while leaf < leaves.len() {
            // A family that wants the same asks as one; most do.
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
            for &level in &wishes[leaf].levels {
                let buffer = adaptivity.buffer << (MAX_LEVEL - level);
                let growth = way.map(|side| side.map(|way| buffer.saturating_add(way)));
                requests.push((grown(&octant, growth), u32::from(level)));
            }
            leaf = members.end;
        }
        requests
    }

    /// What one leaf wants.
    fn wish(&self, adaptivity: &Adaptivity<D>, leaf: usize, values: &[Value]) -> Wish<D> {
        let own = self.forest.leaves()[leaf].level;
        let each = adaptivity.criteria.iter().zip(values);
        let mut levels: Vec<u8> = each
            .map(|(criterion, &value)| criterion.wanted_level(value, own))
            .filter(|&level| level > adaptivity.base_level)
            .collect();
        levels.sort_unstable();
        levels.dedup();
        if levels.is_empty() {
            return Wish { levels, way: [[0; D]; 2] };
        }
        // Material must not leave the buffer before the next time.
        let interval = adaptivity.every as f64 * self.clock.dt;
        let unit = self.physics.root_edge / f64::from(1u32 << MAX_LEVEL);
        let way = |velocity: f64| (velocity.abs() * interval / unit).ceil() as u32;
        Wish { levels, way: self.velocity_range(leaf).map(|side| side.map(way)) }
    }

    /// Collective. Refines own leaves to what is requested, coarsens families by one level where nothing objects, and
    /// balances. Returns whether any rank changed something on the way.
    fn follow(&mut self, requests: &[Request<D>]) -> bool {
        let mut changed = false;
        let mut may_coarsen = true;
        loop {
            let wanted = self.wanted_levels(requests);
            let marks: Vec<Mark> = self
                .forest
                .leaves()
                .iter()
                .zip(&wanted)
                .map(|(leaf, &wanted)| match wanted.cmp(&leaf.level) {
                    std::cmp::Ordering::Greater => Mark::Refine,
                    std::cmp::Ordering::Less if may_coarsen => Mark::Coarsen,
                    _ => Mark::Keep,
                })
                .collect();
            if !self.forest.adapt(&self.comm, &marks) {
                break;
            }
            // The partition keeps families together until the tree changes, so only the first pass may coarsen.
            may_coarsen = false;
            changed = true;
        }
        if changed && self.physics.graded {
            self.forest.balance(&self.comm);
        }
        changed
    }

    /// Least level of each own leaf.
    fn wanted_levels(&self, requests: &[Request<D>]) -> Vec<u8> {
        let mut wanted: Vec<u8> =
            self.forest.leaves().iter().map(|leaf| self.permanent_level(leaf)).collect();
        for (region, level) in requests {
            self.forest.own_leaves_in(region, &mut |leaf| wanted[leaf] = wanted[leaf].max(*level as u8));
        }
        wanted
    }

    /// Level that a leaf has in any case.
    fn permanent_level(&self, leaf: &Octant<D>) -> u8 {
        let Some(adaptivity) = &self.physics.adaptivity else { return leaf.level };
        let (lower, upper) = super::migrate::leaf_box(leaf, self.physics.root_edge);
        let leaf_box = crate::geometry::Aabb::new(lower, upper);
        let regions = adaptivity.regions.iter();
        let met = regions.filter(|(shape, _)| shape.classify(&leaf_box) != crate::geometry::Side::Outside);
        met.map(|(_, level)| *level).fold(adaptivity.base_level, u8::max)
    }

    /// Moves particles from old leaves to those that contain them now. Returns the level of the old leaf of each.
    fn move_to_leaves(&mut self, old: &[Octant<D>]) -> Vec<u8> {
        let new = self.forest.leaves();
        let mut sources = std::mem::take(&mut self.chunks);
        let mut levels = vec![0; new.len()];
        let mut chunks: Vec<Chunk<D>> = new.iter().map(|_| Chunk::new()).collect();
        let (roots, root_edge) = (self.forest.brick().roots, self.physics.root_edge);
        for (from, to) in correspondence(old, new) {
            let finest = old[from.clone()].iter().map(|leaf| leaf.level).max().unwrap_or(0);
            levels[to.clone()].fill(finest);
            if from.len() == 1 && to.len() == 1 {
                chunks[to.start] = std::mem::take(&mut sources[from.start]);
                continue;
            }
            for source in &sources[from] {
                for p in 0..source.len() {
                    let key = position_key(source.position(p), roots, root_edge);
                    let inside = self.forest.find(key).filter(|leaf| to.contains(leaf));
                    // All particles of a leaf lie in it, and the new leaves cover the old.
                    chunks[inside.unwrap_or(to.start)].push_from(source, p);
                }
            }
        }
        self.chunks = chunks;
        levels
    }

    /// Collective. What the criteria say of each own leaf, for files.
    pub fn refinement(&mut self) -> Option<Refinement> {
        self.physics.adaptivity.as_ref()?;
        self.nodes_of_state();
        let adaptivity = self.physics.adaptivity.as_ref()?;
        let (mut urgency, mut wanted) = (Vec::new(), Vec::new());
        for (values, leaf) in self.indicators(&adaptivity.criteria).iter().zip(self.forest.leaves()) {
            let each = || adaptivity.criteria.iter().zip(values);
            urgency.push(each().map(|(c, &value)| c.urgency(value.leaf)).fold(0.0, f64::max));
            let levels = each().map(|(c, &value)| c.wanted_level(value, leaf.level));
            wanted.push(f64::from(levels.max().unwrap_or(0)));
        }
        Some(Refinement { urgency, wanted })
    }
}
