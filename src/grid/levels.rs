//! Node fields between levels: sums go from constrained nodes to their parents, velocities back.
use rayon::prelude::*;

use super::arena::Arenas;
use super::columns::axes_in;
use super::fields::NodeFields;
use super::links::{Link, Links, weight_of};
use super::mask::{block_nodes, offset};
use super::plan::GridPlan;
use crate::kernel::Row;
use crate::kernel::simd::F64x4;

/// One block of the fields, mutable.
struct BlockMut<'a> {
    rows: &'a mut [Row],
    moments: &'a mut [Row],
}

impl<const D: usize> NodeFields<D> {
    /// Not collective. Hands the sums of constrained nodes to their parents, finest level first:
    /// `a_i += Σ c (a_j + A_j (x_i - x_j))`, `A_i += Σ c A_j`.
    pub fn restrict(&mut self, plan: &GridPlan<D>) {
        for level in (0..plan.levels().saturating_sub(1)).rev() {
            let links = &plan.restriction[level];
            for linked in &links.blocks {
                if links.others(linked).iter().any(|&other| self.active[other as usize]) {
                    self.active[linked.block as usize] = true;
                    self.dirty[linked.block as usize] = true;
                }
            }
            let steps = Step::<D>::of_all(plan.cell(level as u8 + 1));
            let (coarse, fine) =
                split(&mut self.rows, &mut self.moments, plan, level + 1, self.first_column[level + 1]);
            for_each_linked(coarse, plan, links, &self.active, |to, first, nodes| {
                let columns = plan.blocks[first / block_nodes(D)].columns;
                for i in nodes {
                    let at = links.nodes[i] as usize - first;
                    let links = links.of(i);
                    let mut row = F64x4::new(to.rows[at].0);
                    for link in links {
                        let step = &steps[link.offset as usize];
                        let mut sum = F64x4::new(fine.row(link.node).0);
                        fine.each_column(link, |axis, moment| {
                            sum = moment.mul_add(step.delta[axis], sum);
                        });
                        row = step.weight.mul_add(sum, row);
                    }
                    to.rows[at] = Row(row.to_array());
                    // Real nodes have no moments.
                    let axes = columns.axes_of(at as u32);
                    if axes != 0 {
                        let mut sums = columns.read(to.moments, at as u32).map(|row| F64x4::new(row.0));
                        for link in links {
                            let weight = steps[link.offset as usize].weight;
                            fine.each_column(link, |axis, moment| {
                                sums[axis] = weight.mul_add(moment, sums[axis]);
                            });
                        }
                        columns.write(to.moments, at as u32, &sums.map(|sum| Row(sum.to_array())));
                    }
                }
            });
        }
    }

    /// Not collective. Gives the constrained nodes that the gather reads the values of their parents, coarsest
    /// level first: `v_j = Σ c v_i`, `V_j = Σ c (V_i + v_i ⊗ (x_i - x_j))`, with `V = 0` on real nodes.
    pub fn prolong(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>) {
        self.mark_needed(plan, arenas);
        for level in 1..plan.levels() {
            let links = &plan.prolongation[level];
            let steps = Step::<D>::of_all(plan.cell(level as u8));
            let (coarse, fine) =
                split(&mut self.rows, &mut self.moments, plan, level, self.first_column[level]);
            for_each_linked(fine, plan, links, &self.needed, |to, first, nodes| {
                let columns = plan.blocks[first / block_nodes(D)].columns;
                for i in nodes {
                    let at = links.nodes[i] as usize - first;
                    let axes = columns.axes_of(at as u32);
                    let mut row = F64x4::splat(0.0);
                    let mut sums = [row; D];
                    for link in links.of(i) {
                        let step = &steps[link.offset as usize];
                        let [x, y, z, _] = coarse.row(link.node).0;
                        let value = F64x4::new([x, y, z, 0.0]);
                        row = step.weight.mul_add(value, row);
                        for axis in axes_in::<D>(axes) {
                            sums[axis] = step.weighted_delta[axis].mul_add(value, sums[axis]);
                        }
                        coarse.each_column(link, |axis, moment| {
                            sums[axis] = step.weight.mul_add(moment, sums[axis]);
                        });
                    }
                    to.rows[at] = Row(row.to_array());
                    columns.write(to.moments, at as u32, &sums.map(|sum| Row(sum.to_array())));
                }
            });
            for linked in &links.blocks {
                self.dirty[linked.block as usize] |= self.needed[linked.block as usize];
            }
        }
    }

