//! Sums over the cells of the ground at real nodes, and values of nodes in the cells, on all ranks.
use partition::comm::Comm;
use rayon::prelude::*;

use super::ground::{Ground, GroundLeaf};
use crate::grid::arenas::Arenas;
use crate::grid::arenas::arena_schedule::FIRST;
use crate::grid::sums::node_fields::load_rows;
use crate::grid::{GridPlan, NodeFields, Window};
use crate::kernel::{Row, arena_nodes};
use crate::particle::Chunk;
use crate::solver::state::grid::velocity_field::NodeExchange;

/// Node fields for the ground: one for sums, one for values.
pub(super) struct Nodes<'a, const D: usize> {
    pub(super) comm: &'a Comm,
    pub(super) plan: &'a GridPlan<D>,
    sums: Sums<'a, D>,
    values: NodeFields<D>,
}

/// Sums over the cells of the ground, and the exchange that completes them.
struct Sums<'a, const D: usize> {
    exchange: &'a mut NodeExchange<D>,
    arenas: Arenas<D>,
    fields: NodeFields<D>,
}

/// The nodes of a leaf in its arena, and those that the arena shares with the same regions of blocks.
fn window<const D: usize>() -> Window<D> {
    Window { lower: [1; D], upper: [7; D] }
}

impl<'a, const D: usize> Nodes<'a, D> {
    /// For some ground.
    pub(super) fn new(
        comm: &'a Comm,
        plan: &'a GridPlan<D>,
        exchange: &'a mut NodeExchange<D>,
        ground: &Ground<D>,
    ) -> Self {
        let mut arenas = Arenas::default();
        arenas.occupy(plan, &exchange.seam, ground.leaves.iter().map(|leaf| (leaf.bin, window())));
        let sums = Sums { exchange, arenas, fields: NodeFields::new(plan) };
        Self { comm, plan, sums, values: NodeFields::new(plan) }
    }

    /// Collective over neighbours. Sums of each leaf with ground at real nodes: `scatter` adds to the rows of
    /// its arena.
    pub(super) fn sum(
        &mut self,
        ground: &Ground<D>,
        scatter: impl Fn(&GroundLeaf<D>, &mut [Row]) + Sync,
    ) -> &[Row] {
        self.sums.over(self.plan, ground, |leaf, _, rows| scatter(leaf, rows))
    }

    /// Collective over neighbours. Flow into the ground at some real nodes, m³/s, with these heads there, m:
    /// `Σ g (h_i - h_j)` over the edges at a node.
    pub(super) fn flows(&mut self, ground: &Ground<D>, nodes: &[u32], heads: &[f64]) -> Vec<f64> {
        self.set(nodes, heads);
        let Self { plan, sums, values, .. } = self;
        let rows = sums.over(plan, ground, |leaf, heads, rows| {
            load(plan, leaf, values, heads);
            leaf.for_each_edge(|low, high, conducts| {
                let flow = conducts * (heads[low].0[0] - heads[high].0[0]);
                rows[low].0[0] += flow;
                rows[high].0[0] -= flow;
            });
        });
        nodes.iter().map(|&node| rows[node as usize].0[0]).collect()
    }

    /// Not collective. Gives values to real nodes, and to the constrained nodes between them.
    pub(super) fn set(&mut self, nodes: &[u32], values: &[f64]) {
        for (&node, &value) in nodes.iter().zip(values) {
            self.values.rows[node as usize] = Row([value, 0.0, 0.0, 0.0]);
        }
        self.values.prolong(self.plan, &self.sums.arenas);
    }

    /// Not collective. Calls `each` with each leaf with ground and the values of the nodes of its arena.
    pub(super) fn for_each_leaf(
        &self,
        ground: &mut Ground<D>,
        each: impl Fn(&mut GroundLeaf<D>, &[Row]) + Sync,
    ) {
        let Self { plan, values, .. } = self;
        ground.leaves.par_iter_mut().for_each_init(Vec::new, |rows, leaf| {
            load(plan, leaf, values, rows);
            each(leaf, rows);
        });
    }

    /// Not collective. Of the particles in each leaf with ground, the head about them as a linear function of
    /// the place: its value at the lower corner of the domain, m, and its gradient.
    pub(super) fn at_particles(&self, ground: &Ground<D>, chunks: &[Chunk<D>]) -> Vec<Vec<[f64; 4]>> {
        let Self { plan, values, .. } = self;
        let leaves = ground.leaves.par_iter().map_init(Vec::new, |heads, leaf| {
            load(plan, leaf, values, heads);
            let chunk = &chunks[leaf.leaf];
            let about = |p: usize| {
                let x = chunk.position(p);
                let (value, gradient) = leaf.head_at(&x, |node| heads[node].0[0]);
                let mut all = [0.0; 4];
                all[0] = (0..D).fold(value, |value, a| (-gradient[a]).mul_add(x[a], value));
                all[1..=D].copy_from_slice(&gradient);
                all
            };
            (0..chunk.len()).map(about).collect()
        });
        leaves.collect()
    }
}

impl<const D: usize> Sums<'_, D> {
    /// Collective over neighbours. See [`Nodes::sum`]; `scatter` also gets memory of the thread.
    fn over(
        &mut self,
        plan: &GridPlan<D>,
        ground: &Ground<D>,
        scatter: impl Fn(&GroundLeaf<D>, &mut Vec<Row>, &mut [Row]) + Sync,
    ) -> &[Row] {
        self.wave(plan, ground, FIRST, &scatter);
        let sums = &mut self.exchange.arenas;
        let pending = sums.begin(sums.pack(plan, &self.arenas, &self.fields));
        for wave in FIRST + 1..self.arenas.schedule().count() {
            self.wave(plan, ground, wave, &scatter);
        }
        let NodeExchange { arenas: sums, received, .. } = &mut *self.exchange;
        sums.finish(pending, received);
        self.fields.add_received(plan, &self.arenas, received);
        self.fields.restrict(plan);
        &self.fields.rows
    }

    fn wave(
        &mut self,
        plan: &GridPlan<D>,
        ground: &Ground<D>,
        wave: usize,
        scatter: &(impl Fn(&GroundLeaf<D>, &mut Vec<Row>, &mut [Row]) + Sync),
    ) {
        let Self { arenas, fields, .. } = self;
        arenas.of_wave(wave).into_par_iter().for_each_init(Vec::new, |memory, mut arena| {
            arena.clear(&window());
            let leaf = plan.bins[arena.bin].leaf as usize;
            scatter(&ground.leaves[ground.number[leaf] as usize], memory, arena.rows);
        });
        fields.sum(plan, arenas, wave);
    }
}

/// Copies the values of the nodes around a leaf into its arena.
fn load<const D: usize>(
    plan: &GridPlan<D>,
    leaf: &GroundLeaf<D>,
    fields: &NodeFields<D>,
    values: &mut Vec<Row>,
) {
    values.resize(arena_nodes(D), Row::default());
    load_rows(plan, leaf.bin, &window(), &fields.rows, values);
}
