//! Sorting the particles of a leaf into its bins.
//!
//! A box at most one cell wide scatters on the finest level that it overlaps, into the arena of the block of
//! that level that contains its centre. In most leaves that is the leaf's own block for all particles; only
//! beside finer leaves, or where boxes are wider than a cell, each box is held against the leaves around.
//! A box wider than a cell of the finest level that it overlaps is cut into equal parts, each treated in the
//! same way; its weights are the mean of theirs.
use rayon::prelude::*;

use super::members::Members;
use super::sides::{NearLeaf, Side, Sides, near_leaf};
use crate::grid::mask::{offset, offset_count};
use crate::grid::plan::Bin;
use crate::grid::reach::leaves_around;
use crate::grid::{GridPlan, Window};
use crate::kernel::SubBox;
use crate::kernel::simd::{LANES, Lanes};
use crate::particle::chunk::{Chunk, Layout};

/// Particles of a leaf from which on its own bin counts as touching all nodes: to find out which these miss would cost
/// more than it saves.
const fn crowded(d: usize) -> usize {
    if d == 2 { 32 } else { 128 }
}

/// Bins of one own leaf whose particles do not all share the leaf's own bin.
#[derive(Clone, Debug, Default)]
pub struct LeafBins<const D: usize> {
    /// Members of each bin of the leaf.
    pub members: Vec<Members<D>>,
    /// Particles whose box is cut, in order; a part's slot points here.
    pub cut: Vec<u32>,
    near: Vec<NearLeaf<D>>,
    sides: Option<Sides<D>>,
}

/// Particle lists of the bins of one rank.
#[derive(Clone, Debug, Default)]
pub struct BinLists<const D: usize> {
    leaves: Vec<LeafBins<D>>,
    sorted: Vec<bool>,
    bounds: Vec<NearLeaf<D>>,
}

/// A part of a box falls outside the bins of its leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the box of particle {id} reaches beyond the bins of its leaf")]
pub struct BinMissing {
    /// Identifier of the particle.
    pub id: u64,
}

/// Half widths of the boxes of a chunk, and their bound.
pub trait BoxWidths<const D: usize>: Sync {
    /// Half widths of the boxes of [`LANES`] particles from `first` on in a leaf with cells of edge `cell`, m; lanes behind
    /// the last particle are of no use.
    fn of_batch(&self, chunk: &Chunk<D>, first: usize, cell: f64) -> [Lanes; D];
    /// A bound on all half widths in a chunk, m.
    fn bound(&self, chunk: &Chunk<D>) -> f64;
    /// Whether the kernels find the same half widths from the particles' state. If not, every box is
    /// handed to them, a narrow one as its only part.
    fn are_known_to_kernels(&self) -> bool {
        true
    }
}

impl<const D: usize> BinLists<D> {
    /// Not collective. Lists for the bins of a plan.
    pub fn new(plan: &GridPlan<D>) -> Self {
        let own = plan.leaf_start.len() - 1;
        let first = plan.tree.first_own();
        let leaves = (0..own).map(|leaf| LeafBins::new(plan, first + leaf, plan.leaf_bins(leaf).len()));
        let bounds = (0..own).map(|leaf| near_leaf(&plan.tree, first + leaf, plan.root_edge));
        Self { leaves: leaves.collect(), sorted: vec![false; own], bounds: bounds.collect() }
    }

    /// Not collective. Sorts all particles.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan; the caller makes it collective.
    pub fn sort(
        &mut self,
        plan: &GridPlan<D>,
        chunks: &[Chunk<D>],
        widths: &impl BoxWidths<D>,
    ) -> Result<(), BinMissing> {
        let leaves = self.leaves.par_iter_mut().zip(&mut self.sorted).zip(&self.bounds).enumerate();
        let given = !widths.are_known_to_kernels();
        // All leaves, also after a failure: the others must not keep the lists of the step before.
        let sorted = leaves.with_min_len(8).map(|(leaf, ((bins, sorted), own))| {
            let (chunk, cell) = (&chunks[leaf], plan.cell(own.level));
            let bound = widths.bound(chunk);
            // An empty leaf has nothing to list.
            *sorted = !chunk.is_empty() && (given || bins.sides.is_some() || bound > 0.5 * cell);
            if *sorted { bins.sort(plan, leaf, own, chunk, widths, bound) } else { Ok(()) }
        });
        sorted.reduce(|| Ok(()), Result::and)
    }

