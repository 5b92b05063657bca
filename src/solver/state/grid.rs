//! What lives on the grid for one tree and one partition.
use partition::Forest;
use partition::comm::{Comm, Traffic};

use crate::grid::arenas::Arenas;
use crate::grid::plan::known::Allowance;
use crate::grid::sums::exchange::ReceivedSums;
use crate::grid::{ArenaExchange, GridPlan, NodeFields, Seam};
use crate::kernel::Row;
use crate::memory::Block;
use crate::solver::migration::migrate::Migration;
use crate::solver::physics::Physics;
use crate::solver::sorting::bins::BinLists;

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
    pub(in crate::solver) seam: Seam,
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
        let allowance = Allowance { reach, graded: physics.graded };
        let plan = GridPlan::build(comm, forest, physics.root_edge, allowance);
        let (exchange, received) = ArenaExchange::new(comm, &plan);
        let neighbours = exchange.neighbours().to_vec();
        Self {
            arenas: Arenas::default(),
            fields: NodeFields::new(&plan),
            increments: Increments::default(),
            migration: Migration::new(comm, &plan, neighbours, physics.leaving),
            lists: BinLists::new(&plan),
            seam: exchange.seam(&plan),
            exchange,
            received,
            plan,
        }
    }

    /// Gives back the memory of what the next step fills anew.
    pub(in crate::solver) fn clear(&mut self) {
        self.arenas = Arenas::default();
        self.increments = Increments::default();
        self.fields.rows = Block::default();
        self.fields.moments = Block::default();
    }

    /// What the particles scattered last.
    pub fn arenas(&self) -> &Arenas<D> {
        &self.arenas
    }

    /// In how many waves bins scatter.
    pub(in crate::solver) fn waves(&self) -> usize {
        self.arenas.waves().count()
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.plan.heap_bytes()
            + self.arenas.heap_bytes()
            + self.fields.heap_bytes()
            + self.increments.heap_bytes()
    }

    /// Messages and bytes that this rank has sent since the grid was built.
    pub fn traffic(&self) -> Traffic {
        let (arenas, particles) = (self.exchange.traffic(), self.migration.traffic());
        Traffic { messages: arenas.messages + particles.messages, bytes: arenas.bytes + particles.bytes }
    }
}

/// Rows of all nodes that a step with increments keeps beside the node fields; empty for other transfers.
#[derive(Clone, Debug, Default)]
pub(in crate::solver) struct Increments {
    /// What is taken off the new velocity to get what particles take: v_0 (FLIP), or `-Σ v_k` over k from 1 (XPIC).
    pub(in crate::solver) base: Block<Row>,
    /// Changes of velocity (FLIP), or new velocities of particles (XPIC).
    pub rows: Block<Row>,
}

impl Increments {
    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        size_of_val(&*self.base) + size_of_val(&*self.rows)
    }
}
