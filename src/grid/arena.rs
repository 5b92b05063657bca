//! Arenas: what the particles of each bin scattered, before nodes sum it up.
use super::plan::GridPlan;
use super::window::Window;
use crate::kernel::{Row, arena_nodes};

/// First moments of one node: row `k` is column `k` of the matrix `A_j = Σ w m C` on the way from particles
/// to nodes, or of `V_j` on the way back. Lane 3 is zero.
pub type Moments<const D: usize> = [Row; D];

/// No arena.
const NONE: u32 = u32::MAX;

/// Arenas of the bins that are occupied in a step; empty bins hold no memory.
#[derive(Clone, Debug, Default)]
pub struct Arenas<const D: usize> {
    rows: Vec<Row>,
    moments: Vec<Moments<D>>,
    /// Per bin, number of its arena.
    slot: Vec<u32>,
    /// Per bin, number of its moments.
    moment_slot: Vec<u32>,
    /// Per bin, the nodes that its particles touch.
    windows: Vec<Window<D>>,
}

/// The arena of one bin.
#[derive(Clone, Copy, Debug)]
pub struct Arena<'a, const D: usize> {
    /// Momentum and mass; values outside the window are left over from earlier steps.
    pub rows: &'a [Row],
    /// First moments, for bins that touch constrained nodes.
    pub moments: Option<&'a [Moments<D>]>,
    /// The nodes that hold values.
    pub window: Window<D>,
}

/// The arena of one bin, to scatter into.
pub struct ArenaMut<'a, const D: usize> {
    /// Number of the bin.
    pub bin: usize,
    /// Momentum and mass.
    pub rows: &'a mut [Row],
    /// First moments, for bins that touch constrained nodes.
    pub moments: Option<&'a mut [Moments<D>]>,
}

impl<const D: usize> Arena<'_, D> {
    /// First moments of a node inside the window; `None` for bins without.
    pub fn moments_at(&self, node: usize) -> Option<Moments<D>> {
        self.moments.map(|moments| moments[node])
    }
}

impl<const D: usize> ArenaMut<'_, D> {
    /// Sets the nodes of a window to zero.
    pub fn clear(&mut self, window: &Window<D>) {
        window.for_each_run(|run| {
            self.rows[run.clone()].fill(Row([0.0; 4]));
            if let Some(moments) = &mut self.moments {
                moments[run].fill([Row([0.0; 4]); D]);
            }
        });
    }
}

impl<const D: usize> Arenas<D> {
    /// Makes room for the bins that `window` gives nodes. Contents are left over from earlier steps.
    pub fn occupy(&mut self, plan: &GridPlan<D>, window: impl Fn(usize) -> Option<Window<D>>) {
        let (mut slots, mut moment_slots) = (0, 0);
        self.slot.resize(plan.bins.len(), NONE);
        self.moment_slot.resize(plan.bins.len(), NONE);
        self.windows.resize(plan.bins.len(), Window::EMPTY);
        for (bin, touched) in plan.bins.iter().map(|bin| bin.touched.is_some()).enumerate() {
            let window = window(bin);
            let occupied = window.is_some();
            self.windows[bin] = window.unwrap_or(Window::EMPTY);
            self.slot[bin] = if occupied { slots } else { NONE };
            self.moment_slot[bin] = if occupied && touched { moment_slots } else { NONE };
            slots += u32::from(occupied);
            moment_slots += u32::from(occupied && touched);
        }
        let nodes = arena_nodes(D);
        grow(&mut self.rows, slots as usize * nodes, Row([0.0; 4]));
        grow(&mut self.moments, moment_slots as usize * nodes, [Row([0.0; 4]); D]);
    }

    /// The arenas of all occupied bins, mutable and disjoint, in bin order.
    pub fn each_mut(&mut self) -> Vec<ArenaMut<'_, D>> {
        let mut rows = self.rows.chunks_mut(arena_nodes(D));
        let mut moments = self.moments.chunks_mut(arena_nodes(D));
        let mut arenas = Vec::with_capacity(self.slot.len());
        for (bin, (slot, moment_slot)) in self.slot.iter().zip(&self.moment_slot).enumerate() {
            if *slot != NONE
                && let Some(rows) = rows.next()
            {
                let moments = if *moment_slot == NONE { None } else { moments.next() };
                arenas.push(ArenaMut { bin, rows, moments });
            }
        }
        arenas
    }

    /// The nodes that the particles of a bin touch.
    pub fn window(&self, bin: usize) -> Window<D> {
        self.windows[bin]
    }

    /// Whether a bin is occupied.
    pub fn is_occupied(&self, bin: usize) -> bool {
        self.slot[bin] != NONE
    }

    /// The arena of a bin, if it is occupied.
    pub fn get(&self, bin: u32) -> Option<Arena<'_, D>> {
        let (slot, moment_slot) = (self.slot[bin as usize], self.moment_slot[bin as usize]);
        let nodes = arena_nodes(D);
        (slot != NONE).then(|| Arena {
            rows: &self.rows[slot as usize * nodes..][..nodes],
            moments: (moment_slot != NONE).then(|| &self.moments[moment_slot as usize * nodes..][..nodes]),
            window: self.windows[bin as usize],
        })
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.rows.capacity() * size_of::<Row>() + self.moments.capacity() * size_of::<Moments<D>>()
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
