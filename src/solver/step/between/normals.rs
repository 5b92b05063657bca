//! Smoothed normals between bodies.
//!
//! The boxes of particles end in steps of half a cell, and the hat of a node sees one or two of them: normals
//! of curved surfaces from the sums at one node are 4 to 8 degrees off, at any width of cells. Where a normal
//! leans against the motion the node presses, where it leans along it the node lets go, so that smooth
//! surfaces rub. One smoothing takes most of this away: each cell has the mean of its corners, and each node
//! the mean of its cells, which is ¼ ½ ¼ along each axis. Cells belong to leaves, so the smoothing takes the
//! way of particles: through arenas, sums over ranks and constrained nodes. Only nodes at which bodies meet
//! take part, where all particles near are known to every rank; and only as far as the bodies touch there:
//! the sums beside an edge of a block on a slab are those of its side as well, and would tilt normals under
//! it.
use rayon::prelude::*;

use crate::boundary::bodies::{gap_between, part_in_normals};
use crate::grid::mask::{bits, block_nodes, offset, offset_count, product};
use crate::grid::plan::NO_BLOCK;
use crate::grid::sums::node_fields::load_rows;
use crate::grid::{GridPlan, Window};
use crate::kernel::{ARENA_EDGE, BLOCK, Row, arena_nodes};
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::state::grid::walls::with_children;
use crate::solver::state::phases::Phase;

/// Smoothed `Σ V ∇w` at the nodes where bodies meet.
pub(super) struct Smoothed<const D: usize> {
    /// Number of the first of these nodes in each block.
    first: Vec<usize>,
    /// Of each velocity field; of two alone, that of the first less that of the second.
    of_field: Vec<Vec<[f64; D]>>,
}

impl<const D: usize> Smoothed<D> {
    /// That of the first of two fields less that of the second at a node of a block, of whose nodes bodies
    /// meet at `meets`.
    pub(super) fn between(&self, block: usize, bit: u32, meets: u64, fields: [usize; 2]) -> [f64; D] {
        let number = self.first[block] + (meets & ((1 << bit) - 1)).count_ones() as usize;
        match &self.of_field[..] {
            [difference] => difference[number],
            all => {
                let [a, b] = fields.map(|field| &all[field][number]);
                std::array::from_fn(|k| a[k] - b[k])
            }
        }
    }
}

/// An own leaf with corners of cells at which bodies meet.
struct Leaf<const D: usize> {
    /// Bin of its own level.
    bin: usize,
    /// Part of each cell that its corners get, m³ (in plane strain m²), by place along the first axis.
    part: [f64; BLOCK],
    /// Means of the cells, the first axis fastest.
    means: Vec<[f64; D]>,
}

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. Smooths `Σ V ∇w` over the cells around the nodes where bodies meet, given
    /// block by block. The volumes of hats are known.
    pub(super) fn smooth_gradients(&mut self, meets: &[u64]) -> Smoothed<D> {
        self.grid.contact.provide(&self.grid.plan);
        let passes = if self.grid.fields.len() == 2 { 1 } else { self.grid.fields.len() };
        let of_field = (0..passes).map(|field| {
            let own = self.meets_of(field, meets);
            let mut leaves = self.leaves_at(&own);
            let Grid { plan, exchange, contact, .. } = &mut self.grid;
            let bins = leaves.iter().map(|leaf| (leaf.bin, Window::FULL));
            contact.arenas.occupy(plan, &exchange.seam, bins);
            self.cell_means(&own, &mut leaves, (field, passes));
            let Grid { plan, exchange, contact, .. } = &mut self.grid;
            contact.scatter_and_sum(
                (plan, exchange),
                &mut self.phases,
                &self.chunks,
                |(), bin, mut arena| {
                    arena.clear(&Window::FULL);
                    if let Ok(leaf) = leaves.binary_search_by_key(&bin.number, |leaf| leaf.bin) {
                        leaves[leaf].scatter(arena.rows);
                    }
                },
            );
            let rows = &contact.nodes.rows;
            let blocks = meets.iter().enumerate();
            let nodes = blocks.flat_map(|(block, nodes)| {
                bits(*nodes).map(move |bit| block * block_nodes(D) + bit as usize)
            });
            nodes.map(|node| std::array::from_fn(|a| rows[node].0[a])).collect()
        });
        let of_field = of_field.collect();
        let first = meets.iter().scan(0, |next, nodes| {
            let first = *next;
            *next += nodes.count_ones() as usize;
            Some(first)
        });
        Smoothed { first: first.collect(), of_field }
    }

    /// Those of the nodes where bodies meet that a velocity field has mass at.
    fn meets_of(&self, field: usize, meets: &[u64]) -> Vec<u64> {
        let fields = &self.grid.solids[field].field.nodes;
        let own = |(block, nodes): (usize, &u64)| {
            let has_mass = |bit: &u32| fields.rows[block * block_nodes(D) + *bit as usize].0[3] > 0.0;
            let nodes = if fields.active[block] { *nodes } else { 0 };
            bits(nodes).filter(has_mass).fold(0, |nodes, bit| nodes | 1 << bit)
        };
        meets.iter().enumerate().map(own).collect()
    }

    /// Own leaves with cells at whose corners bodies meet, or that may have values of such.
    fn leaves_at(&self, meets: &[u64]) -> Vec<Leaf<D>> {
        let (plan, coordinates) = (&self.grid.plan, self.physics.coordinates);
        let nodes = with_children(plan, meets);
        let corners: Vec<u64> = (0..offset_count(D)).map(|index| corners_at(offset::<D>(index))).collect();
        let leaves = (0..self.chunks.len()).into_par_iter().with_min_len(64);
        let found = leaves.filter_map(|leaf| {
            let number = plan.leaf_bins(leaf).start;
            let bin = &plan.bins[number];
            let mut around = bin.around.iter().zip(&corners).filter(|(block, _)| **block != NO_BLOCK);
            if !around.any(|(&block, corners)| nodes[block as usize] & corners != 0) {
                return None;
            }
            let cell = plan.cell(bin.block.level);
            let first = f64::from(bin.block.coord[0]) * BLOCK as f64;
            let part = std::array::from_fn(|k| {
                (0.5 * cell).powi(D as i32) * coordinates.around((first + k as f64 + 0.5) * cell)
            });
            Some(Leaf { bin: number, part, means: vec![[0.0; D]; block_nodes(D)] })
        });
        found.collect()
    }

    /// Not collective. Means of `Σ V ∇w` over the volumes of hats at the corners of cells, as far as bodies
    /// touch there, of a velocity field out of so many that have a pass of their own.
    fn cell_means(&mut self, meets: &[u64], leaves: &mut [Leaf<D>], (field, passes): (usize, usize)) {
        let Grid { plan, solids, hats, contact: VelocityField { nodes, arenas, .. }, .. } = &mut self.grid;
        let (plan, solids) = (&*plan, &*solids);
        let gradient = |node: usize| -> Row {
            let (block, bit) = (node / block_nodes(D), node % block_nodes(D));
            if meets[block] >> bit & 1 == 0 {
                return Row::default();
            }
            let on_faces = plan.faces_at(node);
            let of = |field: usize| &solids[field].field.nodes.rows[node].0;
            let all: f64 = (0..solids.len()).map(|field| of(field)[3]).sum();
            let own = of(field)[3];
            let part = part_in_normals(gap_between([own, all - own].map(|volume| volume / hats[node])));
            if part == 0.0 {
                return Row::default();
            }
            Row(std::array::from_fn(|a| {
                // A face of the domain is no surface of a body.
                if a >= D || on_faces >> (2 * a) & 3 != 0 {
                    return 0.0;
                }
                let sum = if passes == 1 { of(0)[a] - of(1)[a] } else { of(field)[a] };
                part * sum / hats[node]
            }))
        };
        self.phases.time(Phase::Nodes, || {
            nodes.spread(plan, arenas, gradient);
            let rows = &nodes.rows;
            let buffer = || vec![Row::default(); arena_nodes(D)];
            leaves
                .par_iter_mut()
                .with_min_len(16)
                .for_each_init(buffer, |arena, leaf| leaf.read(plan, rows, arena));
        });
    }
}

