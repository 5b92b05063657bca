//! Arenas: momentum and mass that the particles of each bin scatter, before nodes sum them up.
//!
//! | file | what it holds |
//! |---|---|
//! | [`window`] | which nodes of an arena particles can touch |
//! | [`arena_schedule`] | when which arena is in use, so that few exist at a time |
//! | `disjoint_slices` | disjoint mutable parts of one slice |
use std::sync::Arc;

use self::arena_schedule::{ArenaSchedule, Seam};
use self::disjoint_slices::DisjointSlices;
use self::window::Window;
use super::plan::GridPlan;
use super::plan::arena_tables::{ArenaConstraints, ArenaMoments};
use crate::kernel::{Row, arena_nodes};
use crate::simd::prefetch;

pub mod arena_schedule;
pub(super) mod disjoint_slices;
pub mod window;

/// Cache lines of an arena that are prefetched: all in 2D; in 3D the prefetcher of the processor loads the
/// rest.
const PREFETCHED: usize = 25;
/// No arena.
const NONE: u32 = u32::MAX;

/// Arenas of the bins that are occupied in a step; empty bins hold no memory. Bins of one wave (see
/// [`ArenaSchedule`]) leave theirs to those of later ones.
#[derive(Clone, Debug, Default)]
pub struct Arenas<const D: usize> {
    rows: Vec<Row>,
    /// First moments, bin by bin.
    moments: Vec<Row>,
    /// Per bin, its number among the occupied ones.
    number: Vec<u32>,
    /// Per bin, its arena.
    slot: Vec<u32>,
    /// Occupied bins, ascending.
    occupied: Vec<Occupied<D>>,
    schedule: ArenaSchedule,
    keep: bool,
    constraints: Arc<Vec<ArenaConstraints<D>>>,
    /// Per block, whether a bin reaches it whose block lies outside its leaf; in most steps few do: boxes
    /// must be wide, or lie across a change of level.
    outer_reach: Vec<bool>,
}

/// An occupied bin.
#[derive(Clone, Copy, Debug)]
struct Occupied<const D: usize> {
    bin: u32,
    /// Its constrained nodes among the plan's.
    touched: Option<u32>,
    /// Its first moments.
    moments: [u32; 2],
    /// The nodes that its particles touch.
    window: Window<D>,
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
    /// Address of the arena that comes next.
    next: usize,
}

impl<const D: usize> ArenaMut<'_, D> {
    /// Sets the nodes of a window and all moments to zero. Prefetches the arena that is cleared next.
    pub fn clear(&mut self, window: &Window<D>) {
        window.for_each_run(|run| self.rows[run].fill(Row([0.0; 4])));
        self.moments.fill(Row([0.0; 4]));
        (0..PREFETCHED).for_each(|line| prefetch(self.next + 64 * line));
    }
}

impl<const D: usize> Arenas<D> {
    /// Has every bin keep its arena until the next step, for measurements after the step.
    pub fn keep(&mut self) {
        self.keep = true;
    }

    /// Makes room for the occupied bins, which come in order with the nodes that their particles touch.
    /// Contents are left over from earlier steps.
    pub fn occupy(
        &mut self,
        plan: &GridPlan<D>,
        seam: &Seam,
        occupied: impl Iterator<Item = (usize, Window<D>)>,
    ) {
        self.constraints = Arc::clone(&plan.constraints);
        if self.number.len() == plan.bins.len() {
            // Most bins were not occupied and need no further test.
            for arena in &self.occupied {
                self.number[arena.bin as usize] = NONE;
                self.slot[arena.bin as usize] = NONE;
            }
        } else {
            for values in [&mut self.number, &mut self.slot] {
                values.clear();
                values.resize(plan.bins.len(), NONE);
            }
        }
        self.occupied.clear();
        self.outer_reach.clear();
        self.outer_reach.resize(plan.blocks.len(), false);
        let mut moments = 0;
        for (number, window) in occupied {
            let bin = &plan.bins[number];
            if !bin.is_inner {
                bin.reached().for_each(|block| self.outer_reach[block] = true);
            }
            self.number[number] = self.occupied.len() as u32;
            let count =
                bin.touched.map_or(0, |table| plan.constraints[table as usize].nodes.moments()) as u32;
            let (bin, touched) = (number as u32, bin.touched);
            let moments_of_bin = [moments, moments + count];
            self.occupied.push(Occupied { bin, touched, moments: moments_of_bin, window });
            moments += count;
        }
        let size = (!self.keep).then(ArenaSchedule::usual_size::<D>);
        let reached = |bin: u32| plan.bins[bin as usize].reached();
        self.schedule.plan(size, seam, reached, self.occupied.iter().map(|arena| arena.bin));
        for (number, arena) in self.occupied.iter().enumerate() {
            self.slot[arena.bin as usize] = self.schedule.slot(number);
        }
        grow(&mut self.rows, self.schedule.arenas() * arena_nodes(D), Row([0.0; 4]));
        grow(&mut self.moments, moments as usize, Row([0.0; 4]));
    }

