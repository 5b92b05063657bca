//! Volumes and their gradients at nodes near surfaces: where bodies meet, and at walls.
//!
//! Copies of the particles near such nodes scatter their volumes and the gradients of these, which take the
//! way of masses through bins, sums over ranks and constrained nodes; the rest of the grid pays nothing.
use rayon::prelude::*;

use crate::boundary::gap::elastic_share;
use crate::geometry::Aabb;
use crate::grid::arenas::Arenas;
use crate::grid::mask::{arena_overlap, bits, offset, offset_count};
use crate::grid::plan::{GridPlan, NO_BLOCK};
use crate::kernel::domain;
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, TILE};
use crate::particle::group::Group;
use crate::particle::volume::{box_volume, volume_ratios};
use crate::solver::sorting::box_widths::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::state::grid::{Grid, Solids};
use crate::solver::step::transfer::p2g::scatter;

/// Share of a length by which boxes that must hold something are larger.
const MARGIN: f64 = 1e-9;

/// The box around these nodes of a block.
fn box_of_nodes<const D: usize>(plan: &GridPlan<D>, block: usize, nodes: u64) -> Aabb<D> {
    let places = bits(nodes).map(|bit| plan.node_place(&plan.blocks[block], bit as usize));
    Aabb::of_points(places)
}

/// Makes `copy` the particles of a group in a box, which scatter volumes in place of masses, and gradients of
/// volumes in place of the impulse of stress over 1 s. Velocities and affine states of a copy are zero.
/// Returns of which particles these are copies.
fn copy_solids<const D: usize>(
    copy: &mut Chunk<D>,
    chunk: &Chunk<D>,
    group: Option<&Group<'_>>,
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

/// Takes what has yielded out of the gradients of copies.
fn keep_elastic<const D: usize>(copy: &mut Chunk<D>) {
    let (tiles, _) = copy.tiles_mut_and_tags();
    for tile in tiles.chunks_exact_mut(Layout::<D>::REALS) {
        let share = tile[Layout::<D>::PLASTIC_STRAIN].map(elastic_share);
        for c in 0..3 {
            tile[Layout::<D>::STRESS + c].iter_mut().zip(share).for_each(|(stress, share)| *stress *= share);
        }
    }
}

/// Particles of a group in a box: first whole tiles, if at least half of one is in the box, then the others,
/// each in order.
fn members_in<const D: usize>(chunk: &Chunk<D>, group: Option<&Group<'_>>, aabb: &Aabb<D>) -> Vec<u32> {
    let has = |tag: u64| group.is_none_or(|group| group.has(tag));
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
        if 2 * inside >= TILE && tags.len() == TILE && tags.iter().all(|&tag| has(tag)) {
            whole.extend(first..first + TILE as u32);
            continue;
        }
        let members = (first..).zip(tags).zip(is_inside);
        others.extend(members.filter(|((_, tag), inside)| *inside && has(**tag)).map(|((p, _), _)| p));
    }
    whole.append(&mut others);
    whole
}

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. Leaves `Σ V ∇w` and `Σ V w` of each velocity field at these nodes, given
    /// block by block, with the constrained ones that hand sums to real ones among them. Fields that are not
    /// `is_asked` for are left out. What has yielded gives walls no gradients where it moves over gaps until
    /// then; `is_between` says that other bodies ask too, and for all gradients.
    pub(super) fn find_volumes(
        &mut self,
        scattering: &[u64],
        is_asked: &[bool],
        is_between: bool,
    ) -> Result<(), BinMissing> {
        if !is_asked.contains(&true) {
            return Ok(());
        }
        let Grid { plan, fields, exchange, walls, solids, .. } = &mut self.grid;
        if solids.is_empty() {
            solids.extend(fields.iter().map(|_| Solids::new(plan, self.chunks.len())));
        }
        let (widths, scheme) = (self.physics.widths(plan), self.physics.scheme());
        let mut sum = |sums: &mut VelocityField<D>, copies: &[Chunk<D>]| {
            let (phases, on) = (&mut self.phases, (&*plan, &exchange.seam));
            let sorted = sums.sort(on, phases, copies, (&widths, scheme.coordinates), None);
            sums.scatter_and_sum((plan, exchange), phases, copies, |scratch, bin, arena| {
                scatter(scratch, bin, (copies, &[]), &scheme, 1.0, arena);
            });
            sorted
        };
        let mut sorted = Ok(());
        for (field, solids) in solids.iter_mut().enumerate().filter(|(field, _)| is_asked[*field]) {
            let near = near_nodes(plan, &fields[field].arenas, scattering, self.chunks.len());
            let group = self.physics.group(field);
            let yields = walls.known_over.is_some() && self.physics.moves_until_it_yields(field);
            let yielded = yields.then_some(Layout::<D>::PLASTIC_STRAIN);
            let columns: Vec<usize> = domain::columns::<D>().chain(yielded).collect();
            let Solids { copies, members, field: all, elastic } = solids;
            let leaves = copies.par_iter_mut().zip(members).zip(&self.chunks).zip(near).enumerate();
            leaves.with_min_len(16).for_each(|(leaf, (((copy, members), chunk), near))| {
                if near.is_empty() {
                    (*copy, *members) = (Chunk::new(), Vec::new());
                    return;
                }
                let cell = plan.finest_cell(leaf);
                let half = widths.greatest_of_wide(chunk, cell).max(0.5 * cell);
                *members =
                    copy_solids(copy, chunk, group.as_ref(), &near.grown(half * (1.0 + MARGIN)), &columns);
                if yields && !is_between {
                    keep_elastic(copy);
                }
            });
            *elastic =
                (yields && is_between).then(|| elastic.take().unwrap_or_else(|| VelocityField::new(plan)));
            sorted = sorted.and(sum(all, copies));
            if let Some(elastic) = elastic {
                copies.par_iter_mut().with_min_len(16).for_each(keep_elastic);
                sorted = sorted.and(sum(elastic, copies));
            }
        }
        sorted
    }
}

/// Per own leaf, of which there are so many, a box of the points whose hats in the occupied bins reach any of
/// these nodes, which are given block by block; empty where there is none.
fn near_nodes<const D: usize>(
    plan: &GridPlan<D>,
    arenas: &Arenas<D>,
    nodes: &[u64],
    leaves: usize,
) -> Vec<Aabb<D>> {
    let overlaps: Vec<u64> = (0..offset_count(D)).map(|index| arena_overlap(offset::<D>(index))).collect();
    let mut near = vec![Aabb::EMPTY; leaves];
    for bin in arenas.bins().map(|bin| &plan.bins[bin]) {
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
