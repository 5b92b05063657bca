//! Leaves and particles of a job's tree, counted without building it.
//!
//! A part of the tree whose leaves all have one level, and which no body or one body fills, is counted by
//! arithmetic. Surfaces are left: of bodies, of regions, and of the layers by which a graded tree falls off
//! around a region. Those are followed down to the leaves, coarse parts first, until a bound on the work is
//! reached.
//!
//! A graded tree needs no list of its leaves. A split of level `m` makes the parents of its neighbours split,
//! these make the parents of theirs, and so on; so an octant of level `l` is split just when a region splits
//! an octant of a level `m ≥ l` that lies within its box grown by `h_l - h_m` on all sides, where `h` are the
//! edges of octants.
use super::levels::LevelCount;
use crate::geometry::{Aabb, Shape, Side};
use crate::grid::mask::{offset, offset_count};
use crate::job::problem::{Problem, Region};
use crate::setup::particles::seed::{SeedError, count_bodies, lattice_count};
use partition::Octant;
use std::collections::VecDeque;
use std::rc::Rc;

/// Most parts of the tree that are examined. A part takes about a hundred bytes.
const MOST_PARTS: u64 = 500_000;
/// Work for all parts, in comparisons of a point or a box with a plane or an edge of a shape, a few
/// nanoseconds each.
const MOST_WORK: u64 = 60_000_000;
/// Most octants that are examined for one question about a split. Beyond, the answer is yes.
const MOST_LOOKS: usize = 2_000;

/// Counts, and whether they are complete.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tally {
    /// Particles of each body.
    pub particles: Vec<u64>,
    /// Leaves by level.
    pub levels: Vec<LevelCount>,
    /// Whether the bound on the work is reached first: then there are more particles and leaves than counted.
    pub is_cut: bool,
}

/// A box of octants of one level.
#[derive(Clone)]
struct Part<const D: usize> {
    level: u8,
    /// Coordinates of the first octant and of the one behind the last.
    lo: [u32; D],
    hi: [u32; D],
    /// Level of all leaves in it, once that is known and they are counted.
    settled: Option<u8>,
    /// Regions and bodies that may reach it.
    regions: Rc<[u32]>,
    bodies: Rc<[u32]>,
}

/// Not collective. Counts the leaves of the tree that the job asks for, and the points that bodies have in
/// them.
///
/// # Errors
/// Two bodies share a lattice point.
pub(super) fn count<const D: usize>(problem: &Problem<D>) -> Result<Tally, SeedError> {
    let finest = usize::from(problem.finest_level());
    let mut counter = Counter {
        problem,
        tally: Tally {
            particles: vec![0; problem.bodies.len()],
            levels: vec![LevelCount::default(); finest + 1],
            is_cut: false,
        },
        parts: VecDeque::new(),
        pushed: 0,
        work: 0,
        body_work: problem.bodies.iter().map(|body| work(&body.shape)).collect(),
        region_work: problem.tree.regions.iter().map(|region| work(&region.shape)).collect(),
    };
    counter.parts.push_back(Part {
        level: 0,
        lo: [0; D],
        hi: problem.brick.roots,
        settled: None,
        regions: (0..problem.tree.regions.len() as u32).collect(),
        bodies: (0..problem.bodies.len() as u32)
            .filter(|&body| problem.bodies[body as usize].fed.is_none())
            .collect(),
    });
    while let Some(part) = counter.parts.pop_front() {
        if counter.work > MOST_WORK || counter.pushed > MOST_PARTS {
            counter.tally.is_cut = true;
            counter.leave(&part);
        } else {
            counter.look(part)?;
        }
    }
    let mut tally = counter.tally;
    if !tally.is_cut {
        let finest = tally.levels.iter().rposition(|level| level.leaves > 0).unwrap_or(0);
        tally.levels.truncate(finest + 1);
    }
    Ok(tally)
}

