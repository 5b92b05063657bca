//! Node fields of one time step: sums of arenas, and values for the gather; `restrict_prolong.rs` has
//! restriction and prolongation.
//!
//! Every sum runs in the order that the plan fixes from tree and particles, so its bits do not depend on
//! ranks or threads. Blocks that no particle reaches are skipped: their rows are zero.
use rayon::prelude::*;

use super::contributions::{BlockSum, Irregular, Sources};
use super::received::ReceivedSums;
use crate::grid::arenas::Arenas;
use crate::grid::arenas::arena_schedule::FIRST;
use crate::grid::arenas::disjoint_slices::DisjointSlices;
use crate::grid::arenas::window::{Shared, Window};
use crate::grid::constraints::moments::first_row;
use crate::grid::mask::{bits, block_nodes, offset_count};
use crate::grid::order::region::Regions;
use crate::grid::plan::{Bin, GridPlan, NO_BLOCK};
use crate::kernel::{Row, arena_nodes};
use crate::memory::Block;

pub(super) const ZERO: Row = Row([0.0; 4]);

/// Rows of all blocks of a plan: momentum and mass after the sums, velocity after the update.
#[derive(Clone, Debug, Default)]
pub struct NodeFields<const D: usize> {
    /// One row per node, block by block. Those of blocks without contributions take no memory.
    pub rows: Block<Row>,
    /// First moments, block by block.
    pub moments: Block<Row>,
    /// Per block, whether something was summed in it in this step.
    pub active: Vec<bool>,
    /// Nodes that own arenas touch in this step, of blocks whose sums other ranks ask for.
    touched: Vec<u64>,
    /// Per block, whether the gather of this step reads it or a block that it is a parent of.
    pub(in crate::grid) needed: Vec<bool>,
    /// Per block, whether its rows may differ from zero.
    pub(super) dirty: Vec<bool>,
}

/// Blocks that one task adds up, at least.
const TASK: usize = 16;

/// One block of the fields with its flags, mutable.
struct Slot<'a> {
    rows: &'a mut [Row],
    moments: &'a mut [Row],
    active: &'a mut bool,
    dirty: &'a mut bool,
    touched: &'a mut u64,
}

impl<const D: usize> NodeFields<D> {
    /// Those of some nodes of a block, a bit each, that have more than this mass, kg.
    pub fn with_mass(&self, block: usize, nodes: u64, least: f64) -> u64 {
        let rows = &self.rows[block * block_nodes(D)..][..block_nodes(D)];
        bits(nodes).filter(|&bit| rows[bit as usize].0[3] > least).fold(0, |nodes, bit| nodes | 1 << bit)
    }

    /// Fields for the blocks of a plan.
    pub fn new(plan: &GridPlan<D>) -> Self {
        let nodes = block_nodes(D);
        Self {
            rows: Block::zeroed(plan.blocks.len() * nodes),
            moments: Block::zeroed(plan.moments),
            active: vec![false; plan.blocks.len()],
            touched: vec![0; plan.blocks.len()],
            needed: vec![false; plan.blocks.len()],
            dirty: vec![false; plan.blocks.len()],
        }
    }

    /// Bytes held, those of blocks that were never reached among them, which take none.
    pub fn heap_bytes(&self) -> usize {
        size_of_val(&*self.rows) + size_of_val(&*self.moments)
    }

    /// Not collective. Adds the mass of other fields to that of these, and sets the mean velocities by mass.
    /// All rows hold velocities.
    pub fn add_material(&mut self, other: &Self) {
        let nodes = block_nodes(D);
        let blocks = other.rows.chunks(nodes).zip(self.rows.chunks_mut(nodes)).enumerate();
        for (block, (from, to)) in blocks.filter(|(block, _)| other.active[*block]) {
            for (to, from) in to.iter_mut().zip(from).filter(|(_, from)| from.0[3] > 0.0) {
                let mass = to.0[3] + from.0[3];
                let mean = |a: usize| to.0[3].mul_add(to.0[a], from.0[3] * from.0[a]) / mass;
                *to = Row([mean(0), mean(1), mean(2), mass]);
            }
            (self.active[block], self.dirty[block]) = (true, true);
        }
    }

    /// Whether rows of a block may differ from zero.
    pub fn may_hold(&self, block: usize) -> bool {
        self.dirty[block]
    }

