//! Node fields of one time step: sums of arenas, and what the gather reads; `levels.rs` has restriction and prolongation.
//!
//! Every sum runs in the order that the plan fixes from tree and particles, so its bits do not depend on
//! ranks or threads. Blocks that no particle reaches are passed over: their rows are zero.
use rayon::prelude::*;

use super::arena::Arenas;
use super::columns::axes_in;
use super::exchange::ReceivedSums;
use super::mask::{bits, block_nodes, offset_count};
use super::mixed::Mixed;
use super::plan::{Block, GridPlan, NO_BLOCK};
use super::region::Regions;
use super::sums::{BlockSum, Sources};
use super::window::{Shared, Window};
use crate::kernel::{Row, arena_nodes};

pub(super) const ZERO: Row = Row([0.0; 4]);

/// Rows of all blocks of a plan: momentum and mass after the sums, velocity after the update.
#[derive(Clone, Debug)]
pub struct NodeFields<const D: usize> {
    /// One row per node, block by block.
    pub rows: Vec<Row>,
    /// First moments, block by block, by number of the column.
    pub moments: Vec<Row>,
    /// Per block, whether something was summed in it in this step.
    pub active: Vec<bool>,
    /// Nodes that own arenas touch in this step, of blocks whose sums other ranks ask for.
    touched: Vec<u64>,
    /// Per block, whether the gather of this step reads it or a block that it is a parent of.
    pub(super) needed: Vec<bool>,
    /// Per block, whether its rows may differ from zero.
    pub(super) dirty: Vec<bool>,
}

/// Blocks that one task adds up.
const TASK: usize = 16;

/// The first moments of the blocks of each task.
fn moment_tasks<'a, const D: usize>(plan: &GridPlan<D>, moments: &'a mut [Row]) -> Vec<&'a mut [Row]> {
    let mut rest = moments;
    let columns = |blocks: &[Block<D>]| blocks.iter().map(|block| block.columns.len()).sum();
    let task = |blocks: &[Block<D>]| {
        let (own, others) = std::mem::take(&mut rest).split_at_mut(columns(blocks));
        rest = others;
        own
    };
    plan.blocks.chunks(TASK).map(task).collect()
}

/// Which blocks to sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Blocks of which other ranks ask for sums; first, so that they can be sent.
    Asked,
    /// All others.
    Rest,
}

/// One block of the fields with what is noted of it, mutable.
struct Slot<'a> {
    rows: &'a mut [Row],
    moments: &'a mut [Row],
    active: &'a mut bool,
    dirty: &'a mut bool,
    touched: &'a mut u64,
}

impl<const D: usize> NodeFields<D> {
    /// Fields for the blocks of a plan.
    pub fn new(plan: &GridPlan<D>) -> Self {
        let nodes = block_nodes(D);
        Self {
            rows: vec![ZERO; plan.blocks.len() * nodes],
            moments: vec![ZERO; plan.columns],
            active: vec![false; plan.blocks.len()],
            touched: vec![0; plan.blocks.len()],
            needed: vec![false; plan.blocks.len()],
            dirty: vec![false; plan.blocks.len()],
        }
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.rows.capacity() * size_of::<Row>() + self.moments.capacity() * size_of::<Row>()
    }

    /// Not collective. Adds up the own arenas that reach each block of `part`; `asked` says of each block whether other ranks
    /// ask for its sums.
    pub fn sum(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>, asked: &[bool], part: Part) {
        if part == Part::Asked && !asked.contains(&true) {
            return;
        }
        let sources = Sources { plan, arenas, received: None };
        let is_wanted = |index: usize| asked[index] == (part == Part::Asked);
        self.for_each_block(plan, |scratch, index, slot| {
            if !is_wanted(index) {
                return;
            }
            let next = index + 1;
            if next < plan.blocks.len() && arenas.reach(next) && is_wanted(next) {
                sources.read_ahead(next);
            }
            let block = &plan.blocks[index];
            let mut is_reached = false;
            *slot.touched = 0;
            if arenas.reach(index) && (asked[index] || block.sum != 0) {
                let mut sum = BlockSum::find(sources, scratch, index, None);
                is_reached = !sum.is_empty();
                if is_reached {
                    sum.sum_rows(u32::MAX, slot.rows);
                    sum.sum_moments(u64::MAX, slot.moments);
                    if part == Part::Asked {
                        *slot.touched = sum.own_nodes();
                    }
                }
            }
            if *slot.dirty && !is_reached {
                slot.rows.fill(ZERO);
                slot.moments.fill(ZERO);
            }
            *slot.active = is_reached && block.sum != 0;
            *slot.dirty = is_reached;
        });
    }