/// Comparisons that a question about a shape takes.
fn work<const D: usize>(shape: &Shape<D>) -> u64 {
    match shape {
        Shape::Box(_) | Shape::Sphere { .. } | Shape::HalfSpace { .. } => 2,
        Shape::Frustum(_) => 4,
        Shape::Polygon(corners) => 2 * corners.len() as u64,
        Shape::Mesh(_) => 32,
        Shape::Rotated(inner, _) => 2 + work(inner),
        Shape::Union(parts) | Shape::Intersection(parts) => parts.iter().map(work).sum(),
        Shape::Difference(from, removed) => work(from) + removed.iter().map(work).sum::<u64>(),
    }
}

/// Whether classification finds `Outside` for every box that lies outside.
fn is_exact<const D: usize>(shape: &Shape<D>) -> bool {
    match shape {
        Shape::Box(_) | Shape::Sphere { .. } | Shape::HalfSpace { .. } => true,
        Shape::Union(parts) => parts.iter().all(is_exact),
        _ => false,
    }
}

struct Counter<'a, const D: usize> {
    problem: &'a Problem<D>,
    tally: Tally,
    parts: VecDeque<Part<D>>,
    /// Parts that have been examined or will be.
    pushed: u64,
    work: u64,
    body_work: Vec<u64>,
    region_work: Vec<u64>,
}

