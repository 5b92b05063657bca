//! The grid of one tree and one partition: plan, arenas, node fields and exchanges.
use partition::Forest;
use partition::comm::{Comm, Pending, Traffic};
use rayon::prelude::*;

use crate::grid::arenas::{ArenaMut, Arenas, arena_schedule};
use crate::grid::plan::ghost_layer::Allowance;
use crate::grid::sums::received::ReceivedSums;
use crate::grid::ties::{HALO, Ties};
use crate::grid::{ArenaExchange, GridPlan, NodeFields, Seam};
use crate::kernel::{Coordinates, Row, spread};
use crate::memory::Block;
use crate::particle::Chunk;
use crate::particle::group::Group;
use crate::solver::migration::crossings::FaceRules;
use crate::solver::migration::migrate::Migration;
use crate::solver::physics::Physics;
use crate::solver::sorting::bin_view::BinView;
use crate::solver::sorting::bins::BinLists;
use crate::solver::sorting::box_widths::{BinMissing, BoxWidths};
use crate::solver::state::inside::InsideStill;
use crate::solver::state::node_fill::NodeFill;
use crate::solver::state::phases::{Phase, Phases};
use crate::solver::state::walls::Walls;

/// Plan, arenas, fields and exchanges.
pub struct Grid<const D: usize> {
    /// Blocks, bins and constraints.
    pub plan: GridPlan<D>,
    pub(in crate::solver) arenas: Arenas<D>,
    pub(in crate::solver) fields: NodeFields<D>,
    pub(in crate::solver) increments: Increments,
    pub(in crate::solver) exchange: ArenaExchange<D>,
    pub(in crate::solver) received: ReceivedSums<D>,
    pub(in crate::solver) migration: Migration<D>,
    pub(in crate::solver) lists: BinLists<D>,
    /// Velocity fields of the bodies that move with another than the first; none where all move with one.
    pub(in crate::solver) others: Vec<VelocityField<D>>,
    pub(in crate::solver) seam: Seam,
    /// For contact at particles; made when it is first needed.
    pub(in crate::solver) contact: Option<Box<VelocityField<D>>>,
    /// Of each velocity field, for surfaces; made when they are first needed.
    pub(in crate::solver) solids: Vec<Solids<D>>,
    /// Volumes of the basis functions of real nodes, m³ (in plane strain m²), by node; found when bodies
    /// first meet.
    pub(in crate::solver) hats: Vec<f64>,
    /// Nodes near surfaces that hold material back.
    pub(in crate::solver) walls: Walls,
    /// How full nodes are; made when it is first needed.
    pub(in crate::solver) fill: Option<Box<NodeFill>>,
    /// Ties of surface nodes, in jobs that have such.
    pub(in crate::solver) ties: Option<Box<Ties<D>>>,
    /// Nodes inside colliders that never move, found block by block at first use.
    pub(in crate::solver) inside_still: InsideStill<D>,
    /// Nodes inside colliders that move, in this step, by block and collider; empty without such colliders.
    pub(in crate::solver) inside_moving: InsideStill<D>,
    /// Bytes that this rank sent of the last sums of masses and momenta.
    pub(in crate::solver) sum_bytes: u64,
}

impl<const D: usize> Grid<D> {
    /// Collective. The grid for the current tree and partition.
    ///
    /// `reach` is the greatest half width of boxes in cells of their leaf where wider than a cell, as
    /// [`reach_of_width`] gives it.
    pub(in crate::solver) fn build(
        comm: &Comm,
        forest: &Forest<D>,
        physics: &Physics<D>,
        reach: u32,
    ) -> Self {
        let has_ties = physics.has_any_ties();
        let allowance = Allowance { reach, graded: physics.graded, halo: if has_ties { HALO } else { 0 } };
        let plan = GridPlan::build(comm, forest, physics.root_edge, allowance);
        let (exchange, received) = ArenaExchange::new(comm, &plan);
        let ties = has_ties.then(|| Box::new(Ties::new(comm, &plan)));
        let neighbours = exchange.neighbours().to_vec();
        let others = 1..physics.body_contacts.fields();
        Self {
            arenas: Arenas::default(),
            fields: NodeFields::new(&plan),
            increments: Increments::default(),
            migration: Migration::new(
                comm,
                &plan,
                neighbours,
                FaceRules::new(physics),
                physics.carried_columns(),
            ),
            lists: BinLists::new(&plan),
            others: others.map(|_| VelocityField::new(&plan)).collect(),
            seam: exchange.seam(&plan),
            contact: None,
            solids: Vec::new(),
            hats: Vec::new(),
            walls: Walls::default(),
            fill: None,
            ties,
            inside_still: Vec::new(),
            inside_moving: Vec::new(),
            sum_bytes: 0,
            exchange,
            received,
            plan,
        }
    }

