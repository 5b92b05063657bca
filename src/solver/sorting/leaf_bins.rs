//! Sorting the particles of a leaf into its bins.
//!
//! A box at most one cell wide scatters on the finest level that it overlaps, into the arena of the block of
//! that level that contains its centre. In most leaves that is the leaf's own block for all particles; only
//! beside finer leaves, or where boxes are wider than a cell, boxes near these and wide ones are compared
//! with the finer leaves around. A box wider than a cell of the finest level that it overlaps is cut into
//! equal parts, each treated in the same way; its weights are the mean of theirs.

use super::bin_members::BinMembers;
use super::box_widths::{BinMissing, BoxWidths};
use super::leaf_faces::{LeafFaces, NearLeaf, Side, near_leaf};
use crate::grid::mask::{offset, offset_count};
use crate::grid::plan::bin_reach::leaves_around;
use crate::grid::{GridPlan, Window};
use crate::kernel::SubBox;
use crate::kernel::domain::softening_at;
use crate::particle::chunk::{Chunk, Layout, Revision};
use crate::particle::group::Group;
use crate::particle::lanes::{list_lanes, values};
use crate::simd::{LANES, Lanes, Vector, VectorMask};

/// Particles of a leaf from which on its own bin counts as touching all nodes: to find out which these miss
/// would cost more than it saves.
const fn touches_all_nodes(d: usize) -> usize {
    if d == 2 { 32 } else { 128 }
}

/// Bins of one own leaf whose particles do not all share the leaf's own bin.
#[derive(Clone, Debug, Default)]
pub struct LeafBins<const D: usize> {
    /// Members of each bin of the leaf.
    pub members: Vec<BinMembers<D>>,
    /// Particles whose box is cut, in order; a part's slot points here.
    pub cut: Vec<u32>,
    /// Finer leaves around.
    pub(in crate::solver) finer: Vec<NearLeaf<D>>,
    /// All leaves around: where there are finer ones, or once boxes are wide; parts of boxes may lie in any
    /// of them.
    around: Vec<NearLeaf<D>>,
    /// Beside finer leaves.
    pub(super) faces: Option<LeafFaces<D>>,
    /// Particles that are not whole in the leaf's own bin, with their bin; they ascend.
    outside_own_bin: Vec<(u32, u32)>,
    /// How many of the first particles are sorted already, as long as the chunk has the revision.
    presorted: Option<(Revision, usize)>,
}

/// In place of a bin: the box is in none as a whole.
const CUT: u32 = u32::MAX;
/// In place of a bin: the particle is in another group.
const STRANGER: u32 = u32::MAX - 1;

/// Memory that a thread reuses from leaf to leaf.
#[derive(Debug, Default)]
pub(in crate::solver) struct Scratch {
    /// Particles whose bin may be another than the leaf's own.
    undecided: Vec<u32>,
}

/// Input of sorting beside the particles.
pub(in crate::solver) struct Sorting<'a, const D: usize, W> {
    pub plan: &'a GridPlan<D>,
    pub widths: &'a W,
    /// Own leaf.
    pub leaf: usize,
    pub own: &'a NearLeaf<D>,
}

impl<const D: usize> LeafBins<D> {
    /// Of a known leaf, if leaves around it are finer.
    pub(in crate::solver) fn beside_finer(plan: &GridPlan<D>, known: usize) -> Option<Box<Self>> {
        let tree = &plan.tree;
        let here = tree.leaves()[known];
        let near = |leaf| near_leaf(tree, leaf, plan.root_edge);
        // Around most leaves nothing is finer.
        let is_far = tree.reach_in_leaves() > 1;
        let looks = is_far || tree.is_beside_finer(here.level, here.coord);
        let around = if looks { leaves_around(tree, known) } else { Vec::new() };
        if around.iter().all(|&leaf| tree.leaves()[leaf].level <= here.level) {
            return None;
        }
        let around: Vec<NearLeaf<D>> = around.into_iter().map(near).collect();
        let finer: Vec<NearLeaf<D>> = around.iter().filter(|leaf| leaf.level > here.level).cloned().collect();
        let leaf = known - tree.first_own();
        let bins = &plan.bins[plan.leaf_bins(leaf)];
        let (own, cell) = (near_leaf(tree, known, plan.root_edge), plan.cell(here.level));
        let faces = Some(LeafFaces::new(own, here, cell, &finer, bins));
        Some(Box::new(Self { finer, around, faces, ..Self::beside_others(plan, leaf) }))
    }