    /// Marks the blocks that occupied bins touch, and the blocks of their constraint parents.
    fn mark_needed(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>) {
        let needed = self.needed.par_iter_mut().enumerate().with_min_len(1024);
        needed.for_each(|(block, needed)| *needed = arenas.reach(block));
        for links in plan.prolongation.iter().rev() {
            for linked in &links.blocks {
                if self.needed[linked.block as usize] {
                    links.others(linked).iter().for_each(|&other| self.needed[other as usize] = true);
                }
            }
        }
    }
}

/// The fields of the levels below `level`, whose first column of first moments is number `column`, and those of `level` and
/// deeper.
fn split<'a, const D: usize>(
    rows: &'a mut [Row],
    moments: &'a mut [Row],
    plan: &GridPlan<D>,
    level: usize,
    column: usize,
) -> (Half<'a, D>, Half<'a, D>) {
    let (nodes, block) = (block_nodes(D), plan.level_start[level]);
    let (coarse_rows, fine_rows) = rows.split_at_mut(block * nodes);
    let (coarse_moments, fine_moments) = moments.split_at_mut(column);
    (
        Half { rows: coarse_rows, moments: coarse_moments, first_block: 0, first_column: 0 },
        Half { rows: fine_rows, moments: fine_moments, first_block: block, first_column: column },
    )
}

/// The fields of some levels.
struct Half<'a, const D: usize> {
    rows: &'a mut [Row],
    moments: &'a mut [Row],
    first_block: usize,
    first_column: usize,
}

impl<const D: usize> Half<'_, D> {
    /// Row of a node.
    #[inline(always)]
    fn row(&self, node: u32) -> &Row {
        &self.rows[node as usize - self.first_block * block_nodes(D)]
    }

    /// Calls `f` with axis and value of each column of first moments that the node of a link has.
    #[inline(always)]
    fn each_column(&self, link: &Link, mut f: impl FnMut(usize, F64x4)) {
        if link.axes != 0 {
            let columns = &self.moments[link.moments as usize - self.first_column..];
            axes_in::<D>(link.axes).zip(columns).for_each(|(axis, column)| f(axis, F64x4::new(column.0)));
        }
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
}

/// Calls `work` in parallel for every linked block of `half` whose flag is set, with the block, its first node
/// and the numbers of its linked nodes.
fn for_each_linked<const D: usize>(
    half: Half<'_, D>,
    plan: &GridPlan<D>,
    links: &Links,
    flags: &[bool],
    work: impl Fn(BlockMut<'_>, usize, std::ops::Range<usize>) + Sync,
) {
    let nodes = block_nodes(D);
    let Half { mut rows, mut moments, first_block, first_column } = half;
    let (mut next_block, mut next_column) = (first_block, first_column);
    let mut tasks = Vec::new();
    for linked in links.blocks.iter().filter(|linked| flags[linked.block as usize]) {
        let block = linked.block as usize;
        let (_, rest) = std::mem::take(&mut rows).split_at_mut((block - next_block) * nodes);
        let (own, rest) = rest.split_at_mut(nodes);
        (rows, next_block) = (rest, block + 1);
        let columns = plan.moments_of(block);
        let (_, rest) = std::mem::take(&mut moments).split_at_mut(columns.start - next_column);
        let (own_moments, rest) = rest.split_at_mut(columns.len());
        (moments, next_column) = (rest, columns.end);
        tasks.push((linked, BlockMut { rows: own, moments: own_moments }));
    }
    tasks.into_par_iter().with_min_len(4).for_each(|(linked, block)| {
        work(block, linked.block as usize * nodes, linked.nodes.start as usize..linked.nodes.end as usize);
    });
}