    /// Not collective. Gives every part the D of its whole box. `of_parts(bin, chunk, parts, each)` calls
    /// `each` with the number of a part and its D.
    pub fn spread_parts(
        &mut self,
        plan: &GridPlan<D>,
        chunks: &[Chunk<D>],
        of_parts: impl Fn(&Bin<D>, &Chunk<D>, &[SubBox<D>], &mut dyn FnMut(usize, [f64; D])) + Sync,
    ) {
        let leaves = self.leaves.par_iter_mut().zip(&self.sorted).enumerate().with_min_len(8);
        leaves.filter(|(_, (bins, sorted))| **sorted && !bins.cut.is_empty()).for_each(
            |(leaf, (bins, _))| {
                let mut totals = vec![[0.0; D]; bins.cut.len()];
                for (members, bin) in bins.members.iter().zip(&plan.bins[plan.leaf_bins(leaf)]) {
                    of_parts(bin, &chunks[leaf], &members.parts, &mut |part, spread| {
                        let part = &members.parts[part];
                        let total = &mut totals[part.slot as usize];
                        for axis in 0..D {
                            total[axis] = part.fraction.mul_add(spread[axis], total[axis]);
                        }
                    });
                }
                let parts = bins.members.iter_mut().flat_map(|members| &mut members.parts);
                parts.for_each(|part| part.spread = totals[part.slot as usize]);
            },
        );
    }

    /// Nodes that the members of a bin touch, or `None` if it has none.
    pub fn window(&self, leaf: usize, bin: usize, chunk: &Chunk<D>) -> Option<Window<D>> {
        let is_empty = match self.of_leaf(leaf) {
            None => bin != 0 || chunk.is_empty(),
            Some(bins) => bins.members[bin].whole.is_empty() && bins.members[bin].parts.is_empty(),
        };
        (!is_empty).then(|| self.window_of(leaf, bin))
    }

    /// Whether a leaf finer than own leaf `leaf` lies within `distance` (m) of a point in it, measured along the axes.
    pub fn is_finer_within(&self, leaf: usize, x: &[f64; D], distance: f64) -> bool {
        let own = self.bounds[leaf].level;
        self.leaves[leaf]
            .near
            .iter()
            .filter(|near| near.level > own)
            .any(|near| (0..D).all(|a| x[a] > near.lower[a] - distance && x[a] < near.upper[a] + distance))
    }

    /// As [`BinLists::window`], for a bin that has members.
    pub fn window_of(&self, leaf: usize, bin: usize) -> Window<D> {
        self.of_leaf(leaf).map_or(Window::FULL, |bins| bins.members[bin].window)
    }

    /// The bins of own leaf `leaf`, or `None` if all its particles are whole in its own bin.
    pub fn of_leaf(&self, leaf: usize) -> Option<&LeafBins<D>> {
        self.sorted[leaf].then_some(&self.leaves[leaf])
    }
}

impl<const D: usize> LeafBins<D> {
    fn new(plan: &GridPlan<D>, known: usize, bins: usize) -> Self {
        let tree = &plan.tree;
        let here = tree.leaves()[known];
        let around = leaves_around(tree, known);
        let members = vec![Members::default(); bins];
        let mut leaf = Self { members, cut: Vec::new(), near: Vec::new(), sides: None };
        // All others need it only if boxes get wider than a cell.
        if around.iter().any(|&leaf| tree.leaves()[leaf].level > here.level) {
            leaf.find_near(plan, around);
            let bins = &plan.bins[plan.leaf_bins(known - tree.first_own())];
            let (own, cell) = (near_leaf(tree, known, plan.root_edge), plan.cell(here.level));
            leaf.sides = Some(Sides::new(own, here, cell, &leaf.near, bins));
        }
        leaf
    }

    fn find_near(&mut self, plan: &GridPlan<D>, around: Vec<usize>) {
        self.near = around.into_iter().map(|leaf| near_leaf(&plan.tree, leaf, plan.root_edge)).collect();
    }

