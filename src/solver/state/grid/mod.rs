//! The grid of one tree and one partition: plan, velocity fields and exchanges.
//!
//! | file | what it holds |
//! |---|---|
//! | this | plan, velocity fields and exchanges |
//! | `velocity_field` | arenas, node fields and lists of the particles of a group of bodies |
//! | `inside` | nodes inside colliders, and the surfaces that they are behind |
//! | `walls` | nodes near surfaces that hold material back |
//! | `node_fill` | how full nodes are |
pub(in crate::solver) mod inside;
pub(in crate::solver) mod node_fill;
pub(in crate::solver) mod velocity_field;
pub(in crate::solver) mod walls;

use partition::Forest;
use partition::comm::{Comm, Traffic};

use crate::grid::arenas::Arenas;
use crate::grid::plan::ghost_layer::Allowance;
use crate::grid::ties::{HALO, Ties};
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::Row;
use crate::particle::Chunk;
use crate::solver::migration::crossings::FaceRules;
use crate::solver::migration::migrate::Migration;
use crate::solver::physics::Physics;
use crate::solver::state::grid::inside::InsideStill;
use crate::solver::state::grid::node_fill::NodeFill;
use crate::solver::state::grid::velocity_field::{NodeExchange, VelocityField};
use crate::solver::state::grid::walls::Walls;

/// Plan, velocity fields and exchanges.
pub struct Grid<const D: usize> {
    /// Blocks, bins and constraints.
    pub plan: GridPlan<D>,
    /// Velocity fields by number: one of all particles, or one for each group of bodies with the same
    /// contacts.
    pub(in crate::solver) fields: Vec<VelocityField<D>>,
    pub(in crate::solver) exchange: NodeExchange<D>,
    pub(in crate::solver) migration: Migration<D>,
    /// Sums of what is in contact: impulses of particles and of feet, gradients between bodies. It has memory
    /// from its first use on.
    pub(in crate::solver) contact: VelocityField<D>,
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
        let exchange = NodeExchange::new(comm, &plan);
        let ties = has_ties.then(|| Box::new(Ties::new(comm, &plan)));
        let neighbours = exchange.arenas.neighbours().to_vec();
        let fields = 0..physics.body_contacts.fields();
        Self {
            fields: fields.map(|_| VelocityField::new(&plan)).collect(),
            migration: Migration::new(
                comm,
                &plan,
                neighbours,
                FaceRules::new(physics),
                physics.carried_columns(),
            ),
            contact: VelocityField::default(),
            solids: Vec::new(),
            hats: Vec::new(),
            walls: Walls::default(),
            fill: None,
            ties,
            inside_still: Vec::new(),
            inside_moving: Vec::new(),
            sum_bytes: 0,
            exchange,
            plan,
        }
    }

    /// Frees the memory that the next step fills anew.
    pub(in crate::solver) fn clear(&mut self) {
        self.fields.clear();
        self.contact = VelocityField::default();
        self.solids = Vec::new();
        self.hats = Vec::new();
        self.walls = Walls::default();
        self.fill = None;
        self.ties = None;
        self.inside_still = Vec::new();
        self.inside_moving = Vec::new();
    }

    /// The node fields of all velocity fields.
    pub(in crate::solver) fn all_fields(&self) -> impl Iterator<Item = &NodeFields<D>> {
        self.fields.iter().map(|field| &field.nodes)
    }

    /// All material on one velocity field, where there are several: masses add up, velocities are those of
    /// its momentum.
    pub(in crate::solver) fn fields_together(&self) -> Option<NodeFields<D>> {
        let (first, others) = self.fields.split_first().filter(|(_, others)| !others.is_empty())?;
        let mut together = first.nodes.clone();
        others.iter().for_each(|other| together.add_material(&other.nodes));
        Some(together)
    }

    /// Arenas of the last scatter of the first velocity field.
    pub fn arenas(&self) -> &Arenas<D> {
        &self.fields[0].arenas
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        let fields = self.fields.iter().chain([&self.contact]);
        self.plan.heap_bytes()
            + fields.map(VelocityField::heap_bytes).sum::<usize>()
            + self.solids.iter().map(Solids::heap_bytes).sum::<usize>()
            + self.fill.as_ref().map_or(0, |fill| fill.heap_bytes())
            + self.ties.as_deref().map_or(0, Ties::heap_bytes)
    }

    /// Messages and bytes that this rank has sent since the grid was built.
    pub fn traffic(&self) -> Traffic {
        let (arenas, particles) = (self.exchange.arenas.traffic(), self.migration.traffic());
        let ties = self.ties.as_deref().map(Ties::traffic).unwrap_or_default();
        Traffic {
            messages: arenas.messages + particles.messages + ties.messages,
            bytes: arenas.bytes + particles.bytes + ties.bytes,
        }
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
        &self.elastic.as_ref().unwrap_or(&self.field).nodes.rows
    }

    fn heap_bytes(&self) -> usize {
        let sums = std::iter::once(&self.field).chain(&self.elastic);
        sums.map(VelocityField::heap_bytes).sum::<usize>()
            + self.copies.iter().map(Chunk::heap_bytes).sum::<usize>()
    }
}
