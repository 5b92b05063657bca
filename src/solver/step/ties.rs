//! Surface nodes that move with the material beside them: which cells are well filled, and which nodes are
//! fixed by other conditions.
use rayon::prelude::*;

use crate::boundary::Collider;
use crate::grid::leaf_geometry::{LeafCells, leaf_box};
use crate::grid::ties::Ties;
use crate::kernel::BLOCK;
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, TILE};
use crate::particle::group::{Group, Share};
use crate::particle::volume::{box_volume, volume_ratios};
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::inside::{Asked, Inside, is_still};
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

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. Ties the surface nodes of the velocity field numbered `field`, which is in
    /// the place of the first and whose rows hold velocities, in jobs with ties. Nodes on faces of the domain
    /// and inside colliders follow these.
    pub(super) fn tie_surface(&mut self, field: usize) {
        let Some(mut ties) = self.grid.ties.take() else { return };
        self.fill_cells(&mut ties, field);
        let colliders: Vec<(usize, &Collider<D>)> = self
            .physics
            .colliders
            .iter()
            .enumerate()
            .filter(|(_, collider)| collider.acts_on_nodes())
            .collect();
        let states = &self.contacts.states;
        let Grid { fields, plan, inside_still, .. } = &mut self.grid;
        let still = &*inside_still;
        self.phases.time(Phase::Nodes, || {
            ties.tie(plan, field, fields, |block, nodes| {
                let all = colliders.iter().map(|&(index, collider)| {
                    // The known nodes inside colliders that never move cover all real nodes.
                    let known = still.get(block).and_then(|of_block| of_block.get(index)?.as_ref());
                    match known.filter(|_| is_still(collider)) {
                        Some(inside) => inside.nodes & nodes,
                        None => {
                            let (block, pose) = (&plan.blocks[block], &states[index].pose);
                            Inside::find(plan, block, nodes, (collider, pose), &[], Asked::NODES).nodes
                        }
                    }
                });
                all.fold(0, |held, inside| held | inside)
            });
        });
        self.grid.ties = Some(ties);
    }

    /// Collective over neighbours. Tells the ties which cells the particles of a velocity field fill well.
    pub(in crate::solver) fn fill_cells(&mut self, ties: &mut Ties<D>, field: usize) {
        let group = self.physics.group(field);
        let plan = &self.grid.plan;
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