impl<const D: usize> Leaf<D> {
    /// Finds the means of the cells; `arena` is memory of the thread.
    fn read(&mut self, plan: &GridPlan<D>, rows: &[Row], arena: &mut [Row]) {
        load_rows(plan, self.bin, &Window::FULL, rows, arena);
        for (cell, mean) in self.means.iter_mut().enumerate() {
            let mut sum = Row::default();
            corners::<D>(cell).for_each(|corner| sum.add(&arena[corner]));
            *mean = std::array::from_fn(|a| sum.0[a] / f64::from(1u32 << D));
        }
    }

    /// Adds to the nodes of its arena their parts of the cells.
    fn scatter(&self, arena: &mut [Row]) {
        for (cell, mean) in self.means.iter().enumerate() {
            let part = self.part[cell % BLOCK];
            let part = Row(std::array::from_fn(|a| if a < D { part * mean[a] } else { 0.0 }));
            corners::<D>(cell).for_each(|corner| arena[corner].add(&part));
        }
    }
}

/// Numbers in an arena of the corners of a cell of its block, which are numbered with the first axis fastest.
fn corners<const D: usize>(cell: usize) -> impl Iterator<Item = usize> {
    let first = (0..D).fold(0, |first, axis| {
        let along = cell / BLOCK.pow(axis as u32) % BLOCK;
        first + (along + 1) * ARENA_EDGE.pow(axis as u32)
    });
    (0..1usize << D).map(move |corner| {
        (0..D).fold(first, |node, axis| node + (corner >> axis & 1) * ARENA_EDGE.pow(axis as u32))
    })
}

/// The nodes of the block at an offset from a leaf's own that are corners of its cells.
fn corners_at<const D: usize>(offset: [i32; D]) -> u64 {
    product::<D>(offset.map(|o| match o {
        -1 => 0,
        0 => 0b1111,
        _ => 0b0001,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_the_nodes_of_their_block_and_those_above() {
        let total =
            |count: usize, at: &dyn Fn(usize) -> u64| (0..count).map(|i| at(i).count_ones()).sum::<u32>();
        assert_eq!(total(9, &|index| corners_at(offset::<2>(index))), 25);
        assert_eq!(total(27, &|index| corners_at(offset::<3>(index))), 125);
        let mut reached: Vec<usize> = (0..64).flat_map(corners::<3>).collect();
        reached.sort_unstable();
        reached.dedup();
        let place = |node: usize| [1, 7, 49].map(|stride| node / stride % 7);
        assert_eq!(reached.len(), 125);
        assert!(reached.iter().all(|&node| place(node).iter().all(|k| (1..=5).contains(k))));
    }
}
