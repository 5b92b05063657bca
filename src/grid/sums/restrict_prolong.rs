//! Node fields between levels: sums go from constrained nodes to their parents, velocities back.
use rayon::prelude::*;

use super::node_fields::NodeFields;
use crate::grid::arenas::Arenas;
use crate::grid::arenas::disjoint_slices::DisjointSlices;
use crate::grid::constraints::moments::{self, Moments};
use crate::grid::constraints::parent_table::{ParentNode, ParentTable, parity, weight_of};
use crate::grid::mask::{bits, block_nodes, offset};
use crate::grid::plan::links::{Child, FineBlock};
use crate::grid::plan::{Block, GridPlan, NO_BLOCK};
use crate::kernel::Row;
use crate::simd::F64x4;

/// One block of the fields, mutable.
struct BlockMut<'a> {
    rows: &'a mut [Row],
    moments: &'a mut [Row],
}

impl<const D: usize> NodeFields<D> {
    /// Not collective. Restriction. Adds the sums of constrained nodes to their parents, finest level first:
    /// `a_i += Σ c (a_j + A_j (x_i - x_j))`, `A_i += Σ c A_j`. A parent adds its children block by block
    /// along the curve.
    pub fn restrict(&mut self, plan: &GridPlan<D>) {
        for level in (1..plan.levels()).rev() {
            let links = &plan.links[level];
            for coarse in &links.coarse {
                if links.of(coarse).iter().any(|child| self.active[child.block as usize]) {
                    self.active[coarse.block as usize] = true;
                    self.dirty[coarse.block as usize] = true;
                }
            }
            let steps = Step::<D>::of_all(plan.cell(level as u8));
            let active = &self.active;
            let (to, from) = split(&mut self.rows, &mut self.moments, plan, level);
            let coarse = links.coarse.iter().filter(|coarse| active[coarse.block as usize]);
            let coarse = coarse.map(|coarse| (coarse.block, coarse));
            for_each_linked(to, plan, coarse, |mut to, coarse| {
                for child in links.of(coarse).iter().filter(|child| active[child.block as usize]) {
                    hand_up(plan, &steps, &from, *child, coarse.block, &mut to);
                }
            });
        }
    }

    /// Not collective. Prolongation. Interpolates the constrained nodes that the gather reads from their
    /// parents, coarsest level first: `v_j = Σ c v_i`, `V_j = Σ c (V_i + v_i ⊗ (x_i - x_j))`, with `V = 0` on
    /// real nodes.
    pub fn prolong(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>) {
        self.begin_prolong(plan, arenas);
        prolong(plan, &self.needed, &mut self.rows, &mut self.moments);
    }

    /// Not collective. Prolongation of these rows of all nodes in place of those of the fields. The moments
    /// of the fields become theirs.
    pub fn prolong_rows(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>, rows: &mut [Row]) {
        self.begin_prolong(plan, arenas);
        prolong(plan, &self.needed, rows, &mut self.moments);
    }

    /// Marks the blocks that the gather reads, and those among them that will differ from zero.
    fn begin_prolong(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>) {
        self.mark_needed(plan, arenas);
        for fine in plan.links.iter().skip(1).flat_map(|links| &links.fine) {
            self.dirty[fine.block as usize] |= self.needed[fine.block as usize];
        }
    }

    /// Not collective. Gives the real nodes that occupied bins reach these rows, by number of the node, and
    /// the constrained ones what they have of their parents. Nothing is summed in any block then.
    pub fn spread(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>, row: impl Fn(usize) -> Row + Sync) {
        self.mark_needed(plan, arenas);
        let nodes = block_nodes(D);
        self.active.fill(false);
        let blocks = self.rows.par_chunks_mut(nodes).zip(&mut self.dirty).zip(&self.needed).enumerate();
        blocks.with_min_len(64).for_each(|(index, ((rows, dirty), needed))| {
            if *needed || *dirty {
                rows.fill(Row::default());
                *dirty = *needed;
            }
            for bit in bits(if *needed { plan.blocks[index].real_nodes() } else { 0 }) {
                rows[bit as usize] = row(index * nodes + bit as usize);
            }
        });
        self.prolong(plan, arenas);
    }

