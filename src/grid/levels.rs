//! Node fields between levels: sums go from constrained nodes to their parents, velocities back.
use rayon::prelude::*;

use super::arena::{Arenas, Moments};
use super::fields::{NodeFields, ZERO};
use super::links::{Links, NO_MOMENTS, weight_of};
use super::mask::{block_nodes, offset};
use super::plan::GridPlan;
use crate::kernel::Row;
use crate::kernel::simd::F64x4;

/// One block of the fields, mutable.
struct BlockMut<'a, const D: usize> {
    rows: &'a mut [Row],
    moments: Option<&'a mut [Moments<D>]>,
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
                split(&mut self.rows, &mut self.moments, plan, level + 1, self.moment_start[level + 1]);
            for_each_linked(coarse, plan, links, &self.active, |mut to, first, nodes| {
                let constrained = plan.blocks[first / block_nodes(D)].constrained;
                for i in nodes {
                    let at = links.nodes[i] as usize - first;
                    let links = links.of(i);
                    let mut row = F64x4::new(to.rows[at].0);
                    for link in links {
                        let step = &steps[link.offset as usize];
                        let mut sum = F64x4::new(fine.row(link.node).0);
                        for (moment, delta) in fine.moments(link.moments).iter().zip(step.delta) {
                            sum = F64x4::new(moment.0).mul_add(delta, sum);
                        }
                        row = step.weight.mul_add(sum, row);
                    }
                    to.rows[at] = Row(row.to_array());
                    // Real nodes need no moments.
                    if constrained >> at & 1 == 1
                        && let Some(own) = &mut to.moments
                    {
                        for link in links {
                            let weight = steps[link.offset as usize].weight;
                            for (own, moment) in own[at].iter_mut().zip(fine.moments(link.moments)) {
                                *own =
                                    Row(weight.mul_add(F64x4::new(moment.0), F64x4::new(own.0)).to_array());
                            }
                        }
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
                split(&mut self.rows, &mut self.moments, plan, level, self.moment_start[level]);
            for_each_linked(fine, plan, links, &self.needed, |mut to, first, nodes| {
                for i in nodes {
                    let mut row = F64x4::splat(0.0);
                    let mut sums = [row; D];
                    for link in links.of(i) {
                        let step = &steps[link.offset as usize];
                        let [x, y, z, _] = coarse.row(link.node).0;
                        let value = F64x4::new([x, y, z, 0.0]);
                        row = step.weight.mul_add(value, row);
                        let moments = coarse.moments(link.moments);
                        for axis in 0..D {
                            let moment = value.mul_add(step.delta[axis], F64x4::new(moments[axis].0));
                            sums[axis] = step.weight.mul_add(moment, sums[axis]);
                        }
                    }
                    let at = links.nodes[i] as usize - first;
                    to.rows[at] = Row(row.to_array());
                    if let Some(moments) = &mut to.moments {
                        moments[at] = sums.map(|sum| Row(sum.to_array()));
                    }
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

/// The fields of the levels below `level`, whose first moment slot is `slot`, and those of `level` and deeper.
fn split<'a, const D: usize>(
    rows: &'a mut [Row],
    moments: &'a mut [Moments<D>],
    plan: &GridPlan<D>,
    level: usize,
    slot: usize,
) -> (Half<'a, D>, Half<'a, D>) {
    let (nodes, block) = (block_nodes(D), plan.level_start[level]);
    let (coarse_rows, fine_rows) = rows.split_at_mut(block * nodes);
    let (coarse_moments, fine_moments) = moments.split_at_mut(slot * nodes);
    (
        Half { rows: coarse_rows, moments: coarse_moments, first_block: 0, first_slot: 0 },
        Half { rows: fine_rows, moments: fine_moments, first_block: block, first_slot: slot },
    )
}

/// The fields of some levels.
struct Half<'a, const D: usize> {
    rows: &'a mut [Row],
    moments: &'a mut [Moments<D>],
    first_block: usize,
    first_slot: usize,
}

impl<const D: usize> Half<'_, D> {
    /// Row of a node.
    #[inline(always)]
    fn row(&self, node: u32) -> &Row {
        &self.rows[node as usize - self.first_block * block_nodes(D)]
    }

    /// First moments at a place; zeros for [`NO_MOMENTS`].
    #[inline(always)]
    fn moments(&self, place: u32) -> &Moments<D> {
        if place == NO_MOMENTS {
            return &[ZERO; D];
        }
        &self.moments[place as usize - self.first_slot * block_nodes(D)]
    }
}

/// Weight and distance of the parent at an offset from a constrained node.
#[derive(Clone, Copy)]
struct Step<const D: usize> {
    weight: F64x4,
    /// Parent minus constrained node, m, one number in all lanes.
    delta: [F64x4; D],
}

impl<const D: usize> Step<D> {
    /// By offset number, for constrained nodes of a level with this edge of cells.
    fn of_all(cell: f64) -> [Self; 27] {
        let step = |index: usize| {
            let offset = offset::<D>(index);
            let delta = std::array::from_fn(|axis| F64x4::splat(f64::from(offset[axis]) * cell));
            Self { weight: F64x4::splat(weight_of(offset)), delta }
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
    work: impl Fn(BlockMut<'_, D>, usize, std::ops::Range<usize>) + Sync,
) {
    let nodes = block_nodes(D);
    let Half { mut rows, mut moments, first_block, first_slot } = half;
    let (mut next_block, mut next_slot) = (first_block, first_slot);
    let mut tasks = Vec::new();
    for linked in links.blocks.iter().filter(|linked| flags[linked.block as usize]) {
        let block = linked.block as usize;
        let (_, rest) = std::mem::take(&mut rows).split_at_mut((block - next_block) * nodes);
        let (own, rest) = rest.split_at_mut(nodes);
        (rows, next_block) = (rest, block + 1);
        let own_moments = plan.blocks[block].moments.map(|slot| {
            let (_, rest) = std::mem::take(&mut moments).split_at_mut((slot as usize - next_slot) * nodes);
            let (own, rest) = rest.split_at_mut(nodes);
            (moments, next_slot) = (rest, slot as usize + 1);
            own
        });
        tasks.push((linked, BlockMut { rows: own, moments: own_moments }));
    }
    tasks.into_par_iter().with_min_len(4).for_each(|(linked, block)| {
        work(block, linked.block as usize * nodes, linked.nodes.start as usize..linked.nodes.end as usize);
    });
}
