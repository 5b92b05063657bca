//! Velocity fields: what the particles of a group of bodies scatter into and gather from.
//!
//! A field is acted on as it is: phases of a step take it, or its number in the grid, with the parts of the
//! grid that all fields share beside it: the plan and the exchange between ranks.
use partition::comm::{Comm, Pending};
use rayon::prelude::*;

use crate::grid::arenas::{ArenaMut, Arenas, arena_schedule};
use crate::grid::sums::received::ReceivedSums;
use crate::grid::{ArenaExchange, GridPlan, NodeFields, Seam};
use crate::kernel::{Coordinates, Row, spread};
use crate::memory::Block;
use crate::particle::Chunk;
use crate::particle::group::Group;
use crate::solver::sorting::bin_view::BinView;
use crate::solver::sorting::bins::BinLists;
use crate::solver::sorting::box_widths::{BinMissing, BoxWidths};
use crate::solver::state::phases::{Phase, Phases};

/// A velocity field: arenas and node fields of its particles, and which of these are in which bin. The
/// default has no memory.
#[derive(Default)]
pub(in crate::solver) struct VelocityField<const D: usize> {
    pub(in crate::solver) arenas: Arenas<D>,
    pub(in crate::solver) nodes: NodeFields<D>,
    pub(in crate::solver) lists: BinLists<D>,
    pub(in crate::solver) increments: Increments,
}

/// Exchange of node sums between ranks, the same for all velocity fields.
pub(in crate::solver) struct NodeExchange<const D: usize> {
    pub(in crate::solver) arenas: ArenaExchange<D>,
    pub(in crate::solver) received: ReceivedSums<D>,
    pub(in crate::solver) seam: Seam,
}

impl<const D: usize> NodeExchange<D> {
    /// Collective. For a plan.
    pub(in crate::solver) fn new(comm: &Comm, plan: &GridPlan<D>) -> Self {
        let (arenas, received) = ArenaExchange::new(comm, plan);
        Self { seam: arenas.seam(plan), arenas, received }
    }
}

impl<const D: usize> VelocityField<D> {
    /// For a plan.
    pub(in crate::solver) fn new(plan: &GridPlan<D>) -> Self {
        Self { nodes: NodeFields::new(plan), lists: BinLists::new(plan), ..Self::default() }
    }

    /// Makes a field without memory one for a plan; others stay as they are.
    pub(in crate::solver) fn provide(&mut self, plan: &GridPlan<D>) {
        if self.nodes.active.is_empty() {
            *self = Self::new(plan);
        }
    }

    /// Not collective. Lists the members of each bin, by the widths of boxes in these coordinates, and makes
    /// room for the arenas of those that have any. With `group`: those of its particles alone.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan; the caller makes it collective.
    pub(in crate::solver) fn sort(
        &mut self,
        (plan, seam): (&GridPlan<D>, &Seam),
        phases: &mut Phases,
        chunks: &[Chunk<D>],
        (widths, coordinates): (&impl BoxWidths<D>, Coordinates),
        group: Option<&Group<'_>>,
    ) -> Result<(), BinMissing> {
        let Self { lists, arenas, .. } = self;
        phases.time(Phase::Sort, || {
            let sorted = lists.sort(plan, chunks, widths, group);
            lists.spread_parts(plan, chunks, |bin, chunk, parts, each| {
                let (frame, constrained) = (plan.frame(bin), plan.constrained(bin));
                spread::of_parts(chunk, parts, &frame, coordinates, constrained, each);
            });
            arenas.occupy(plan, seam, lists.occupied(plan, chunks));
            sorted
        })
    }

    /// Collective over neighbours. Calls `scatter` with each bin that has members and its arena, on any
    /// thread, and leaves the sums of the arenas of all ranks on real nodes. No bit depends on the order in
    /// which bins scatter.
    pub(in crate::solver) fn scatter_and_sum<S: Default>(
        &mut self,
        (plan, exchange): (&GridPlan<D>, &mut NodeExchange<D>),
        phases: &mut Phases,
        chunks: &[Chunk<D>],
        scatter: impl Fn(&mut S, &BinView<'_, D>, ArenaMut<'_, D>) + Sync + Send,
    ) {
        // Neighbours wait for the sums of the first wave, which travel while the others scatter.
        self.scatter_wave(plan, phases, chunks, arena_schedule::FIRST, &scatter);
        let pending = self.send_sums(plan, &mut exchange.arenas, phases);
        for wave in arena_schedule::FIRST + 1..self.arenas.schedule().count() {
            self.scatter_wave(plan, phases, chunks, wave, &scatter);
        }
        let (Self { arenas, nodes, .. }, NodeExchange { arenas: sums, received, .. }) = (self, exchange);
        phases.time(Phase::Exchange, || sums.finish(pending, received));
        phases.time(Phase::Sum, || nodes.add_received(plan, arenas, received));
        phases.time(Phase::Nodes, || nodes.restrict(plan));
    }

    /// Not collective. Scatters the bins of a wave, and adds up the blocks that are complete with it.
    fn scatter_wave<S: Default>(
        &mut self,
        plan: &GridPlan<D>,
        phases: &mut Phases,
        chunks: &[Chunk<D>],
        wave: usize,
        scatter: &(impl Fn(&mut S, &BinView<'_, D>, ArenaMut<'_, D>) + Sync + Send),
    ) {
        let Self { lists, arenas, nodes, .. } = self;
        let bins = arenas.of_wave(wave);
        phases.time(Phase::Scatter, || {
            bins.into_par_iter().for_each_init(S::default, |scratch, arena| {
                let leaf = plan.bins[arena.bin].leaf as usize;
                let bin = BinView::new(plan, lists.of_leaf(leaf), arena.bin, chunks[leaf].len());
                scatter(scratch, &bin, arena);
            });
        });
        phases.time(Phase::Sum, || nodes.sum(plan, arenas, wave));
    }

    /// Collective over neighbours. Starts sending the sums that neighbours need.
    fn send_sums(&self, plan: &GridPlan<D>, exchange: &mut ArenaExchange<D>, phases: &mut Phases) -> Pending {
        let messages = phases.time(Phase::Sum, || exchange.pack(plan, &self.arenas, &self.nodes));
        phases.time(Phase::Exchange, || exchange.begin(messages))
    }

    /// Not collective. Interpolates the rows of constrained nodes from those of real nodes.
    pub(in crate::solver) fn prolong(&mut self, plan: &GridPlan<D>, phases: &mut Phases) {
        phases.time(Phase::Nodes, || self.nodes.prolong(plan, &self.arenas));
    }

    /// Heap bytes held.
    pub(in crate::solver) fn heap_bytes(&self) -> usize {
        self.arenas.heap_bytes() + self.nodes.heap_bytes() + self.increments.heap_bytes()
    }
}

/// Rows of all nodes that a step keeps beside the node fields, for transfers by increments and for loads;
/// empty without these.
#[derive(Clone, Debug, Default)]
pub(in crate::solver) struct Increments {
    /// Base of the increments, which is subtracted from the new velocity: v_0 (FLIP), or `-Σ v_k` over k from
    /// 1 (XPIC).
    pub(in crate::solver) base: Block<Row>,
    /// Changes of velocity (FLIP), or new velocities of particles (XPIC).
    pub rows: Block<Row>,
    /// Velocities at the start of the step, where a load or a face needs them.
    pub(in crate::solver) start: Block<Row>,
}

impl Increments {
    /// Heap bytes held.
    fn heap_bytes(&self) -> usize {
        size_of_val(&*self.base) + size_of_val(&*self.rows) + size_of_val(&*self.start)
    }
}