    /// Not collective. Gives the constrained nodes that the gather reads the values `Σ c f_i` of their
    /// parents, once [`NodeFields::prolong`] has found them. One value for each node.
    pub fn prolong_values(&self, plan: &GridPlan<D>, values: &mut [f64]) {
        let nodes = block_nodes(D);
        for level in 1..plan.levels() {
            let first = plan.level_start[level];
            let (from, to) = values.split_at_mut(first * nodes);
            let mut to = DisjointSlices::new(to, first * nodes);
            let fine = plan.links[level].fine.iter().filter(|fine| self.needed[fine.block as usize]);
            let tasks = fine.map(|fine| {
                let block = fine.block as usize;
                (fine, to.cut(block * nodes..(block + 1) * nodes))
            });
            let tasks: Vec<_> = tasks.collect();
            tasks.into_par_iter().with_min_len(4).for_each(|(fine, to)| {
                let block = &plan.blocks[fine.block as usize];
                let (table, parity) = (ParentTable::of::<D>(), parity(block.coord));
                for bit in bits(block.needs_velocity & block.constrained) {
                    to[bit as usize] = table.of_node::<D>(parity, bit).iter().fold(0.0, |sum, parent| {
                        let of = fine.parents[usize::from(parent.corner) % 8];
                        let value = from.get(of as usize * nodes + usize::from(parent.bit)).copied();
                        weight_of(offset::<D>(parent.offset.into())).mul_add(value.unwrap_or(0.0), sum)
                    });
                }
            });
        }
    }

    /// Marks the blocks that occupied bins touch, and the blocks of their constraint parents.
    fn mark_needed(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>) {
        let needed = self.needed.par_iter_mut().enumerate().with_min_len(1024);
        needed.for_each(|(block, needed)| *needed = arenas.reach(block));
        for fine in plan.links.iter().rev().flat_map(|links| &links.fine) {
            if self.needed[fine.block as usize] {
                let parents = fine.parents.iter().filter(|parent| **parent != NO_BLOCK);
                parents.for_each(|&parent| self.needed[parent as usize] = true);
            }
        }
    }
}

/// Adds the sums of the constrained nodes of one block to their parents in the block `coarse`.
#[inline(always)]
fn hand_up<const D: usize>(
    plan: &GridPlan<D>,
    steps: &[Step<D>; 27],
    from: &Half<'_, D>,
    child: Child,
    coarse: u32,
    to: &mut BlockMut<'_>,
) {
    let table = ParentTable::of::<D>();
    let (fine, Block { needs_sum: sum, with_moments: passing, .. }) =
        (&plan.blocks[child.block as usize], &plan.blocks[coarse as usize]);
    let (parity, (rows, moments)) = (parity(fine.coord), from.of_block(plan, child.block));
    let is_here = |parent: &&ParentNode| parent.corner == child.corner && sum >> parent.bit & 1 == 1;
    for bit in bits(fine.needs_sum & fine.constrained & table.having(parity, child.corner)) {
        let row = F64x4::new(rows[bit as usize].0);
        let parents = table.of_node::<D>(parity, bit).iter().filter(is_here);
        if fine.with_moments >> bit & 1 == 0 {
            parents.for_each(|parent| {
                steps[usize::from(parent.offset)].add(row, &mut to.rows[usize::from(parent.bit)]);
            });
            continue;
        }
        let own: Moments<D> = moments::read(moments, fine.with_moments, bit);
        for parent in parents {
            let step = &steps[usize::from(parent.offset)];
            let value = (0..D).fold(row, |value, k| F64x4::new(own[k].0).mul_add(step.delta[k], value));
            step.add(value, &mut to.rows[usize::from(parent.bit)]);
            // Real nodes have no moments.
            if passing >> parent.bit & 1 == 1 {
                let mut sums: Moments<D> = moments::read(to.moments, *passing, parent.bit.into());
                sums.iter_mut().zip(&own).for_each(|(sum, own)| step.add(F64x4::new(own.0), sum));
                moments::write(to.moments, *passing, parent.bit.into(), &sums);
            }
        }
    }
}

/// Interpolates the constrained nodes of the needed blocks from their parents, coarsest level first.
fn prolong<const D: usize>(plan: &GridPlan<D>, needed: &[bool], rows: &mut [Row], moments: &mut [Row]) {
    for level in 1..plan.levels() {
        let links = &plan.links[level];
        let steps = Step::<D>::of_all(plan.cell(level as u8));
        let (from, to) = split(rows, moments, plan, level);
        let fine = links.fine.iter().filter(|fine| needed[fine.block as usize]);
        for_each_linked(to, plan, fine.map(|fine| (fine.block, fine)), |mut to, fine| {
            interpolate(plan, &steps, &from, fine, &mut to);
        });
    }
}