    /// Frees the memory that the next step fills anew.
    pub(in crate::solver) fn clear(&mut self) {
        self.arenas = Arenas::default();
        self.increments = Increments::default();
        self.fields.rows = Block::default();
        self.fields.moments = Block::default();
        self.others.clear();
        self.contact = None;
        self.solids = Vec::new();
        self.hats = Vec::new();
        self.walls = Walls::default();
        self.fill = None;
        self.ties = None;
        self.inside_still = Vec::new();
        self.inside_moving = Vec::new();
    }

    /// Exchanges the velocity field that particles scatter into and gather from with another.
    pub(in crate::solver) fn swap(&mut self, other: &mut VelocityField<D>) {
        std::mem::swap(&mut self.arenas, &mut other.arenas);
        std::mem::swap(&mut self.fields, &mut other.fields);
        std::mem::swap(&mut self.lists, &mut other.lists);
        std::mem::swap(&mut self.increments, &mut other.increments);
    }

    /// The node fields of all velocity fields.
    pub(in crate::solver) fn all_fields(&self) -> impl Iterator<Item = &NodeFields<D>> {
        std::iter::once(&self.fields).chain(self.others.iter().map(|other| &other.fields))
    }

    /// All material on one velocity field, where there are several: masses add up, velocities are those of
    /// its momentum.
    pub(in crate::solver) fn fields_together(&self) -> Option<NodeFields<D>> {
        let (first, rest) = self.others.split_first()?;
        let mut together = self.fields.clone();
        together.add_material(&first.fields);
        rest.iter().for_each(|other| together.add_material(&other.fields));
        Some(together)
    }

    /// Arenas of the last scatter.
    pub fn arenas(&self) -> &Arenas<D> {
        &self.arenas
    }

    /// Not collective. Lists the members of each bin, by the widths of boxes in these coordinates, and makes
    /// room for the arenas of those that have any. With `group`: those of its particles alone.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan; the caller makes it collective.
    pub(in crate::solver) fn sort(
        &mut self,
        phases: &mut Phases,
        chunks: &[Chunk<D>],
        (widths, coordinates): (&impl BoxWidths<D>, Coordinates),
        group: Option<&Group<'_>>,
    ) -> Result<(), BinMissing> {
        let Self { plan, lists, arenas, seam, .. } = self;
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
        phases: &mut Phases,
        chunks: &[Chunk<D>],
        scatter: impl Fn(&mut S, &BinView<'_, D>, ArenaMut<'_, D>) + Sync + Send,
    ) {
        // Neighbours wait for the sums of the first wave, which travel while the others scatter.
        self.scatter_wave(phases, chunks, arena_schedule::FIRST, &scatter);
        let pending = self.send_sums(phases);
        for wave in arena_schedule::FIRST + 1..self.arenas.schedule().count() {
            self.scatter_wave(phases, chunks, wave, &scatter);
        }
        let Self { plan, arenas, fields, exchange, received, .. } = self;
        phases.time(Phase::Exchange, || exchange.finish(pending, received));
        phases.time(Phase::Sum, || fields.add_received(plan, arenas, received));
        phases.time(Phase::Nodes, || fields.restrict(plan));
    }

    /// Not collective. Scatters the bins of a wave, and adds up the blocks that are complete with it.
    fn scatter_wave<S: Default>(
        &mut self,
        phases: &mut Phases,
        chunks: &[Chunk<D>],
        wave: usize,
        scatter: &(impl Fn(&mut S, &BinView<'_, D>, ArenaMut<'_, D>) + Sync + Send),
    ) {
        let Self { plan, lists, arenas, fields, .. } = self;
        let bins = arenas.of_wave(wave);
        phases.time(Phase::Scatter, || {
            bins.into_par_iter().for_each_init(S::default, |scratch, arena| {
                let leaf = plan.bins[arena.bin].leaf as usize;
                let bin = BinView::new(plan, lists.of_leaf(leaf), arena.bin, chunks[leaf].len());
                scatter(scratch, &bin, arena);
            });
        });
        phases.time(Phase::Sum, || fields.sum(plan, arenas, wave));
    }