impl<const D: usize> Counter<'_, D> {
    /// Counts a part, or queues smaller ones.
    fn look(&mut self, mut part: Part<D>) -> Result<(), SeedError> {
        self.work += 10;
        let cell = self.cell(part.level, part.lo, part.hi);
        let octant = (0..D)
            .all(|a| part.hi[a] - part.lo[a] == 1)
            .then_some(Octant { level: part.level, coord: part.lo });
        let mut jumps = false;
        if part.settled.is_none() {
            part.regions = self.near(&part, &cell);
            match (self.uniform(&part, &cell), octant) {
                (Some(level), _) => {
                    self.add_leaves(&part, level);
                    part.settled = Some(level);
                }
                (None, Some(octant)) if !self.is_split(&octant, &part.regions) => {
                    self.add_leaves(&part, octant.level);
                    part.settled = Some(octant.level);
                    jumps = self.has_jump(&octant, &part.regions);
                }
                _ => {}
            }
        }
        let mut inside = Vec::new();
        let mut crosses = false;
        let bodies = &self.problem.bodies;
        let near = part.bodies.iter().copied().filter(|&body| {
            self.work += self.body_work[body as usize];
            match bodies[body as usize].shape.classify(&cell) {
                Side::Outside => return false,
                Side::Inside => inside.push(body),
                Side::Crosses => crosses = true,
            }
            true
        });
        let near: Vec<u32> = near.collect();
        match (part.settled, octant) {
            (Some(_), _) if near.is_empty() => return Ok(()),
            (Some(level), _) if !crosses && inside.len() == 1 => {
                self.add_lattice(inside[0], &cell, level, self.octants(&part, level), jumps);
                return Ok(());
            }
            (Some(level), Some(octant)) if level == octant.level => {
                return self.add_points(&octant, &near, jumps);
            }
            _ => {}
        }
        part.bodies = near.into();
        self.divide(&part, octant);
        Ok(())
    }

    /// Regions that matter for the leaves of the part or for those around it.
    fn near(&mut self, part: &Part<D>, cell: &Aabb<D>) -> Rc<[u32]> {
        if part.regions.is_empty() {
            return part.regions.clone();
        }
        let around = grown(cell, 4.0 * self.problem.leaf_edge(part.level));
        let regions = &self.problem.tree.regions;
        let is_near = |&region: &u32| {
            self.work += self.region_work[region as usize];
            regions[region as usize].shape.classify(&around) != Side::Outside
        };
        part.regions.iter().copied().filter(is_near).collect()
    }

    /// The level of all leaves of the part and of those that touch it, if they have one level for sure.
    fn uniform(&mut self, part: &Part<D>, cell: &Aabb<D>) -> Option<u8> {
        let base = self.problem.tree.base_level;
        let regions = &self.problem.tree.regions;
        self.work += 3 * part.regions.iter().map(|&region| self.region_work[region as usize]).sum::<u64>();
        let near = || part.regions.iter().map(|&region| &regions[region as usize]);
        let holds = |region: &&Region<D>, cell: &Aabb<D>| region.shape.classify(cell) == Side::Inside;
        let level =
            near().filter(|region| holds(region, cell)).fold(base, |level, region| level.max(region.level));
        if level < part.level {
            return None;
        }
        let edge = self.problem.leaf_edge(level);
        let domain = Aabb::new([0.0; D], self.problem.size());
        let around = grown(cell, edge).intersection(&domain);
        let same = level == base || near().any(|region| region.level == level && holds(&region, &around));
        // The layer that a graded tree adds around finer leaves is thinner than one leaf of this level.
        let wide = grown(cell, 2.0 * edge);
        let finer =
            near().any(|region| region.level > level && region.shape.classify(&wide) != Side::Outside);
        (same && !finer).then_some(level)
    }

    /// Whether the tree splits the octant; `near` are the regions that may ask for it.
    fn is_split(&mut self, octant: &Octant<D>, near: &[u32]) -> bool {
        if octant.level < self.problem.tree.base_level {
            return true;
        }
        near.iter().any(|&index| {
            let region = &self.problem.tree.regions[index as usize];
            region.level > octant.level && self.reaches(region, self.region_work[index as usize], octant)
        })
    }

    /// Whether a region that asks for finer leaves makes the tree split the octant.
    fn reaches(&mut self, region: &Region<D>, price: u64, octant: &Octant<D>) -> bool {
        let problem = self.problem;
        self.work += price;
        if region.shape.classify(&problem.octant_box(octant)) != Side::Outside {
            return true;
        }
        if !problem.tree.graded || region.level == octant.level + 1 {
            return false;
        }
        // The octants of the finest level that is split, within the grown box.
        let last = region.level - 1;
        let depth = last - octant.level;
        let (lo, hi) = self.within(octant, depth);
        self.work += price;
        // Shapes that are classified by distance reach cells by the balls around them, which stick out of the
        // box.
        let beyond = match is_exact(&region.shape) {
            true => 0.0,
            false => 0.51 * ((D as f64).sqrt() - 1.0) * problem.leaf_edge(last),
        };
        if region.shape.classify(&grown(&self.cell(last, lo, hi), beyond)) == Side::Outside {
            return false;
        }
        if is_exact(&region.shape) {
            return true;
        }
        let mut looks = 0;
        let mut pending: Vec<Octant<D>> = (0..offset_count(D))
            .filter_map(|index| octant.neighbour(offset(index), &problem.brick))
            .collect();
        while let Some(candidate) = pending.pop() {
            (looks, self.work) = (looks + 1, self.work + price);
            if looks > MOST_LOOKS {
                return true;
            }
            if region.shape.classify(&problem.octant_box(&candidate)) == Side::Outside {
                continue;
            }
            let (lo, hi) = self.within(octant, candidate.level - octant.level);
            if (0..D).all(|a| lo[a] <= candidate.coord[a] && candidate.coord[a] < hi[a]) {
                return true;
            }
            if candidate.level < last {
                pending.extend((0..1 << D).map(|i| candidate.child(i)));
            }
        }
        false
    }

    /// The octants `depth` levels below the octant's own that lie in its box grown by its edge less one of
    /// theirs.
    fn within(&self, octant: &Octant<D>, depth: u8) -> ([u32; D], [u32; D]) {
        let fine = 1_u32 << depth;
        let roots = self.problem.brick.roots.map(|n| n << (octant.level + depth));
        (
            std::array::from_fn(|a| (octant.coord[a] * fine).saturating_sub(fine - 1)),
            std::array::from_fn(|a| ((octant.coord[a] + 2) * fine - 1).min(roots[a])),
        )
    }

    /// Whether a leaf touches one of another level.
    fn has_jump(&mut self, octant: &Octant<D>, near: &[u32]) -> bool {
        if near.is_empty() {
            return false;
        }
        (0..offset_count(D)).any(|index| {
            let Some(neighbour) = octant.neighbour(offset(index), &self.problem.brick) else { return false };
            let coarser = neighbour.parent().is_some_and(|parent| !self.is_split(&parent, near));
            neighbour != *octant && (coarser || self.is_split(&neighbour, near))
        })
    }

    /// Octants of a level in a part.
    fn octants(&self, part: &Part<D>, level: u8) -> u64 {
        let edge = 1_u64 << (level - part.level);
        (0..D).fold(1, |all: u64, a| all.saturating_mul(u64::from(part.hi[a] - part.lo[a]) * edge))
    }

    fn add_leaves(&mut self, part: &Part<D>, level: u8) {
        let leaves = self.octants(part, level);
        let count = &mut self.tally.levels[usize::from(level)].leaves;
        *count = count.saturating_add(leaves);
    }

    fn add_particles(&mut self, body: u32, level: u8, particles: u64) {
        let all = &mut self.tally.particles[body as usize];
        *all = all.saturating_add(particles);
        let count = &mut self.tally.levels[usize::from(level)].particles;
        *count = count.saturating_add(particles);
    }

    fn add_filled(&mut self, level: u8, leaves: u64, jumps: bool) {
        let count = &mut self.tally.levels[usize::from(level)];
        count.filled = count.filled.saturating_add(leaves);
        count.filled_jumps += u64::from(jumps);
    }

    /// The lattice of a body that fills a box of leaves.
    fn add_lattice(&mut self, body: u32, cell: &Aabb<D>, level: u8, leaves: u64, jumps: bool) {
        let points = lattice_count(self.problem, body as usize, cell, level);
        self.add_particles(body, level, points);
        self.add_filled(level, leaves, jumps);
    }

    /// The points of some bodies in a leaf.
    fn add_points(&mut self, leaf: &Octant<D>, near: &[u32], jumps: bool) -> Result<(), SeedError> {
        let problem = self.problem;
        let price: u64 = near.iter().map(|&body| self.body_work[body as usize]).sum();
        let mut is_filled = false;
        let bodies = near.iter().map(|&body| body as usize);
        let cell = problem.octant_box(leaf);
        for body in bodies.clone() {
            self.work += price * lattice_count(problem, body, &cell, leaf.level);
        }
        let mut found = Vec::new();
        count_bodies(problem, leaf, bodies, |body, points| found.push((body as u32, points)))?;
        for (body, points) in found {
            is_filled |= points > 0;
            self.add_particles(body, leaf.level, points);
        }
        if is_filled {
            self.add_filled(leaf.level, 1, jumps);
        }
        Ok(())
    }

    /// Queues the parts of a part.
    fn divide(&mut self, part: &Part<D>, octant: Option<Octant<D>>) {
        let mut push = |level, lo, hi| {
            self.pushed += 1;
            self.parts.push_back(Part { level, lo, hi, ..part.clone() });
        };
        if let Some(octant) = octant {
            for child in (0..1 << D).map(|i| octant.child(i)) {
                push(child.level, child.coord, child.coord.map(|c| c + 1));
            }
            return;
        }
        for corner in 0..1_usize << D {
            let middle: [u32; D] = std::array::from_fn(|a| part.lo[a].midpoint(part.hi[a]));
            let upper = |a: usize| corner >> a & 1 == 1;
            let lo: [u32; D] = std::array::from_fn(|a| if upper(a) { middle[a] } else { part.lo[a] });
            let hi: [u32; D] = std::array::from_fn(|a| if upper(a) { part.hi[a] } else { middle[a] });
            if (0..D).all(|a| lo[a] < hi[a]) {
                push(part.level, lo, hi);
            }
        }
    }

    /// Counts the leaves that a part has at least, without examining it.
    fn leave(&mut self, part: &Part<D>) {
        if part.settled.is_none() {
            self.add_leaves(part, part.level.max(self.problem.tree.base_level));
        }
    }

    /// The box of some octants of one level.
    fn cell(&self, level: u8, lo: [u32; D], hi: [u32; D]) -> Aabb<D> {
        let edge = self.problem.leaf_edge(level);
        Aabb::new(lo.map(|c| f64::from(c) * edge), hi.map(|c| f64::from(c) * edge))
    }
}

fn grown<const D: usize>(cell: &Aabb<D>, by: f64) -> Aabb<D> {
    Aabb::new(cell.lower.map(|c| c - by), cell.upper.map(|c| c + by))
}

#[cfg(test)]
#[path = "count_tests.rs"]
mod tests;