    /// Of an own leaf beside leaves of its level and coarser ones.
    pub(super) fn beside_others(plan: &GridPlan<D>, leaf: usize) -> Self {
        Self { members: vec![BinMembers::default(); plan.leaf_bins(leaf).len()], ..Self::default() }
    }

    /// Whether leaves around are finer.
    pub(super) fn is_beside_finer(&self) -> bool {
        self.faces.is_some()
    }

    /// Sorts the particles of a leaf. Returns whether there is anything to list: if not, all are whole in the
    /// leaf's own bin.
    pub(in crate::solver) fn sort(
        &mut self,
        chunk: &Chunk<D>,
        sorting: &Sorting<'_, D, impl BoxWidths<D>>,
        scratch: &mut Scratch,
    ) -> Result<bool, BinMissing> {
        let presorted = self.presorted.take().filter(|(revision, _)| chunk.still_has(*revision));
        let known = presorted.map_or(0, |(_, particles)| particles);
        if known == 0 {
            self.begin();
        }
        let looked = self.look(chunk, known, sorting, scratch, |_| true);
        debug_assert!(
            known == 0 || looked.is_err() || self.are_as_new(chunk, sorting),
            "particles have changed since they were sorted"
        );
        self.close(chunk, sorting, looked)
    }

    /// As [`LeafBins::sort`] for the particles of a group alone.
    pub(in crate::solver) fn sort_group(
        &mut self,
        chunk: &Chunk<D>,
        sorting: &Sorting<'_, D, impl BoxWidths<D>>,
        scratch: &mut Scratch,
        group: &Group<'_>,
    ) -> Result<bool, BinMissing> {
        self.presorted = None;
        self.begin();
        let tags = chunk.tags();
        let looked = self.look(chunk, 0, sorting, scratch, |p| group.has(tags[p as usize]));
        let strangers = (0..chunk.len() as u32).filter(|&p| !group.has(tags[p as usize]));
        self.outside_own_bin.extend(strangers.map(|p| (p, STRANGER)));
        self.outside_own_bin.sort_unstable();
        self.close(chunk, sorting, looked)
    }

    /// Makes the lists once it is known which particles are not whole in the leaf's own bin.
    fn close(
        &mut self,
        chunk: &Chunk<D>,
        sorting: &Sorting<'_, D, impl BoxWidths<D>>,
        looked: Result<(), BinMissing>,
    ) -> Result<bool, BinMissing> {
        let touches_all_nodes = chunk.len() >= touches_all_nodes(D);
        if touches_all_nodes && self.outside_own_bin.is_empty() {
            return Ok(false);
        }
        self.list(chunk.len() as u32);
        let &Sorting { plan, leaf, .. } = sorting;
        for (members, bin) in self.members.iter_mut().zip(&plan.bins[plan.leaf_bins(leaf)]) {
            members.close(plan, bin);
        }
        if touches_all_nodes {
            self.members[0].window = Window::FULL;
        }
        looked.map(|()| true)
    }

    /// Classifies the particles now, while they are in the cache, so that the next [`LeafBins::sort`] only
    /// classifies those that are appended until then. Any other change of the chunk ends its revision, and
    /// `sort` starts over.
    pub(in crate::solver) fn presort(
        &mut self,
        chunk: &mut Chunk<D>,
        sorting: &Sorting<'_, D, impl BoxWidths<D>>,
        scratch: &mut Scratch,
    ) {
        if chunk.len() < touches_all_nodes(D) {
            return;
        }
        self.begin();
        // The next sort finds an error again, and reports it.
        let looked = self.look(chunk, 0, sorting, scratch, |_| true);
        self.presorted = looked.ok().and_then(|()| Some((chunk.revision()?, chunk.len())));
    }

