//! Shares of volume and their gradients at the nodes where bodies meet.
use rayon::prelude::*;

use crate::geometry::Aabb;
use crate::grid::mask::{arena_overlap, bits, block_nodes, offset, offset_count};
use crate::grid::plan::{GridPlan, NO_BLOCK};
use crate::grid::{NodeFields, Window};
use crate::kernel::{ARENA_EDGE, BLOCK, Row, domain};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, TILE};
use crate::particle::group::Group;
use crate::particle::volume::{box_volume, volume_ratios};
use crate::solver::sorting::bins::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::grid::{BetweenBodies, Grid, Solids, VelocityField};
use crate::solver::step::p2g::scatter;

impl<const D: usize> Grid<D> {
    /// Real nodes of each block at which two velocity fields have mass.
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

/// Makes `copy` the particles of a group in a box, which scatter volumes in place of masses, and gradients of volumes in place of the impulse of
/// stress over 1 s. Velocities and affine states of a copy are zero. Returns of which particles these are copies.
fn copy_solids<const D: usize>(
    copy: &mut Chunk<D>,
    chunk: &Chunk<D>,
    group: &Group<'_>,
    aabb: &Aabb<D>,
    columns: &[usize],
) -> Vec<u32> {
    let members = members_in(chunk, group, aabb);
    copy.gather_columns(chunk, &members, columns);
    let (tiles, _) = copy.tiles_mut_and_tags();
    for tile in tiles.chunks_exact_mut(Layout::<D>::REALS) {
        let ratios = volume_ratios::<D>(tile);
        for (lane, ratio) in ratios.into_iter().enumerate() {
            tile[Layout::<D>::MASS][lane] = box_volume::<D>(tile[Layout::<D>::HALF][lane]) * ratio;
            (0..3).for_each(|c| tile[Layout::<D>::STRESS + c][lane] = -ratio);
        }
    }
    members
}

/// Particles of a group in a box: first whole tiles, if at least half of one is in the box, then the others, each in order.
fn members_in<const D: usize>(chunk: &Chunk<D>, group: &Group<'_>, aabb: &Aabb<D>) -> Vec<u32> {
    let (mut whole, mut others) = (Vec::with_capacity(chunk.len()), Vec::new());
    let tiles = chunk.tiles().chunks_exact(Layout::<D>::REALS).zip(chunk.tags().chunks(TILE));
    for ((tile, tags), first) in tiles.zip((0..).step_by(TILE)) {
        let mut is_inside = [true; TILE];
        for axis in 0..D {
            let x = &tile[Layout::<D>::POSITION + axis];
            for (is_inside, x) in is_inside.iter_mut().zip(x) {
                *is_inside &= (aabb.lower[axis] <= *x) & (*x <= aabb.upper[axis]);
            }
        }
        let inside = is_inside.iter().filter(|inside| **inside).count();
        if inside == 0 {
            continue;
        }
        if 2 * inside >= TILE && tags.len() == TILE && tags.iter().all(|&tag| group.has(tag)) {
            whole.extend(first..first + TILE as u32);
            continue;
        }
        let members = (first..).zip(tags).zip(is_inside);
        others.extend(members.filter(|((_, tag), inside)| *inside && group.has(**tag)).map(|((p, _), _)| p));
    }
    whole.append(&mut others);
    whole
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
            let columns: Vec<usize> = domain::columns::<D>().collect();
            let Solids { copies, members, field: geometry } = &mut between.solids[field];
            let leaves = copies.par_iter_mut().zip(members).zip(&solver.chunks).zip(near).enumerate();
            leaves.with_min_len(16).for_each(|(leaf, (((copy, members), chunk), near))| {
                if near.is_empty() {
                    (*copy, *members) = (Chunk::new(), Vec::new());
                    return;
                }
                let cell = plan.finest_cell(leaf);
                let half = widths.greatest_of_wide(chunk, cell).max(0.5 * cell);
                *members = copy_solids(copy, chunk, &group, &near.grown(half * (1.0 + MARGIN)), &columns);
            });
            solver.grid.swap(geometry);
            let of_field = solver.grid.sort(&mut solver.phases, copies, &widths, None);
            solver.grid.scatter_and_sum(&mut solver.phases, copies, |scratch, bin, arena| {
                scatter(scratch, bin, copies, &scheme, 1.0, arena);
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
        let solids = || Solids {
            copies: vec![Chunk::new(); self.chunks.len()],
            members: vec![Vec::new(); self.chunks.len()],
            field: VelocityField::new(&self.grid.plan),
        };
        let solids = (0..fields).map(|_| solids()).collect();
        let mut of_cells = VelocityField::new(&self.grid.plan);
        self.grid.swap(&mut of_cells);
        let plan = &self.grid.plan;
        let own_bins = (0..self.chunks.len()).map(|leaf| (plan.leaf_bins(leaf).start, Window::FULL));
        self.grid.arenas.occupy(plan, &self.grid.seam, own_bins);
        // Members of bins are not used.
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
        BetweenBodies { volumes, solids }
    }
}

/// Calls `each` with the nodes of an arena that are corners of cells of the leaf's block, and the number of
/// these cells.
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
