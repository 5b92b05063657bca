//! Shares of volume and their gradients at the nodes where bodies meet.
use rayon::prelude::*;

use crate::geometry::Aabb;
use crate::grid::mask::{arena_overlap, bits, block_nodes, offset, offset_count};
use crate::grid::plan::{GridPlan, NO_BLOCK};
use crate::grid::{NodeFields, Window};
use crate::kernel::{ARENA_EDGE, BLOCK, Row};
use crate::particle::Chunk;
use crate::particle::chunk::Layout;
use crate::particle::group::Group;
use crate::particle::volume::{reference_volume, volume_ratio};
use crate::solver::sorting::bins::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::grid::{BetweenBodies, Grid, VelocityField};
use crate::solver::step::p2g::scatter;

impl<const D: usize> Grid<D> {
    /// Per block, its real nodes at which two velocity fields have mass.
    pub(super) fn nodes_where_fields_meet(&self) -> Vec<u64> {
        let nodes = block_nodes(D);
        let all: Vec<&NodeFields<D>> = self.all_fields().collect();
        let blocks = self.plan.blocks.par_iter().enumerate().with_min_len(64);
        let meets = blocks.map(|(index, block)| {
            let active = || all.iter().filter(|fields| fields.active[index]);
            if active().count() < 2 {
                return 0;
            }
            let has_mass =
                |fields: &NodeFields<D>, bit: u32| fields.rows[index * nodes + bit as usize].0[3] > 0.0;
            let meet = |bit: &u32| active().filter(|fields| has_mass(fields, *bit)).count() > 1;
            bits(block.real_nodes()).filter(meet).fold(0, |nodes, bit| nodes | 1 << bit)
        });
        meets.collect()
    }
}

/// Share of a length by which boxes that must hold something are larger.
const MARGIN: f64 = 1e-9;

/// These nodes, and the constrained nodes of blocks that may hand sums to any of them.
fn with_children<const D: usize>(plan: &GridPlan<D>, meets: &[u64]) -> Vec<u64> {
    let mut all = meets.to_vec();
    for fine in plan.links.iter().flat_map(|links| &links.fine) {
        let parents = fine.parents.iter().filter_map(|&parent| all.get(parent as usize));
        if parents.into_iter().any(|&nodes| nodes != 0) {
            all[fine.block as usize] |= plan.blocks[fine.block as usize].constrained;
        }
    }
    all
}

/// The box around these nodes of a block.
fn box_of_nodes<const D: usize>(plan: &GridPlan<D>, block: usize, nodes: u64) -> Aabb<D> {
    let places = bits(nodes).map(|bit| plan.node_place(&plan.blocks[block], bit as usize));
    Aabb::of_points(places)
}