    /// Not collective. Adds what other ranks have sent. Where their share and the own one are one subtree each, that is all; other
    /// regions are added up anew.
    pub fn add_received(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>, received: &ReceivedSums<D>) {
        if plan.pieces.is_empty() {
            return;
        }
        let sources = Sources { plan, arenas, received: Some(received) };
        let regions = Regions::of::<D>();
        self.for_each_block(plan, |scratch, index, slot| {
            let (mut rest, columns) = (0, plan.blocks[index].columns);
            for part in plan.parts(index) {
                let touched = received.touched(part.piece) & regions.nodes[part.region as usize];
                if touched == 0 {
                    continue;
                }
                (*slot.active, *slot.dirty) = (true, true);
                if !part.is_only {
                    rest |= 1 << part.region;
                    continue;
                }
                for bit in bits(touched) {
                    slot.rows[bit as usize].add(&received.row(part.piece, bit));
                }
                for bit in bits(touched & columns.nodes()) {
                    let more = received.moments(part.piece, bit);
                    let own = slot.moments[columns.first_of(bit)..].iter_mut();
                    own.zip(axes_in::<D>(columns.axes_of(bit))).for_each(|(own, axis)| own.add(&more[axis]));
                }
            }
            if rest != 0 {
                let mut sum = BlockSum::find(sources, scratch, index, None);
                sum.sum_rows(rest, slot.rows);
                sum.sum_moments(regions.nodes_in(rest), slot.moments);
            }
        });
    }

    /// Calls `work` in parallel for all blocks.
    fn for_each_block(&mut self, plan: &GridPlan<D>, work: impl Fn(&mut Mixed<D>, usize, Slot<'_>) + Sync) {
        let nodes = block_nodes(D);
        let rows = self.rows.par_chunks_mut(TASK * nodes);
        let active = self.active.par_chunks_mut(TASK);
        let flags = active.zip(self.dirty.par_chunks_mut(TASK)).zip(self.touched.par_chunks_mut(TASK));
        let moments = moment_tasks(plan, &mut self.moments);
        let tasks = rows.zip(flags).zip(moments).enumerate();
        tasks.for_each_init(Mixed::default, |scratch, (task, ((rows, flags), moments))| {
            let mut rest = moments;
            let ((active, dirty), touched) = flags;
            let flags = active.iter_mut().zip(dirty).zip(touched);
            for (index, (rows, ((active, dirty), touched))) in
                (task * TASK..).zip(rows.chunks_mut(nodes).zip(flags))
            {
                let (moments, others) =
                    std::mem::take(&mut rest).split_at_mut(plan.blocks[index].columns.len());
                rest = others;
                work(scratch, index, Slot { rows, moments, active, dirty, touched });
            }
        });
    }

    /// Nodes that own arenas touch in this step, of a block whose sums other ranks ask for.
    pub(super) fn touched(&self, block: usize) -> u64 {
        self.touched[block]
    }

    /// First moments of a block.
    pub(super) fn moments_of(&self, plan: &GridPlan<D>, block: usize) -> &[Row] {
        &self.moments[plan.moments_of(block)]
    }

    /// Not collective. Copies the nodes of `window` around a bin into its arena: velocities, and for bins that
    /// touch nodes with first moments these.
    pub fn load(&self, plan: &GridPlan<D>, bin: usize, window: &Window<D>, arena: &mut VelocityArena<D>) {
        let bin = &plan.bins[bin];
        let constraints = bin.touched.map(|table| &plan.constraints[table as usize]);
        // Blocks on all sides give all nodes of the window a value.
        if bin.around[..offset_count(D)].contains(&NO_BLOCK) {
            window.for_each_run(|run| arena.rows[run].fill(ZERO));
        }
        let nodes = block_nodes(D);
        for (index, &block) in bin.around.iter().enumerate().take(offset_count(D)) {
            if block == NO_BLOCK {
                continue;
            }
            let rows = &self.rows[block as usize * nodes..][..nodes];
            let Some(shared) = window.shared(index) else { continue };
            copy_rows(shared, rows, &mut arena.rows);
            if let Some(constraints) = constraints {
                constraints.copy_block(index, self.moments_of(plan, block as usize), &mut arena.moments);
            }
        }
    }
}

/// Not collective. Copies the nodes of `window` around a bin from the rows of all blocks into an arena.
pub fn load_rows<const D: usize>(
    plan: &GridPlan<D>,
    bin: usize,
    window: &Window<D>,
    rows: &[Row],
    arena: &mut [Row],
) {
    window.for_each_run(|run| arena[run].fill(ZERO));
    let nodes = block_nodes(D);
    let around = plan.bins[bin].around.iter().take(offset_count(D)).enumerate();
    for (index, &block) in around.filter(|(_, block)| **block != NO_BLOCK) {
        if let Some(shared) = window.shared(index) {
            copy_rows(shared, &rows[block as usize * nodes..][..nodes], arena);
        }
    }
}

/// Copies the shared nodes from the rows of a block into those of an arena.
#[inline(always)]
fn copy_rows<const D: usize>(shared: Shared<D>, block: &[Row], arena: &mut [Row]) {
    let (block, arena) = (&block[..block_nodes(D)], &mut arena[..arena_nodes(D)]);
    shared.for_each_run(|run| {
        let to = &mut arena[run.arena..][..run.len];
        to.iter_mut().zip(&block[run.block..][..run.len]).for_each(|(to, from)| *to = *from);
    });
}

/// Velocities around one bin, for the gather.
#[derive(Clone, Debug)]
pub struct VelocityArena<const D: usize> {
    /// Velocity rows.
    pub rows: Vec<Row>,
    /// First moments `V_j`, by number of the column in the arena.
    pub moments: Vec<Row>,
}

impl<const D: usize> Default for VelocityArena<D> {
    fn default() -> Self {
        Self { rows: vec![ZERO; arena_nodes(D)], moments: vec![ZERO; D * arena_nodes(D)] }
    }
}
