//! Node fields of one time step: sums of arenas, restriction, prolongation.
//!
//! Every sum runs in the order that the plan fixes from tree and particles, so its bits do not depend on
//! ranks or threads.
use rayon::prelude::*;

use super::arena::{Arenas, Moments};
use super::exchange::ReceivedArenas;
use super::mask::{arena_overlap, bits, block_nodes, offset, offset_count};
use super::plan::{GridPlan, NO_BLOCK, Source, arena_index};
use crate::kernel::{Row, arena_nodes};

const ZERO: Row = Row([0.0; 4]);

/// Rows of all blocks of a plan: momentum and mass after the sums, velocity after the update.
#[derive(Clone, Debug)]
pub struct NodeFields<const D: usize> {
    /// One row per node, block by block.
    pub rows: Vec<Row>,
    /// First moments of nodes in blocks that hold constrained nodes.
    pub moments: Vec<Moments<D>>,
    /// Per offset number: `(arena index, node bit)` of the nodes that arena and block share.
    shared: Vec<Vec<(u32, u32)>>,
}

/// Which blocks to sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Blocks to which own bins contribute alone.
    Interior,
    /// Blocks that also need received arenas.
    Seam,
}

impl<const D: usize> NodeFields<D> {
    /// Fields for the blocks of a plan.
    pub fn new(plan: &GridPlan<D>) -> Self {
        let nodes = block_nodes(D);
        let shared = (0..offset_count(D))
            .map(|index| {
                bits(arena_overlap::<D>(offset(index)))
                    .map(|bit| (arena_index::<D>(index, bit) as u32, bit))
                    .collect()
            })
            .collect();
        Self {
            rows: vec![ZERO; plan.blocks.len() * nodes],
            moments: vec![[ZERO; D]; plan.moment_blocks * nodes],
            shared,
        }
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.rows.capacity() * size_of::<Row>() + self.moments.capacity() * size_of::<Moments<D>>()
    }

    /// Not collective. Adds up the arenas that reach each block of `part`.
    pub fn sum(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>, received: &ReceivedArenas<D>, part: Part) {
        let nodes = block_nodes(D);
        let shared = &self.shared;
        let mut moments = self.moments.chunks_mut(nodes);
        let blocks: Vec<_> = self
            .rows
            .chunks_mut(nodes)
            .zip(&plan.blocks)
            .enumerate()
            .map(|(index, (rows, block))| (index, rows, block.moments.and_then(|_| moments.next())))
            .collect();
        blocks.into_par_iter().with_min_len(16).for_each(|(index, rows, mut moments)| {
            let contributions = plan.block_contributions(index);
            let is_seam = contributions.iter().any(|c| matches!(c.source, Source::Received(..)));
            if is_seam != (part == Part::Seam) {
                return;
            }
            rows.fill(ZERO);
            if let Some(moments) = &mut moments {
                moments.fill([ZERO; D]);
            }
            for contribution in contributions {
                match contribution.source {
                    Source::Own(bin) => {
                        let Some(arena) = arenas.rows(bin.0) else { continue };
                        let shared = &shared[contribution.offset as usize];
                        add_rows(rows, arena, shared);
                        if let (Some(to), Some(from)) = (&mut moments, arenas.moments(bin.0)) {
                            for &(at, bit) in shared {
                                add_moments(&mut to[bit as usize], &from[at as usize]);
                            }
                        }
                    }
                    Source::Received(bin, part) => {
                        received.add(bin, part, rows, moments.as_deref_mut());
                    }
                }
            }
        });
    }

    /// Not collective. Hands the sums of constrained nodes to their parents, finest level first:
    /// `a_i += Σ c (a_j + A_j (x_i - x_j))`, `A_i += Σ c A_j`.
    pub fn restrict(&mut self, plan: &GridPlan<D>) {
        for level in (0..plan.levels()).rev() {
            let links = &plan.restriction[level];
            let cell = plan.cell(level as u8 + 1);
            let sums: Vec<(Row, Moments<D>)> = (0..links.nodes.len())
                .into_par_iter()
                .with_min_len(256)
                .map(|i| {
                    let node = links.nodes[i];
                    let mut row = self.rows[node as usize].0;
                    let mut own = self.moments_of(plan, node);
                    for link in links.of(i) {
                        let child = self.rows[link.node as usize].0;
                        let child_moments = self.moments_of(plan, link.node);
                        let delta = offset::<D>(link.offset as usize).map(|o| f64::from(o) * cell);
                        for lane in 0..4 {
                            let mut a = child[lane];
                            for axis in 0..D {
                                a = child_moments[axis].0[lane].mul_add(delta[axis], a);
                                own[axis].0[lane] =
                                    link.weight.mul_add(child_moments[axis].0[lane], own[axis].0[lane]);
                            }
                            row[lane] = link.weight.mul_add(a, row[lane]);
                        }
                    }
                    (Row(row), own)
                })
                .collect();
            for (&node, (row, moments)) in links.nodes.iter().zip(sums) {
                self.rows[node as usize] = row;
                if let Some(slot) = plan.moment_node(node) {
                    self.moments[slot] = moments;
                }
            }
        }
    }

