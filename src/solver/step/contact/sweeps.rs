//! Between the particles in contact and the nodes: weights of the points of contact.
use rayon::prelude::*;

use crate::boundary::Touching;
use crate::grid::NodeFields;
use crate::grid::mask::{bits, block_nodes};
use crate::grid::plan::GridPlan;
use crate::grid::sums::node_fields::VelocityArena;
use crate::kernel::g2p::{self, Gathered};
use crate::kernel::{Row, Transfer};
use crate::particle::Chunk;
use crate::particle::chunk::Layout;
use crate::solver::sorting::bin_view::BinView;
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::state::phases::Phase;
use crate::solver::step::transfer::interpolate::Look;
use crate::solver::step::transfer::p2g::{scatter, spreads};

/// Second moments D of the weights, m², of the particles in contact, leaf by leaf.
type Spreads<const D: usize> = Vec<Vec<[f64; D]>>;

/// Memory that a thread reuses from leaf to leaf.
struct Scratch<const D: usize> {
    kernel: g2p::Scratch<D>,
    arena: VelocityArena<D>,
    gathered: Vec<Gathered<D>>,
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        Self { kernel: g2p::Scratch::default(), arena: VelocityArena::default(), gathered: Vec::new() }
    }
}

impl<const D: usize> Solver<D> {
    /// Not collective. Second moments of the weights of the particles in contact, which are sorted.
    pub(super) fn spreads_in_contact(&self, chunks: &[Chunk<D>]) -> Spreads<D> {
        let (plan, lists, scheme) = (&self.grid.plan, &self.grid.contact.lists, self.physics.scheme());
        let leaves = chunks.par_iter().enumerate().with_min_len(16);
        let spreads = leaves.map(|(leaf, chunk)| {
            spreads(BinView::of_leaf(plan, lists.of_leaf(leaf), leaf, chunk.len()), chunk, &scheme)
        });
        spreads.collect()
    }

    /// Collective over neighbours. Velocity at each point of contact by uniform pressure on all particles in
    /// contact of a velocity field, over the impulse there: halves and splits cover less of the surface.
    pub(super) fn find_compliances(
        &mut self,
        field: usize,
        chunks: &mut [Chunk<D>],
        spreads: &Spreads<D>,
        touching: &mut [Vec<Touching<D>>],
    ) {
        let along = |size: f64| std::array::from_fn(|a| if a == 0 { size } else { 0.0 });
        self.scatter_impulses(chunks, spreads, touching, |leaf, p| along(touching[leaf][p].area));
        let Grid { plan, fields, contact, .. } = &mut self.grid;
        let masses = &fields[field].nodes.rows;
        for_real_nodes(&mut contact.nodes, plan, |node, row| {
            let mass = masses[node].0[3];
            *row = Row([if mass > 0.0 { row.0[0] / mass } else { 0.0 }, 0.0, 0.0, 0.0]);
        });
        let compliances = self.velocities_in_contact(chunks, spreads, touching);
        for (touching, compliances) in touching.iter_mut().zip(&compliances) {
            let each = touching.iter_mut().zip(compliances);
            each.for_each(|(contact, c)| contact.compliance = [c[0] / contact.area; 2]);
        }
    }

    /// Collective over neighbours. Leaves on real nodes the sums of an impulse at each point of contact.
    pub(super) fn scatter_impulses(
        &mut self,
        chunks: &mut [Chunk<D>],
        spreads: &Spreads<D>,
        touching: &[Vec<Touching<D>>],
        impulse: impl Fn(usize, usize) -> [f64; D],
    ) {
        let mut scheme = self.physics.scheme();
        if !scheme.transfer.has_affine() {
            // The impulses have an affine part whatever the particles carry.
            scheme.transfer = Transfer::Tpic;
        }
        for (leaf, chunk) in chunks.iter_mut().enumerate() {
            for p in 0..chunk.len() {
                let (j, arm) = (impulse(leaf, p), &touching[leaf][p].lever);
                chunk.write(Layout::<D>::VELOCITY, p, &j);
                for k in 0..D {
                    // The affine matrix of APIC is not yet divided by D.
                    let share = match scheme.transfer {
                        Transfer::Apic => arm[k],
                        _ => arm[k] / spreads[leaf][p][k],
                    };
                    for i in 0..D {
                        chunk.write(Layout::<D>::AFFINE + D * i + k, p, &[j[i] * share]);
                    }
                }
            }
        }
        let chunks: &[Chunk<D>] = chunks;
        let times = &self.leaf_data.times;
        let Grid { plan, exchange, contact, .. } = &mut self.grid;
        contact.scatter_and_sum((plan, exchange), &mut self.phases, chunks, |scratch, bin, arena| {
            times.time(bin.leaf, || scatter(scratch, bin, (chunks, &[]), &scheme, 0.0, arena));
        });
    }

