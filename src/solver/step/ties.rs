//! Surface nodes that move with the material beside them: which cells are well filled, and which nodes are
//! fixed by other conditions.
use rayon::prelude::*;

use crate::boundary::{Collider, ColliderState};
use crate::grid::leaf_geometry::{LeafCells, leaf_box};
use crate::grid::mask::bits;
use crate::grid::plan::Block;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::BLOCK;
use crate::load::{Kind, Load};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, TILE};
use crate::particle::group::{Group, Share};
use crate::particle::volume::{box_volume, volume_ratios};
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::inside::{SAME, is_still};
use crate::solver::state::phases::Phase;

/// Share of its volume from which a cell is well filled. A little less than one half, so that cells that are
/// half full, as at the surface of a body that ends in the middle of cells, do not change state with every
/// wave.
const WELL_FILLED: f64 = 0.47;

/// The cells of a leaf that particles with their centres in them fill well, a bit each. `volume` is that of a
/// cell.
fn well_filled<const D: usize>(
    chunk: &Chunk<D>,
    cells: &LeafCells<D>,
    volume: f64,
    group: Option<&Group<'_>>,
) -> u64 {
    let group = match group.map(|group| (group, group.share(chunk))) {
        Some((_, Share::None)) => return 0,
        Some((group, Share::Some)) => Some(group),
        _ => None,
    };
    let mut filled = [0.0; BLOCK.pow(3)];
    let tiles = chunk.tiles().chunks_exact(Layout::<D>::REALS).zip(chunk.tags().chunks(TILE));
    for (tile, tags) in tiles {
        let ratios = volume_ratios::<D>(tile);
        for (lane, tag) in tags.iter().enumerate() {
            if group.is_none_or(|group| group.has(*tag)) {
                let x = std::array::from_fn(|axis| tile[Layout::<D>::POSITION + axis][lane]);
                filled[cells.cell_of(&x)] += box_volume::<D>(tile[Layout::<D>::HALF][lane]) * ratios[lane];
            }
        }
    }
    let well = filled.iter().enumerate().filter(|(_, filled)| **filled >= WELL_FILLED * volume);
    well.fold(0, |cells, (cell, _)| cells | 1 << cell)
}

/// Distance from a collider, in cells, below which nodes have no ties.
const NEAR: f64 = 1.0;

/// Those of some nodes of a block that lie in colliders or near one.
fn near_colliders<const D: usize>(
    plan: &GridPlan<D>,
    block: &Block<D>,
    nodes: u64,
    colliders: &[(&Collider<D>, &ColliderState<D>)],
) -> u64 {
    let reach = NEAR * plan.cell(block.level) * (1.0 + SAME);
    let nodes_box = plan.nodes_box(block);
    let mut near = 0;
    for (collider, ColliderState { pose, .. }) in colliders {
        if nodes != near && collider.distance_to_box(&nodes_box, pose) <= reach {
            let found = bits(nodes & !near)
                .filter(|bit| collider.distance(&plan.node_place(block, *bit as usize), pose) <= reach);
            near |= found.fold(0, |all, bit| all | 1 << bit);
        }
    }
    near
}

impl<const D: usize> Solver<D> {
    /// Nodes with mass of each velocity field, a word for each block, where fields with ties meet others. To
    /// be called before velocities of nodes change.
    pub(super) fn occupied(&self) -> Vec<Vec<u64>> {
        let plan = &self.grid.plan;
        let of_field = |nodes: &NodeFields<D>| {
            let blocks = plan.blocks.par_iter().zip(&nodes.active).enumerate().with_min_len(64);
            let words = blocks.map(|(index, (block, active))| match active {
                true => nodes.with_mass(index, block.real_nodes(), 0.0),
                false => 0,
            });
            words.collect()
        };
        let meet = self.grid.ties.is_some() && self.physics.body_contacts.fields() > 1;
        if meet { self.grid.all_fields().map(of_field).collect() } else { Vec::new() }
    }

    /// Collective over neighbours. Ties the surface nodes of the velocity field numbered `field`, whose rows
    /// hold velocities, if it has ties. Free of ties stay nodes that other conditions move and nodes beside
    /// what the material may touch, where ties would keep it from giving way: nodes on faces of the domain,
    /// in grips, within a cell of colliders, and those of other fields, whose nodes with mass are `occupied`.
    pub(super) fn tie_surface(&mut self, field: usize, occupied: &[Vec<u64>]) {
        if !self.physics.has_ties(field) {
            return;
        }
        self.fill_cells(field);
        let all = self.physics.colliders.iter().zip(&self.contacts.states);
        let (still, moving): (Vec<_>, Vec<_>) =
            all.filter(|(collider, _)| collider.is_present()).partition(|(collider, _)| is_still(collider));
        let grips: Vec<&Load<D>> = self
            .physics
            .loads
            .iter()
            .filter(|load| matches!(load.kind, Kind::Velocity(_)) && load.is_active(self.clock.time))
            .collect();
        let Grid { fields, plan, ties, .. } = &mut self.grid;
        let (Some(ties), nodes, plan) = (ties, &mut fields[field].nodes, &*plan) else { return };
        self.phases.time(Phase::Nodes, || {
            ties.note_still(nodes, |block| {
                near_colliders(plan, &plan.blocks[block], plan.blocks[block].real_nodes(), &still)
            });
            ties.tie(plan, field, nodes, |index, nodes| {
                let block = &plan.blocks[index];
                let others = occupied.iter().enumerate().filter(|(other, _)| *other != field);
                let touched = others.fold(0, |all, (_, words)| all | words[index]);
                let gripped = bits(if grips.is_empty() { 0 } else { nodes }).filter(|bit| {
                    let x = plan.node_place(block, *bit as usize);
                    grips.iter().any(|load| load.reaches(&x))
                });
                let gripped = gripped.fold(0, |all, bit| all | 1 << bit);
                touched | gripped | near_colliders(plan, block, nodes, &moving)
            });
        });
    }

    /// Collective over neighbours. Tells the ties which cells the particles of a velocity field fill well, in
    /// jobs that have ties.
    pub(in crate::solver) fn fill_cells(&mut self, field: usize) {
        let Grid { plan, ties: Some(ties), .. } = &mut self.grid else { return };
        let (group, plan) = (self.physics.group(field), &*plan);
        let leaves = self.chunks.par_iter().zip(self.forest.leaves()).with_min_len(16);
        let own: Vec<u64> = self.phases.time(Phase::Nodes, || {
            let filled = leaves.map(|(chunk, leaf)| match chunk.is_empty() {
                true => 0,
                false => {
                    let cells = LeafCells::new(&leaf_box(leaf, plan.root_edge));
                    well_filled(chunk, &cells, plan.cell(leaf.level).powi(D as i32), group.as_ref())
                }
            });
            filled.collect()
        });
        self.phases.time(Phase::Exchange, || ties.fill(plan, &own));
    }
}