    /// In which order bins scatter and blocks are summed up.
    pub fn schedule(&self) -> &ArenaSchedule {
        &self.schedule
    }

    /// The arenas of the bins of a wave, mutable and disjoint, in bin order.
    pub fn of_wave(&mut self, wave: usize) -> Vec<ArenaMut<'_, D>> {
        let nodes = arena_nodes(D);
        let (mut rows, mut moments) =
            (DisjointSlices::new(&mut self.rows, 0), DisjointSlices::new(&mut self.moments, 0));
        let own = self.schedule.bins(wave).iter().map(|&number| &self.occupied[number as usize]);
        let mut arenas: Vec<ArenaMut<'_, D>> = own
            .map(|arena| {
                let slot = self.slot[arena.bin as usize] as usize;
                let rows = rows.cut(slot * nodes..(slot + 1) * nodes);
                let [first, end] = arena.moments.map(|moment| moment as usize);
                ArenaMut { bin: arena.bin as usize, rows, moments: moments.cut(first..end), next: 0 }
            })
            .collect();
        for first in 1..arenas.len() {
            arenas[first - 1].next = arenas[first].rows.as_ptr().addr();
        }
        arenas
    }

    /// The nodes that the particles of an occupied bin touch.
    pub fn window(&self, bin: usize) -> Window<D> {
        self.occupied[self.number[bin] as usize].window
    }

    /// The occupied bin that comes after an occupied one, with its window.
    pub fn after(&self, bin: usize) -> Option<(usize, Window<D>)> {
        let next = self.occupied.get(self.number[bin] as usize + 1)?;
        Some((next.bin as usize, next.window))
    }

    /// The occupied bins, in order.
    pub fn bins(&self) -> impl Iterator<Item = usize> {
        self.occupied.iter().map(|arena| arena.bin as usize)
    }

    /// Whether an occupied bin reaches a block.
    pub fn reach(&self, block: usize) -> bool {
        self.schedule.reach(block)
    }

    /// Whether one does whose block lies outside its leaf.
    pub fn outer_reach(&self, block: usize) -> bool {
        self.outer_reach[block]
    }

    /// Whether a bin is occupied.
    pub fn is_occupied(&self, bin: usize) -> bool {
        self.number[bin] != NONE
    }

    /// Momentum and mass in the arena of a bin, if it is occupied.
    #[inline(always)]
    pub fn rows(&self, bin: u32) -> Option<&[Row]> {
        let slot = self.slot[bin as usize];
        (slot != NONE).then(|| &self.rows[slot as usize * arena_nodes(D)..][..arena_nodes(D)])
    }

    /// The arena of a bin, if it is occupied.
    pub fn get(&self, bin: u32) -> Option<Arena<'_, D>> {
        let (arena, rows) = (self.occupied.get(self.number[bin as usize] as usize)?, self.rows(bin)?);
        let [first, end] = arena.moments.map(|moment| moment as usize);
        let moments = arena.touched.map(|table| ArenaMoments {
            values: &self.moments[first..end],
            constraints: &self.constraints[table as usize],
        });
        Some(Arena { rows, moments, window: arena.window })
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.rows.capacity() * size_of::<Row>() + self.moments.capacity() * size_of::<Row>()
    }
}

/// Grows with little room to spare, since arenas are a large part of the memory beside the particles; but
/// with some, since a moving body occupies a few more bins in nearly every step.
fn grow<T: Clone>(values: &mut Vec<T>, len: usize, value: T) {
    if len > values.len() {
        if len > values.capacity() {
            values.reserve_exact(len + len / 32 - values.len());
        }
        values.resize(len, value);
    }
}