    fn sort(
        &mut self,
        plan: &GridPlan<D>,
        leaf: usize,
        own: &NearLeaf<D>,
        chunk: &Chunk<D>,
        widths: &impl BoxWidths<D>,
        bound: f64,
    ) -> Result<(), BinMissing> {
        if self.near.is_empty() {
            self.find_near(plan, leaves_around(&plan.tree, plan.tree.first_own() + leaf));
        }
        self.cut.clear();
        self.members.iter_mut().for_each(Members::clear);
        let crowded = chunk.len() >= crowded(D);
        let cells = [plan.cell(own.level), plan.cell(own.level + 1)];
        let given = !widths.are_known_to_kernels();
        let sides = self.sides.clone().filter(|_| !given);
        // Of most batches it is known without their half widths that they stay inside.
        let bound_is_narrow = is_narrow([bound], cells[0]);
        let bound = [Lanes::splat(bound); D];
        for first in (0..chunk.len()).step_by(LANES) {
            let lanes = LANES.min(chunk.len() - first);
            let position = positions(chunk, first);
            let all = first as u32..(first + lanes) as u32;
            if let Some(sides) = &sides
                && crowded
                && bound_is_narrow
                && sides.side(sides.crossings(&position, &bound).of_any()) == Side::Own
            {
                self.members[0].whole.extend(all);
                continue;
            }
            let half = widths.of_batch(chunk, first, cells[0]);
            let crossings = sides.as_ref().map(|sides| sides.crossings(&position, &half));
            let narrow = cells.map(|cell| narrow_lanes(&half, cell));
            let (position, half) = (position.map(Lanes::to_array), half.map(Lanes::to_array));
            for (lane, p) in all.enumerate() {
                let centre = std::array::from_fn(|axis| position[axis][lane]);
                let half = std::array::from_fn(|axis| half[axis][lane]);
                let side = sides.as_ref().zip(crossings).map(|(sides, crossings)| {
                    let bin = match sides.side(crossings.of_lane(lane)) {
                        Side::Own if narrow[0] >> lane & 1 == 1 => Some(0),
                        Side::Finer if narrow[1] >> lane & 1 == 1 => sides.child_bin(&centre),
                        Side::Own | Side::Finer | Side::Other => None,
                    };
                    bin.zip(Some(cells[usize::from(bin != Some(0))]))
                });
                if let Some(Some((bin, cell))) = side {
                    let members = &mut self.members[bin];
                    members.whole.push(p);
                    if bin != 0 || !crowded {
                        members.include(cell, centre, half);
                    }
                } else {
                    let sorted = self.sort_one(plan, leaf, own, p, centre, half, given);
                    sorted.map_err(|()| BinMissing { id: chunk.ids()[p as usize] })?;
                }
            }
        }
        for (members, bin) in self.members.iter_mut().zip(&plan.bins[plan.leaf_bins(leaf)]) {
            members.close(plan, bin);
        }
        if crowded {
            self.members[0].window = Window::FULL;
        }
        Ok(())
    }

    /// Sorts one box, held against all leaves around.
    fn sort_one(
        &mut self,
        plan: &GridPlan<D>,
        leaf: usize,
        own: &NearLeaf<D>,
        particle: u32,
        centre: [f64; D],
        half: [f64; D],
        given: bool,
    ) -> Result<(), ()> {
        let level = self.finest_level(own, centre, half);
        let cell = plan.cell(level);
        if !given && is_narrow(half, cell) {
            // The first bin of a leaf is its own block's.
            let bin = if level == own.level { Some(0) } else { self.bin(plan, leaf, level, centre) };
            let members = &mut self.members[bin.ok_or(())?];
            members.whole.push(particle);
            members.include(cell, centre, half);
            return Ok(());
        }
        let slot = self.cut.len() as u32;
        self.cut.push(particle);
        let (fraction, spread) = (1.0, [0.0; D]);
        self.cut_box(plan, leaf, own, SubBox { particle, slot, centre, half, fraction, spread })
    }