    /// Collective over neighbours. Starts sending the sums that neighbours need.
    fn send_sums(&mut self, phases: &mut Phases) -> Pending {
        let Self { plan, arenas, fields, exchange, .. } = self;
        let messages = phases.time(Phase::Sum, || exchange.pack(plan, arenas, fields));
        phases.time(Phase::Exchange, || exchange.begin(messages))
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        let contact = self.contact.as_deref().into_iter();
        self.plan.heap_bytes()
            + self.arenas.heap_bytes()
            + self.fields.heap_bytes()
            + self.increments.heap_bytes()
            + self.others.iter().chain(contact).map(VelocityField::heap_bytes).sum::<usize>()
            + self.solids.iter().map(Solids::heap_bytes).sum::<usize>()
            + self.fill.as_ref().map_or(0, |fill| fill.heap_bytes())
            + self.ties.as_deref().map_or(0, Ties::heap_bytes)
    }

    /// Messages and bytes that this rank has sent since the grid was built.
    pub fn traffic(&self) -> Traffic {
        let (arenas, particles) = (self.exchange.traffic(), self.migration.traffic());
        let ties = self.ties.as_deref().map(Ties::traffic).unwrap_or_default();
        Traffic {
            messages: arenas.messages + particles.messages + ties.messages,
            bytes: arenas.bytes + particles.bytes + ties.bytes,
        }
    }
}

/// A velocity field beside the first: arenas and node fields of its particles.
pub(in crate::solver) struct VelocityField<const D: usize> {
    pub(in crate::solver) arenas: Arenas<D>,
    pub(in crate::solver) fields: NodeFields<D>,
    pub(in crate::solver) lists: BinLists<D>,
    pub(in crate::solver) increments: Increments,
}

impl<const D: usize> VelocityField<D> {
    /// For a plan.
    pub(in crate::solver) fn new(plan: &GridPlan<D>) -> Self {
        Self {
            arenas: Arenas::default(),
            fields: NodeFields::new(plan),
            lists: BinLists::new(plan),
            increments: Increments::default(),
        }
    }

    fn heap_bytes(&self) -> usize {
        self.arenas.heap_bytes() + self.fields.heap_bytes() + self.increments.heap_bytes()
    }
}

/// The material of a velocity field near surfaces: where bodies meet, and at walls.
pub(in crate::solver) struct Solids<const D: usize> {
    /// By own leaf, copies of the particles there that have volumes for masses. They keep their memory from
    /// step to step.
    pub(in crate::solver) copies: Vec<Chunk<D>>,
    /// Of which particles these are copies.
    pub(in crate::solver) members: Vec<Vec<u32>>,
    /// Sums that the copies scatter: volumes and their gradients.
    pub(in crate::solver) field: VelocityField<D>,
    /// The same without the gradients of what has yielded, where walls and other bodies both ask.
    pub(in crate::solver) elastic: Option<VelocityField<D>>,
}

impl<const D: usize> Solids<D> {
    /// For a plan with so many own leaves.
    pub(in crate::solver) fn new(plan: &GridPlan<D>, leaves: usize) -> Self {
        Self {
            copies: vec![Chunk::new(); leaves],
            members: vec![Vec::new(); leaves],
            field: VelocityField::new(plan),
            elastic: None,
        }
    }

    /// The sums by node as walls ask for them.
    pub(in crate::solver) fn at_walls(&self) -> &[Row] {
        &self.elastic.as_ref().unwrap_or(&self.field).fields.rows
    }

    fn heap_bytes(&self) -> usize {
        let sums = std::iter::once(&self.field).chain(&self.elastic);
        sums.map(VelocityField::heap_bytes).sum::<usize>()
            + self.copies.iter().map(Chunk::heap_bytes).sum::<usize>()
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
    pub(crate) fn heap_bytes(&self) -> usize {
        size_of_val(&*self.base) + size_of_val(&*self.rows) + size_of_val(&*self.start)
    }
}