    /// Not collective. Adds up the own arenas that reach each block of a wave. The first wave comes first.
    pub fn sum(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>, wave: usize) {
        if wave == FIRST {
            self.clear(plan, arenas);
        }
        let sources = Sources { plan, arenas, received: None };
        let blocks = arenas.schedule().blocks(wave);
        self.for_each_block(plan, blocks, |scratch, place, slot| {
            if let Some(&next) = blocks.get(place + 1) {
                sources.read_ahead(next as usize);
            }
            let index = blocks[place] as usize;
            let block = &plan.blocks[index];
            let mut is_reached = false;
            *slot.touched = 0;
            if wave == FIRST || block.needs_sum != 0 {
                let mut sum = BlockSum::find(sources, scratch, index, None);
                is_reached = !sum.is_empty();
                if is_reached {
                    sum.sum_rows(u32::MAX, slot.rows);
                    sum.sum_moments(u64::MAX, slot.moments);
                    if wave == FIRST {
                        *slot.touched = sum.own_nodes();
                    }
                }
            }
            if *slot.dirty && !is_reached {
                slot.rows.fill(ZERO);
                slot.moments.fill(ZERO);
            }
            *slot.active = is_reached && block.needs_sum != 0;
            *slot.dirty = is_reached;
        });
    }

    /// Sets blocks to zero that hold values of the last step and that no own bin reaches in this one.
    fn clear(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>) {
        let is_left = |&block: &u32| self.dirty[block as usize] && !arenas.reach(block as usize);
        let left: Vec<u32> = (0..).take(plan.blocks.len()).filter(is_left).collect();
        self.for_each_block(plan, &left, |_, _, slot| {
            slot.rows.fill(ZERO);
            slot.moments.fill(ZERO);
            (*slot.active, *slot.dirty, *slot.touched) = (false, false, 0);
        });
    }