/// Gives the constrained nodes of a block the values and moments of their parents.
#[inline(always)]
fn interpolate<const D: usize>(
    plan: &GridPlan<D>,
    steps: &[Step<D>; 27],
    from: &Half<'_, D>,
    fine: &FineBlock,
    to: &mut BlockMut<'_>,
) {
    let block = &plan.blocks[fine.block as usize];
    let (table, parity) = (ParentTable::of::<D>(), parity(block.coord));
    let parents = fine.parents.map(|parent| {
        (parent != NO_BLOCK).then(|| (from.of_block(plan, parent), plan.blocks[parent as usize].with_moments))
    });
    for bit in bits(block.needs_velocity & block.constrained) {
        let mut row = F64x4::splat(0.0);
        for parent in table.of_node::<D>(parity, bit) {
            let Some(((rows, _), _)) = parents[usize::from(parent.corner) % 8] else { continue };
            let [x, y, z, _] = rows[usize::from(parent.bit)].0;
            row = steps[usize::from(parent.offset)].weight.mul_add(F64x4::new([x, y, z, 0.0]), row);
        }
        to.rows[bit as usize] = Row(row.to_array());
        if block.with_moments >> bit & 1 == 0 {
            continue;
        }
        let mut sums = [F64x4::splat(0.0); D];
        for parent in table.of_node::<D>(parity, bit) {
            let Some(((rows, moments), nodes)) = parents[usize::from(parent.corner) % 8] else { continue };
            let step = &steps[usize::from(parent.offset)];
            let [x, y, z, _] = rows[usize::from(parent.bit)].0;
            // Of real nodes these are zero.
            let of_parent: Moments<D> = moments::read(moments, nodes, parent.bit.into());
            for axis in 0..D {
                sums[axis] = step.weighted_delta[axis].mul_add(F64x4::new([x, y, z, 0.0]), sums[axis]);
                sums[axis] = step.weight.mul_add(F64x4::new(of_parent[axis].0), sums[axis]);
            }
        }
        moments::write(to.moments, block.with_moments, bit, &sums.map(|sum| Row(sum.to_array())));
    }
}

/// The fields of the levels below `level`, and those of `level` and deeper.
fn split<'a, const D: usize>(
    rows: &'a mut [Row],
    moments: &'a mut [Row],
    plan: &GridPlan<D>,
    level: usize,
) -> (Half<'a, D>, Half<'a, D>) {
    let (nodes, block, moment) = (block_nodes(D), plan.level_start[level], plan.first_moment(level));
    let (coarse_rows, fine_rows) = rows.split_at_mut(block * nodes);
    let (coarse_moments, fine_moments) = moments.split_at_mut(moment);
    (
        Half { rows: coarse_rows, moments: coarse_moments, first_block: 0, first_moment: 0 },
        Half { rows: fine_rows, moments: fine_moments, first_block: block, first_moment: moment },
    )
}

/// The fields of some levels.
struct Half<'a, const D: usize> {
    rows: &'a mut [Row],
    moments: &'a mut [Row],
    first_block: usize,
    first_moment: usize,
}

impl<const D: usize> Half<'_, D> {
    /// Rows and first moments of a block.
    #[inline(always)]
    fn of_block(&self, plan: &GridPlan<D>, block: u32) -> (&[Row], &[Row]) {
        let (nodes, moments) = (block_nodes(D), plan.moments_of(block as usize));
        let rows = &self.rows[(block as usize - self.first_block) * nodes..][..nodes];
        (rows, &self.moments[moments.start - self.first_moment..moments.end - self.first_moment])
    }
}

/// Weight and distance of the parent at an offset from a constrained node.
#[derive(Clone, Copy)]
struct Step<const D: usize> {
    weight: F64x4,
    /// Parent minus constrained node, m, one number in all lanes.
    delta: [F64x4; D],
    /// The product of both.
    weighted_delta: [F64x4; D],
}

impl<const D: usize> Step<D> {
    /// By offset number, for constrained nodes of a level with this edge of cells.
    fn of_all(cell: f64) -> [Self; 27] {
        let step = |index: usize| {
            let offset = offset::<D>(index);
            // Weights are powers of two, so that products with them are exact.
            let (weight, delta) = (weight_of(offset), offset.map(|along| f64::from(along) * cell));
            Self {
                weight: F64x4::splat(weight),
                delta: delta.map(F64x4::splat),
                weighted_delta: delta.map(|delta| F64x4::splat(weight * delta)),
            }
        };
        std::array::from_fn(step)
    }

    /// `to += weight value`.
    #[inline(always)]
    fn add(&self, value: F64x4, to: &mut Row) {
        *to = Row(self.weight.mul_add(value, F64x4::new(to.0)).to_array());
    }
}

/// Calls `work` in parallel with each of some blocks of `half`, which ascend, and what comes with it.
fn for_each_linked<'a, const D: usize, T: Sync + 'a>(
    half: Half<'_, D>,
    plan: &GridPlan<D>,
    blocks: impl Iterator<Item = (u32, &'a T)>,
    work: impl Fn(BlockMut<'_>, &T) + Sync,
) {
    let nodes = block_nodes(D);
    let mut rows = DisjointSlices::new(half.rows, half.first_block * nodes);
    let mut moments = DisjointSlices::new(half.moments, half.first_moment);
    let tasks: Vec<_> = blocks
        .map(|(block, with)| {
            let block = block as usize;
            let rows = rows.cut(block * nodes..(block + 1) * nodes);
            (with, BlockMut { rows, moments: moments.cut(plan.moments_of(block)) })
        })
        .collect();
    tasks.into_par_iter().with_min_len(4).for_each(|(with, block)| work(block, with));
}
