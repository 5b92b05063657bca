//! Arenas: what the particles of each bin scattered, before nodes sum it up.
use std::sync::Arc;

use super::constrained::{ArenaConstraints, ArenaMoments};
use super::plan::{GridPlan, NO_BLOCK};
use super::window::Window;
use crate::kernel::{Row, arena_nodes};

/// No arena.
const NONE: u32 = u32::MAX;

/// Arenas of the bins that are occupied in a step; empty bins hold no memory.
#[derive(Clone, Debug, Default)]
pub struct Arenas<const D: usize> {
    rows: Vec<Row>,
    /// First moments, bin by bin, by number of the column.
    moments: Vec<Row>,
    /// Per bin, number of its arena.
    slot: Vec<u32>,
    /// What is known of each arena.
    occupied: Vec<Occupied<D>>,
    constraints: Arc<Vec<ArenaConstraints<D>>>,
    /// Per block, what reaches it.
    reached: Vec<Reached>,
}

/// An occupied bin.
#[derive(Clone, Copy, Debug)]
struct Occupied<const D: usize> {
    bin: u32,
    /// Its columns of first moments among the plan's constraints.
    touched: Option<u32>,
    /// Its first moments.
    moments: [u32; 2],
    /// The nodes that its particles touch.
    window: Window<D>,
}

/// Which occupied bins reach a block.
#[derive(Clone, Copy, Debug, Default)]
struct Reached {
    /// Some bin whose block lies in its leaf.
    inner: bool,
    /// Some other bin; in most steps there are few: boxes must be wide, or lie across a change of level.
    outer: bool,
}

/// The arena of one bin.
#[derive(Clone, Copy, Debug)]
pub struct Arena<'a, const D: usize> {
    /// Momentum and mass; values outside the window are left over from earlier steps.
    pub rows: &'a [Row],
    /// First moments, for bins that touch nodes with such.
    pub moments: Option<ArenaMoments<'a, D>>,
    /// The nodes that hold values.
    pub window: Window<D>,
}

/// The arena of one bin, to scatter into.
pub struct ArenaMut<'a, const D: usize> {
    /// Number of the bin.
    pub bin: usize,
    /// Momentum and mass.
    pub rows: &'a mut [Row],
    /// First moments, in the order of [`ArenaConstraints`].
    pub moments: &'a mut [Row],
}

impl<const D: usize> ArenaMut<'_, D> {
    /// Sets the nodes of a window and all moments to zero.
    pub fn clear(&mut self, window: &Window<D>) {
        window.for_each_run(|run| self.rows[run].fill(Row([0.0; 4])));
        self.moments.fill(Row([0.0; 4]));
    }
}

impl<const D: usize> Arenas<D> {
    /// Makes room for the occupied bins, which come in order with the nodes that their particles touch. Contents are left
    /// over from earlier steps.
    pub fn occupy(&mut self, plan: &GridPlan<D>, occupied: impl Iterator<Item = (usize, Window<D>)>) {
        self.constraints = Arc::clone(&plan.constraints);
        if self.slot.len() == plan.bins.len() {
            // Most bins were not occupied and need no second look.
            self.occupied.iter().for_each(|arena| self.slot[arena.bin as usize] = NONE);
        } else {
            self.slot.clear();
            self.slot.resize(plan.bins.len(), NONE);
        }
        self.occupied.clear();
        self.reached.clear();
        self.reached.resize(plan.blocks.len(), Reached::default());
        let mut moments = 0;
        for (number, window) in occupied {
            let bin = &plan.bins[number];
            for &block in bin.around.iter().filter(|&&block| block != NO_BLOCK) {
                let reached = &mut self.reached[block as usize];
                reached.inner |= bin.is_inner;
                reached.outer |= !bin.is_inner;
            }
            self.slot[number] = self.occupied.len() as u32;
            let count = bin.touched.map_or(0, |table| plan.constraints[table as usize].nodes.len()) as u32;
            let (bin, touched) = (number as u32, bin.touched);
            self.occupied.push(Occupied { bin, touched, moments: [moments, moments + count], window });
            moments += count;
        }
        grow(&mut self.rows, self.occupied.len() * arena_nodes(D), Row([0.0; 4]));
        grow(&mut self.moments, moments as usize, Row([0.0; 4]));
    }

    /// The arenas of all occupied bins, mutable and disjoint, in bin order.
    pub fn each_mut(&mut self) -> Vec<ArenaMut<'_, D>> {
        let mut rest = &mut self.moments[..];
        let each = self.occupied.iter().zip(self.rows.chunks_mut(arena_nodes(D)));
        each.map(|(arena, rows)| {
            let [first, end] = arena.moments;
            let (moments, others) = std::mem::take(&mut rest).split_at_mut((end - first) as usize);
            rest = others;
            ArenaMut { bin: arena.bin as usize, rows, moments }
        })
        .collect()
    }

    /// The nodes that the particles of an occupied bin touch.
    pub fn window(&self, bin: usize) -> Window<D> {
        self.occupied[self.slot[bin] as usize].window
    }

    /// Whether an occupied bin reaches a block.
    pub fn reach(&self, block: usize) -> bool {
        self.reached[block].inner || self.reached[block].outer
    }

    /// Whether one does whose block lies outside its leaf.
    pub fn outer_reach(&self, block: usize) -> bool {
        self.reached[block].outer
    }

    /// Whether a bin is occupied.
    pub fn is_occupied(&self, bin: usize) -> bool {
        self.slot[bin] != NONE
    }

    /// Momentum and mass in the arena of a bin, if it is occupied.
    #[inline(always)]
    pub fn rows(&self, bin: u32) -> Option<&[Row]> {
        let slot = self.slot[bin as usize];
        (slot != NONE).then(|| &self.rows[slot as usize * arena_nodes(D)..][..arena_nodes(D)])
    }

    /// The arena of a bin, if it is occupied.
    pub fn get(&self, bin: u32) -> Option<Arena<'_, D>> {
        let slot = self.slot[bin as usize];
        let arena = self.occupied.get(slot as usize)?;
        let [first, end] = arena.moments.map(|moment| moment as usize);
        let moments = arena.touched.map(|table| ArenaMoments {
            values: &self.moments[first..end],
            constraints: &self.constraints[table as usize],
        });
        let rows = &self.rows[slot as usize * arena_nodes(D)..][..arena_nodes(D)];
        Some(Arena { rows, moments, window: arena.window })
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.rows.capacity() * size_of::<Row>() + self.moments.capacity() * size_of::<Row>()
    }
}

/// Grows with little room to spare, since arenas are a large part of the memory beside the particles; but with some,
/// since a moving body occupies a few more bins in nearly every step.
fn grow<T: Clone>(values: &mut Vec<T>, len: usize, value: T) {
    if len > values.len() {
        if len > values.capacity() {
            values.reserve_exact(len + len / 32 - values.len());
        }
        values.resize(len, value);
    }
}