    /// Halves a box along the axes on which it is too wide, until each part fits the level it overlaps.
    fn cut_box(
        &mut self,
        plan: &GridPlan<D>,
        leaf: usize,
        own: &NearLeaf<D>,
        part: SubBox<D>,
    ) -> Result<(), ()> {
        let level = self.finest_level(own, part.centre, part.half);
        let cell = plan.cell(level);
        let wide: [bool; D] = std::array::from_fn(|axis| !is_narrow([part.half[axis]], cell));
        let count = wide.iter().filter(|&&wide| wide).count();
        if count == 0 {
            let bin = self.bin(plan, leaf, level, part.centre).ok_or(())?;
            self.members[bin].parts.push(part);
            self.members[bin].include(cell, part.centre, part.half);
            return Ok(());
        }
        let half: [f64; D] = std::array::from_fn(|axis| part.half[axis] * if wide[axis] { 0.5 } else { 1.0 });
        for corner in (0..1u32 << D).filter(|corner| (0..D).all(|a| wide[a] || corner >> a & 1 == 0)) {
            let centre = std::array::from_fn(|axis| match (wide[axis], corner >> axis & 1) {
                (false, _) => part.centre[axis],
                (true, 0) => part.centre[axis] - half[axis],
                (true, _) => part.centre[axis] + half[axis],
            });
            let fraction = part.fraction / f64::from(1u32 << count);
            self.cut_box(plan, leaf, own, SubBox { centre, half, fraction, ..part })?;
        }
        Ok(())
    }

    /// Finest level among the leaves that the open box overlaps, or touches up to round-off: where the kernel sees
    /// an overlap that is none here, it would reach for nodes that do not exist within finer leaves.
    fn finest_level(&self, own: &NearLeaf<D>, centre: [f64; D], half: [f64; D]) -> u8 {
        let slack = own.slack();
        let lo: [f64; D] = std::array::from_fn(|axis| centre[axis] - half[axis] - slack[axis]);
        let hi: [f64; D] = std::array::from_fn(|axis| centre[axis] + half[axis] + slack[axis]);
        if (0..D).all(|axis| lo[axis] >= own.lower[axis] && hi[axis] <= own.upper[axis]) {
            return own.level;
        }
        self.near
            .iter()
            .filter(|leaf| (0..D).all(|axis| lo[axis] < leaf.upper[axis] && hi[axis] > leaf.lower[axis]))
            .map(|leaf| leaf.level)
            .max()
            .unwrap_or(own.level)
    }

    /// Bin, counted within the leaf, of the block of `level` that contains `centre`. A centre on the face of
    /// two blocks may lie in either.
    fn bin(&self, plan: &GridPlan<D>, leaf: usize, level: u8, centre: [f64; D]) -> Option<usize> {
        let bins = &plan.bins[plan.leaf_bins(leaf)];
        let edge = plan.cell(level) * 4.0;
        let scaled: [f64; D] = centre.map(|x| x / edge);
        let find = |coord: [u32; D]| {
            bins.iter().position(|bin| bin.block.level == level && bin.block.coord == coord)
        };
        let roots = plan.tree.brick().roots;
        let coord = std::array::from_fn(|axis| (scaled[axis] as u32).min((roots[axis] << level) - 1));
        find(coord).or_else(|| {
            // Rounding may have put a centre on a face into a block that cannot hold it.
            let nudge = 1e-9;
            (0..offset_count(D)).find_map(|index| {
                let shift = offset::<D>(index);
                find(std::array::from_fn(|axis| (scaled[axis] + f64::from(shift[axis]) * nudge) as u32))
            })
        })
    }
}

/// Positions of [`LANES`] particles from `first` on; what lies behind the last particle is of no use.
pub(super) fn positions<const D: usize>(chunk: &Chunk<D>, first: usize) -> [Lanes; D] {
    let (reals, stride) = chunk.reals();
    std::array::from_fn(|axis| {
        let column = &reals[(Layout::<D>::POSITION + axis) * stride + first..];
        column.first_chunk().map_or(Lanes::splat(f64::NAN), Lanes::load)
    })
}

/// Lanes of which [`is_narrow`] holds.
fn narrow_lanes<const D: usize>(half: &[Lanes; D], cell: f64) -> u32 {
    let limit = Lanes::splat(0.5 * cell * (1.0 + 8.0 * f64::EPSILON));
    half.iter().fold(!0, |lanes, half| lanes & half.le(limit).bits())
}

/// Whether a box fits into the stencil of cells of edge `cell`. Rounding in the half widths must not
/// cut a box that is exactly one cell wide; the kernel takes such a box as one cell wide, which is no more
/// than a few units of the last place.
fn is_narrow<const N: usize>(half: [f64; N], cell: f64) -> bool {
    half.iter().all(|&half| half <= 0.5 * cell * (1.0 + 8.0 * f64::EPSILON))
}