    /// Not collective. Adds the sums of other ranks. Where their share and the own one are one subtree each,
    /// one addition completes the region; other regions are added up anew.
    pub fn add_received(&mut self, plan: &GridPlan<D>, arenas: &Arenas<D>, received: &ReceivedSums<D>) {
        if plan.pieces.is_empty() {
            return;
        }
        let blocks: Vec<u32> = (0..).take(plan.blocks.len()).filter(|&i| plan.is_seam(i as usize)).collect();
        let sources = Sources { plan, arenas, received: Some(received) };
        let regions = Regions::of::<D>();
        self.for_each_block(plan, &blocks, |scratch, place, slot| {
            let index = blocks[place] as usize;
            let (mut rest, with_moments) = (0, plan.blocks[index].with_moments);
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
                for bit in bits(touched & with_moments) {
                    let more = received.moments(part.piece, bit);
                    let own = slot.moments[first_row::<D>(with_moments, bit)..].iter_mut();
                    own.zip(&more).for_each(|(own, more)| own.add(more));
                }
            }
            if rest != 0 {
                let mut sum = BlockSum::find(sources, scratch, index, None);
                sum.sum_rows(rest, slot.rows);
                sum.sum_moments(regions.nodes_in(rest), slot.moments);
            }
        });
    }

    /// Calls `work` in parallel for some blocks, which ascend, with their places among these.
    fn for_each_block(
        &mut self,
        plan: &GridPlan<D>,
        blocks: &[u32],
        work: impl Fn(&mut Irregular<D>, usize, Slot<'_>) + Sync,
    ) {
        let slots = self.slots(plan, blocks).into_par_iter().enumerate().with_min_len(TASK);
        slots.for_each_init(Irregular::default, |scratch, (place, slot)| work(scratch, place, slot));
    }

    /// Some blocks, which ascend.
    fn slots(&mut self, plan: &GridPlan<D>, blocks: &[u32]) -> Vec<Slot<'_>> {
        let nodes = block_nodes(D);
        let (mut rows, mut moments) =
            (DisjointSlices::new(&mut self.rows, 0), DisjointSlices::new(&mut self.moments, 0));
        let (mut active, mut dirty) =
            (DisjointSlices::new(&mut self.active, 0), DisjointSlices::new(&mut self.dirty, 0));
        let mut touched = DisjointSlices::new(&mut self.touched, 0);
        let slot = |&block: &u32| {
            let block = block as usize;
            Slot {
                rows: rows.cut(block * nodes..(block + 1) * nodes),
                moments: moments.cut(plan.moments_of(block)),
                active: &mut active.cut(block..block + 1)[0],
                dirty: &mut dirty.cut(block..block + 1)[0],
                touched: &mut touched.cut(block..block + 1)[0],
            }
        };
        blocks.iter().map(slot).collect()
    }

    /// Nodes that own arenas touch in this step, of a block whose sums other ranks ask for.
    pub(in crate::grid) fn touched(&self, block: usize) -> u64 {
        self.touched[block]
    }

    /// First moments of a block.
    pub(in crate::grid) fn moments_of(&self, plan: &GridPlan<D>, block: usize) -> &[Row] {
        &self.moments[plan.moments_of(block)]
    }

    /// Not collective. Copies the nodes of `window` around a bin into its arena: velocities, and for bins
    /// that touch nodes with first moments these. Prefetches the same of the occupied bin that comes next,
    /// and returns that.
    pub fn load(
        &self,
        plan: &GridPlan<D>,
        arenas: &Arenas<D>,
        number: usize,
        window: &Window<D>,
        arena: &mut VelocityArena<D>,
    ) -> Option<usize> {
        let bin = &plan.bins[number];
        let constraints = bin.touched.map(|table| &plan.constraints[table as usize]);
        // Blocks on all sides give all nodes of the window a value.
        if bin.around[..offset_count(D)].contains(&NO_BLOCK) {
            window.for_each_run(|run| arena.rows[run].fill(ZERO));
        }
        let nodes = block_nodes(D);
        for (index, block, shared) in shared_blocks(bin, window) {
            copy_rows(shared, &self.rows[block * nodes..][..nodes], &mut arena.rows);
            if let Some(constraints) = constraints {
                let of_block = plan.blocks[block].with_moments;
                constraints.copy_block(index, of_block, self.moments_of(plan, block), &mut arena.moments);
            }
        }
        let (next, window) = arenas.after(number)?;
        self.prefetch(plan, next, &window);
        Some(next)
    }

    /// Prefetches what [`NodeFields::load`] will copy: the blocks around a bin lie too far apart for the
    /// prefetcher of the processor.
    fn prefetch(&self, plan: &GridPlan<D>, bin: usize, window: &Window<D>) {
        let (rows, nodes) = (self.rows.as_ptr().addr(), block_nodes(D));
        for (_, block, shared) in shared_blocks(&plan.bins[bin], window) {
            shared.for_each_run(|run| run.read_ahead(rows + size_of::<Row>() * (block * nodes + run.block)));
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
    for (_, block, shared) in shared_blocks(&plan.bins[bin], window) {
        copy_rows(shared, &rows[block * nodes..][..nodes], arena);
    }
}

/// Not collective. Copies the nodes of `window` around a bin from values of all nodes into those of an arena.
pub fn load_values<const D: usize>(
    plan: &GridPlan<D>,
    bin: usize,
    window: &Window<D>,
    values: &[f64],
    arena: &mut [f64],
) {
    window.for_each_run(|run| arena[run].fill(0.0));
    let nodes = block_nodes(D);
    for (_, block, shared) in shared_blocks(&plan.bins[bin], window) {
        let block = &values[block * nodes..][..nodes];
        shared.for_each_run(|run| {
            arena[run.arena..][..run.len].copy_from_slice(&block[run.block..][..run.len])
        });
    }
}

/// The blocks around a bin that share nodes of `window`: offset number, block, and the nodes.
#[inline(always)]
fn shared_blocks<const D: usize>(
    bin: &Bin<D>,
    window: &Window<D>,
) -> impl Iterator<Item = (usize, usize, Shared<D>)> {
    let around = bin.around.iter().take(offset_count(D)).enumerate();
    around
        .filter(|(_, block)| **block != NO_BLOCK)
        .filter_map(|(index, &block)| Some((index, block as usize, window.shared(index)?)))
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
    /// First moments `V_j`, in the order of
    /// [`ArenaConstraints`](crate::grid::plan::arena_tables::ArenaConstraints).
    pub moments: Vec<Row>,
}

impl<const D: usize> Default for VelocityArena<D> {
    fn default() -> Self {
        Self { rows: vec![ZERO; arena_nodes(D)], moments: vec![ZERO; D * arena_nodes(D)] }
    }
}