    /// Whether a sort from the beginning leads to the same.
    fn are_as_new(&self, chunk: &Chunk<D>, sorting: &Sorting<'_, D, impl BoxWidths<D>>) -> bool {
        let mut new = self.clone();
        new.begin();
        let looked = new.look(chunk, 0, sorting, &mut Scratch::default(), |_| true);
        looked.is_ok() && new.outside_own_bin == self.outside_own_bin && new.cut == self.cut
    }

    fn begin(&mut self) {
        self.cut.clear();
        self.outside_own_bin.clear();
        self.members.iter_mut().for_each(BinMembers::clear);
    }

    /// Finds the bins of the particles from number `from` on, as far as they are members.
    fn look(
        &mut self,
        chunk: &Chunk<D>,
        from: usize,
        sorting: &Sorting<'_, D, impl BoxWidths<D>>,
        scratch: &mut Scratch,
        is_member: impl Fn(u32) -> bool,
    ) -> Result<(), BinMissing> {
        let &Sorting { plan, widths, leaf, own } = sorting;
        if self.around.is_empty() {
            let (tree, edge) = (&plan.tree, plan.root_edge);
            let around = leaves_around(tree, tree.first_own() + leaf);
            self.around = around.into_iter().map(|leaf| near_leaf(tree, leaf, edge)).collect();
        }
        let touches_all_nodes = chunk.len() >= touches_all_nodes(D);
        let own_cell = plan.cell(own.level);
        let given = !widths.are_known_to_kernels();
        let faces = if given { None } else { self.faces.take() };
        // Most boxes are known to be whole and inside without their half widths.
        let limit = Lanes::splat(narrow_limit(own_cell));
        scratch.undecided.clear();
        list_lanes(from..chunk.len(), &mut scratch.undecided, |first| {
            if given || !touches_all_nodes {
                return !0;
            }
            let half = widths.bounds(chunk, first);
            let elsewhere = faces.as_ref().map_or(0, |faces| {
                faces.undecided(half, |axis| values(chunk, Layout::<D>::POSITION + axis, first))
            });
            let lanes = elsewhere | (!half.le(limit)).bits();
            if lanes != 0 {
                widths.read_ahead(chunk, first);
            }
            lanes
        });
        scratch.undecided.retain(|&p| is_member(p));
        let mut sorted = Ok(());
        let limits = [own_cell, plan.cell(own.level + 1)].map(narrow_limit);
        for particles in scratch.undecided.chunks(LANES) {
            let half = widths.of_batch(chunk, particles, own_cell);
            let centre = positions_of(chunk, particles);
            let known = faces.as_ref().map(|faces| faces.bins(&centre, &half, limits));
            let (half, centre) = (half.map(Lanes::to_array), centre.map(Lanes::to_array));
            for (lane, &p) in particles.iter().enumerate() {
                let (centre, half) = (centre.map(|x| x[lane]), half.map(|half| half[lane]));
                let bin = match known.and_then(|known| known[lane]) {
                    Some(bin) => Ok(bin),
                    None => self.sort_one(plan, leaf, own, faces.as_ref(), p, centre, half, given),
                };
                let bin = bin.unwrap_or_else(|()| {
                    sorted = sorted.and(Err(BinMissing { id: chunk.ids()[p as usize] }));
                    CUT
                });
                if bin != 0 {
                    self.outside_own_bin.push((p, bin));
                }
                // The window of a crowded leaf's own bin is known.
                if bin != CUT && !(bin == 0 && touches_all_nodes) {
                    let cell = plan.cell(plan.bins[plan.leaf_bins(leaf)][bin as usize].block.level);
                    self.members[bin as usize].include(cell, centre, half);
                }
            }
        }
        if faces.is_some() {
            self.faces = faces;
        }
        sorted
    }

    /// Makes the lists of whole boxes of a leaf with so many particles.
    fn list(&mut self, particles: u32) {
        let mut next = 0;
        for &(p, bin) in &self.outside_own_bin {
            self.members[0].whole.extend(next..p);
            next = p + 1;
            if bin != CUT && bin != STRANGER {
                self.members[bin as usize].whole.push(p);
            }
        }
        self.members[0].whole.extend(next..particles);
    }