/// Copies of the particles of a group in a box that scatter volumes in place of masses, and gradients of volumes in place of the impulse of stress
/// over 1 s.
fn solids<const D: usize>(chunk: &Chunk<D>, group: &Group<'_>, aabb: &Aabb<D>) -> Chunk<D> {
    let is_near = |p: u32| {
        let x = chunk.position(p as usize);
        (0..D).all(|a| aabb.lower[a] <= x[a] && x[a] <= aabb.upper[a])
    };
    let of_group = (0..).zip(chunk.tags()).filter(|(_, tag)| group.has(**tag)).map(|(p, _)| p);
    let members: Vec<u32> = of_group.filter(|&p| is_near(p)).collect();
    let mut copy = chunk.gathered(&members);
    for p in 0..copy.len() {
        let ratio = volume_ratio(&copy, p);
        copy.write(Layout::<D>::MASS, p, &[reference_volume(&copy, p) * ratio]);
        copy.write(Layout::<D>::VELOCITY, p, &[0.0; D]);
        copy.write(Layout::<D>::AFFINE, p, &[0.0; 9][..D * D]);
        let stress = [-ratio, -ratio, -ratio, 0.0, 0.0, 0.0];
        copy.write(Layout::<D>::STRESS, p, &stress[..Layout::<D>::SYMMETRIC]);
    }
    copy
}

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. Leaves `Σ V ∇w` and `Σ V w` of each velocity field at the real nodes where fields meet.
    pub(super) fn find_geometry(&mut self, meets: &[u64]) -> Result<(), BinMissing> {
        let mut between = match self.grid.between.take() {
            Some(between) => between,
            None => Box::new(self.begin_between()),
        };
        let scattering = with_children(&self.grid.plan, meets);
        let mut sorted = Ok(());
        self.for_each_field(|solver, field| {
            let near = solver.near_others(&scattering);
            let Some(group) = solver.physics.group(field) else { return };
            let (widths, scheme) = (solver.physics.widths(&solver.grid.plan), solver.physics.scheme());
            let plan = &solver.grid.plan;
            let chunks: Vec<Chunk<D>> = (solver.chunks.par_iter().zip(near).enumerate().with_min_len(16))
                .map(|(leaf, (chunk, near))| {
                    if near.is_empty() {
                        return Chunk::new();
                    }
                    let cell = plan.finest_cell(leaf);
                    let half = widths.greatest_of_wide(chunk, cell).max(0.5 * cell);
                    solids(chunk, &group, &near.grown(half * (1.0 + MARGIN)))
                })
                .collect();
            let geometry = &mut between.geometry[field];
            solver.grid.swap(geometry);
            let of_field = solver.grid.sort(&mut solver.phases, &chunks, &widths, None);
            solver.grid.scatter_and_sum(&mut solver.phases, &chunks, |scratch, bin, arena| {
                scatter(scratch, bin, &chunks, &scheme, 1.0, arena);
            });
            solver.grid.swap(geometry);
            sorted = sorted.and(of_field);
        });
        self.grid.between = Some(between);
        sorted
    }

    /// Per own leaf, a box of the points whose hats in the bins of the first velocity field reach any of these nodes, which are given block by block; empty
    /// where there is none.
    fn near_others(&self, nodes: &[u64]) -> Vec<Aabb<D>> {
        let plan = &self.grid.plan;
        let overlaps: Vec<u64> =
            (0..offset_count(D)).map(|index| arena_overlap(offset::<D>(index))).collect();
        let mut near = vec![Aabb::EMPTY; self.chunks.len()];
        for bin in self.grid.arenas.bins().map(|bin| &plan.bins[bin]) {
            let around = bin.around.iter().zip(&overlaps).filter(|(block, _)| **block != NO_BLOCK);
            for (&block, overlap) in around {
                let reached = nodes[block as usize] & overlap;
                if reached != 0 {
                    let box_of_nodes = box_of_nodes(plan, block as usize, reached);
                    let reach = plan.cell(bin.block.level) * (1.0 + MARGIN);
                    let all = &mut near[bin.leaf as usize];
                    *all = all.hull(&box_of_nodes.grown(reach));
                }
            }
        }
        near
    }

    /// Collective over neighbours. Finds the volumes of the basis functions of real nodes: each cell of a leaf gives a share of its volume to each of its
    /// corners, and constrained nodes hand theirs to their parents.
    fn begin_between(&mut self) -> BetweenBodies<D> {
        let fields = self.physics.body_contacts.fields();
        let geometry = (0..fields).map(|_| VelocityField::new(&self.grid.plan)).collect();
        let mut of_cells = VelocityField::new(&self.grid.plan);
        self.grid.swap(&mut of_cells);
        let plan = &self.grid.plan;
        let own_bins = (0..self.chunks.len()).map(|leaf| (plan.leaf_bins(leaf).start, Window::FULL));
        self.grid.arenas.occupy(plan, &self.grid.seam, own_bins);
        // What bins tell of their members is not asked for.
        let cells: Vec<f64> = (0..plan.levels()).map(|level| plan.cell(level as u8)).collect();
        let levels: Vec<u8> = plan.bins.iter().map(|bin| bin.block.level).collect();
        self.grid.scatter_and_sum(&mut self.phases, &self.chunks, |(), bin, mut arena| {
            arena.clear(&Window::FULL);
            let share = (0..D).fold(1.0, |share, _| 0.5 * share * cells[usize::from(levels[bin.number])]);
            for_each_corner::<D>(|node, cells| {
                arena.rows[node] = Row([0.0, 0.0, 0.0, share * f64::from(cells)])
            });
        });
        let volumes = self.grid.fields.rows.iter().map(|row| row.0[3]).collect();
        self.grid.swap(&mut of_cells);
        BetweenBodies { volumes, geometry }
    }
}

/// Calls `each` with the nodes of an arena that are corners of cells of the leaf's block, and the number of these cells.
fn for_each_corner<const D: usize>(mut each: impl FnMut(usize, u32)) {
    let along = BLOCK + 1;
    for corner in 0..along.pow(D as u32) {
        let (mut node, mut cells, mut rest) = (0, 1, corner);
        for axis in 0..D {
            let k = rest % along;
            rest /= along;
            node += (k + 1) * ARENA_EDGE.pow(axis as u32);
            cells *= if k == 0 || k == BLOCK { 1 } else { 2 };
        }
        each(node, cells);
    }
}