    /// Not collective. Gives constrained nodes the values of their parents, coarsest level first:
    /// `v_j = Σ c v_i`, `V_j = Σ c (V_i + v_i ⊗ (x_i - x_j))`, with `V = 0` on real nodes.
    pub fn prolong(&mut self, plan: &GridPlan<D>) {
        for level in 1..plan.levels() {
            let links = &plan.prolongation[level];
            let cell = plan.cell(level as u8);
            let values: Vec<(Row, Moments<D>)> = (0..links.nodes.len())
                .into_par_iter()
                .with_min_len(256)
                .map(|i| {
                    let mut row = [0.0; 4];
                    let mut moments = [ZERO; D];
                    for link in links.of(i) {
                        let parent = self.rows[link.node as usize].0;
                        let parent_moments = self.prolonged_moments(plan, link.node);
                        let delta = offset::<D>(link.offset as usize).map(|o| f64::from(o) * cell);
                        for lane in 0..3 {
                            row[lane] = link.weight.mul_add(parent[lane], row[lane]);
                            for axis in 0..D {
                                let moment = parent[lane].mul_add(delta[axis], parent_moments[axis].0[lane]);
                                let sum = &mut moments[axis].0[lane];
                                *sum = link.weight.mul_add(moment, *sum);
                            }
                        }
                    }
                    (Row(row), moments)
                })
                .collect();
            for (&node, (row, moments)) in links.nodes.iter().zip(values) {
                self.rows[node as usize] = row;
                if let Some(slot) = plan.moment_node(node) {
                    self.moments[slot] = moments;
                }
            }
        }
    }

    /// Not collective. Copies the nodes around a bin into its arena: velocities, and for bins that touch
    /// constrained nodes their first moments and second moments of the constraints.
    pub fn load(&self, plan: &GridPlan<D>, bin: usize, arena: &mut VelocityArena<D>) {
        let bin = &plan.bins[bin];
        arena.rows.fill(ZERO);
        arena.has_moments = bin.touched.is_some();
        if arena.has_moments {
            arena.moments.fill([ZERO; D]);
            arena.spread.fill(ZERO);
        }
        let nodes = block_nodes(D);
        for (index, &block) in bin.around.iter().enumerate().take(offset_count(D)) {
            if block == NO_BLOCK {
                continue;
            }
            let rows = &self.rows[block as usize * nodes..][..nodes];
            let shared = &self.shared[index];
            for &(at, bit) in shared {
                arena.rows[at as usize] = rows[bit as usize];
            }
            let block = &plan.blocks[block as usize];
            if let Some(slot) = block.moments.filter(|_| arena.has_moments) {
                let first = slot as usize * nodes;
                for &(at, bit) in shared.iter().filter(|(_, bit)| block.constrained >> bit & 1 == 1) {
                    arena.moments[at as usize] = self.moments[first + bit as usize];
                    arena.spread[at as usize] = plan.spread[first + bit as usize];
                }
            }
        }
    }

    fn moments_of(&self, plan: &GridPlan<D>, node: u32) -> Moments<D> {
        plan.moment_node(node).map_or([ZERO; D], |slot| self.moments[slot])
    }

    /// Moments of a parent during prolongation: zero on real nodes, whose slots still hold sums.
    fn prolonged_moments(&self, plan: &GridPlan<D>, node: u32) -> Moments<D> {
        let nodes = block_nodes(D);
        let block = &plan.blocks[node as usize / nodes];
        match block.constrained >> (node as usize % nodes) & 1 {
            1 => self.moments_of(plan, node),
            _ => [ZERO; D],
        }
    }
}

/// Velocities around one bin, for the gather.
#[derive(Clone, Debug)]
pub struct VelocityArena<const D: usize> {
    /// Velocity rows.
    pub rows: Vec<Row>,
    /// First moments `V_j`; zero at real nodes.
    pub moments: Vec<Moments<D>>,
    /// Second moments of the constraints `S_j`; zero at real nodes.
    pub spread: Vec<Row>,
    /// Whether moments and spread were loaded.
    pub has_moments: bool,
}

impl<const D: usize> Default for VelocityArena<D> {
    fn default() -> Self {
        let nodes = arena_nodes(D);
        Self {
            rows: vec![ZERO; nodes],
            moments: vec![[ZERO; D]; nodes],
            spread: vec![ZERO; nodes],
            has_moments: false,
        }
    }
}

fn add_rows(to: &mut [Row], from: &[Row], shared: &[(u32, u32)]) {
    for &(at, bit) in shared {
        let (to, from) = (&mut to[bit as usize].0, &from[at as usize].0);
        for lane in 0..4 {
            to[lane] += from[lane];
        }
    }
}

/// Adds one node's moments.
pub(super) fn add_moments<const D: usize>(to: &mut Moments<D>, from: &Moments<D>) {
    for axis in 0..D {
        for lane in 0..3 {
            to[axis].0[lane] += from[axis].0[lane];
        }
    }
}