    /// Finds the bin of one box that [`LeafFaces::bins`] leaves open, or cuts it.
    fn sort_one(
        &mut self,
        plan: &GridPlan<D>,
        leaf: usize,
        own: &NearLeaf<D>,
        faces: Option<&LeafFaces<D>>,
        particle: u32,
        centre: [f64; D],
        half: [f64; D],
        given: bool,
    ) -> Result<u32, ()> {
        // Tables of the leaves across the faces hold for boxes up to a cell wide.
        let faces = faces.filter(|_| is_narrow(half, plan.cell(own.level)));
        let level = self.finest_level(own, faces, centre, half);
        if !given && is_narrow(half, plan.cell(level)) {
            // The first bin of a leaf is its own block's.
            let bin = if level == own.level { Some(0) } else { self.bin(plan, leaf, level, centre) };
            return bin.map(|bin| bin as u32).ok_or(());
        }
        let slot = self.cut.len() as u32;
        self.cut.push(particle);
        let roots = plan.tree.brick().roots;
        let extent = roots.map(|roots| f64::from(roots) * plan.root_edge);
        let softening = match given {
            true => [1.0; D],
            false => softening_at(&centre, &half, plan.cell(level), &extent),
        };
        let (fraction, spread) = (1.0, [0.0; D]);
        let whole = SubBox { particle, slot, centre, half, whole: half[0], softening, fraction, spread };
        self.cut_box(plan, leaf, own, faces, whole)?;
        Ok(CUT)
    }

    /// Halves a box along the axes on which it is too wide, until each part fits the level it overlaps.
    fn cut_box(
        &mut self,
        plan: &GridPlan<D>,
        leaf: usize,
        own: &NearLeaf<D>,
        faces: Option<&LeafFaces<D>>,
        part: SubBox<D>,
    ) -> Result<(), ()> {
        let level = self.finest_level(own, faces, part.centre, part.half);
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
            self.cut_box(plan, leaf, own, faces, SubBox { centre, half, fraction, ..part })?;
        }
        Ok(())
    }

    /// Finest level among the leaves that the open box overlaps, or touches up to round-off: if the kernel
    /// saw an overlap that is none here, it would access nodes that do not exist within finer leaves. `faces`
    /// are those of the leaf, for boxes at most a cell wide.
    fn finest_level(
        &self,
        own: &NearLeaf<D>,
        faces: Option<&LeafFaces<D>>,
        centre: [f64; D],
        half: [f64; D],
    ) -> u8 {
        match faces.map(|faces| faces.side(faces.faces(&centre, &half))) {
            Some(Side::Own) => return own.level,
            Some(Side::Finer) => return own.level + 1,
            Some(Side::Other) | None => {}
        }
        let slack = own.slack();
        let lo: [f64; D] = std::array::from_fn(|axis| centre[axis] - half[axis] - slack[axis]);
        let hi: [f64; D] = std::array::from_fn(|axis| centre[axis] + half[axis] + slack[axis]);
        if (0..D).all(|axis| lo[axis] >= own.lower[axis] && hi[axis] <= own.upper[axis]) {
            return own.level;
        }
        self.around
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

/// Positions of up to [`LANES`] particles, at least one; lanes behind the last repeat it.
#[inline(always)]
fn positions_of<const D: usize>(chunk: &Chunk<D>, particles: &[u32]) -> [Lanes; D] {
    std::array::from_fn(|axis| {
        let column = chunk.column(Layout::<D>::POSITION + axis);
        let last = particles.len() - 1;
        Lanes::new(std::array::from_fn(|lane| column[particles[last.min(lane)] as usize]))
    })
}

/// Whether a box fits into the stencil of cells of edge `cell`. Rounding in the half widths must not
/// cut a box that is exactly one cell wide; the kernel takes such a box as one cell wide, which is no more
/// than a few units of the last place.
fn is_narrow<const N: usize>(half: [f64; N], cell: f64) -> bool {
    half.iter().all(|&half| half <= narrow_limit(cell))
}

/// Half width of the widest boxes that fit into the stencil of cells of edge `cell`, see [`is_narrow`].
fn narrow_limit(cell: f64) -> f64 {
    0.5 * cell * (1.0 + 8.0 * f64::EPSILON)
}