    /// Not collective. Adds the impulses on real nodes to the velocities of a velocity field.
    pub(in crate::solver::step) fn add_impulses(&mut self, field: usize) {
        let Grid { plan, fields, contact, .. } = &mut self.grid;
        let rows = &mut fields[field].nodes.rows;
        self.phases.time(Phase::Nodes, || {
            for_real_nodes(&mut contact.nodes, plan, |node, impulse| {
                let row = &mut rows[node].0;
                if row[3] > 0.0 {
                    (0..D).for_each(|a| row[a] += impulse.0[a] / row[3]);
                }
            });
        });
    }

    /// Not collective. Has the real nodes around what is in contact take the velocities of a velocity field.
    pub(in crate::solver::step) fn take_velocities(&mut self, field: usize) {
        let Grid { plan, fields, contact, .. } = &mut self.grid;
        let rows = &fields[field].nodes.rows;
        for_real_nodes(&mut contact.nodes, plan, |node, row| {
            let [x, y, z, _] = rows[node].0;
            *row = Row([x, y, z, 0.0]);
        });
    }

    /// Not collective. `Σ W_j v_j` at each point of contact, with the velocities v of real nodes.
    pub(super) fn velocities_in_contact(
        &mut self,
        chunks: &[Chunk<D>],
        spreads: &Spreads<D>,
        touching: &[Vec<Touching<D>>],
    ) -> Vec<Vec<[f64; D]>> {
        let Grid { plan, contact, .. } = &mut self.grid;
        contact.prolong(plan, &mut self.phases);
        let (scheme, VelocityField { nodes, arenas, lists, .. }) = (self.physics.scheme(), &*contact);
        let look = Look { plan, fields: nodes, arenas, scheme: &scheme };
        let times = &self.leaf_data.times;
        self.phases.time(Phase::Gather, || {
            let leaves = chunks.par_iter().enumerate().with_min_len(8);
            let all = leaves.map_init(Scratch::default, |scratch: &mut Scratch<D>, (leaf, chunk)| {
                let mut velocities = vec![[0.0; D]; chunk.len()];
                if chunk.is_empty() {
                    return velocities;
                }
                let Scratch { kernel, arena, gathered } = scratch;
                let mut take = |p: usize, gathered: &Gathered<D>| {
                    let (v, affine) = (gathered.velocity(), gathered.affine());
                    let (arm, spread) = (&touching[leaf][p].lever, &spreads[leaf][p]);
                    velocities[p] = std::array::from_fn(|i| {
                        (0..D).fold(v[i], |sum, k| affine[i][k].mul_add(arm[k] / spread[k], sum))
                    });
                };
                times.time(leaf, || {
                    look.at_leaf((kernel, arena, gathered), lists.of_leaf(leaf), leaf, chunk, &mut take);
                });
                velocities
            });
            all.collect()
        })
    }
}

/// Calls `each` with the numbers and rows of the real nodes that particles in contact reach.
pub(in crate::solver::step) fn for_real_nodes<const D: usize>(
    fields: &mut NodeFields<D>,
    plan: &GridPlan<D>,
    mut each: impl FnMut(usize, &mut Row),
) {
    let nodes = block_nodes(D);
    for (index, block) in plan.blocks.iter().enumerate().filter(|(index, _)| fields.active[*index]) {
        for bit in bits(block.real_nodes()) {
            let node = index * nodes + bit as usize;
            each(node, &mut fields.rows[node]);
        }
    }
}
