//! Surfaces that hold material back on nodes: where the material is, and the conditions of colliders.
//!
//! Nodes have mass as soon as material enters their hats, a cell ahead of the surface. So the sums `Σ V w`
//! and `Σ V ∇w` at the nodes of a surface say how far the material is ([`crate::boundary::gap`]), and it
//! moves freely over that way.
//!
//! The surface of a collider lies between rows of nodes. A condition at the nodes inside would leave all of
//! the reaction to these, though the material fills only part of the cells that the surface cuts; so it holds
//! at the foot of each node on the surface, for the velocity `Σ N_j v_j` there, with the bilinear weights N
//! of the corners of the foot's cell that have mass. The impulse J goes to them by the same weights, so that
//! momentum, angular momentum and work are those of J at the foot. Feet that share corners are solved
//! together by Jacobi's sweeps, as particles in contact are ([`super::contact`]). Nodes so deep that their
//! hats do not reach their foot have slivers of mass and no freedom of their own: they move with the foot.
//! Where they have more mass than the foot's cell, material has strayed into the collider, and they obey its
//! condition themselves. On a row of nodes foot and node are one.
//!
//! Feet belong to the leaf that they are in and take the way of its particles: arenas, sums over ranks,
//! constrained nodes. No bit depends on ranks.
//!
//! | file | what it holds |
//! |---|---|
//! | `feet` | feet, and the gap there |
//! | `sweeps` | from feet to nodes and back |
//! | `at_nodes` | nodes that are held themselves |
//! | `passing` | ways of particles that would lead through a face |
mod at_nodes;
mod feet;
pub(super) mod passing;
mod sweeps;

pub(super) use at_nodes::obey;
use rayon::prelude::*;

use crate::boundary::Collider;
use crate::boundary::motion::Rate;
use crate::exact_sum::ExactSum;
use crate::grid::Window;
use crate::grid::mask::{bits, block_nodes};
use crate::grid::plan::needed_nodes::nodes_in_domain;
use crate::leapfrog::Lengths;
use crate::solver::sorting::box_widths::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::inside::{Asked, Inside, is_still};
use crate::solver::state::grid::walls::{StillWalls, with_children};
use crate::solver::state::phases::Phase;
use crate::solver::step::colliders::Touch;

/// Sweeps over the feet in a step.
const SWEEPS: usize = 6;

impl<const D: usize> Solver<D> {
    /// Whether the material of a velocity field must know how far it is from a wall.
    fn asks_for_gaps(&self, field: usize) -> bool {
        self.physics.moves_over_gaps(field) || self.physics.has_walls_by_area()
    }

    /// Whether any collider acts at feet on a velocity field.
    fn has_feet(&self, field: usize) -> bool {
        self.physics.colliders.iter().any(|collider| self.physics.acts_at_feet(field, collider))
    }

    /// Whether any that acts on nodes moves.
    fn has_moving_walls(&self) -> bool {
        self.physics.colliders.iter().any(|collider| collider.acts_on_nodes() && !is_still(collider))
    }

    /// Collective over neighbours. Finds where the material of each velocity field is near surfaces that it
    /// may touch in a step of these lengths: at the nodes `meets` where bodies meet, if there are any, and
    /// at walls.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan, on the rank that has it.
    pub(super) fn find_surfaces(&mut self, meets: &[u64], lengths: Lengths) -> Result<(), BinMissing> {
        self.grid.walls.known_over = None;
        if lengths.drift <= 0.0 {
            return Ok(());
        }
        let is_between = !meets.is_empty() && self.has_surfaces_between();
        let is_any = (0..self.grid.fields.len()).any(|field| self.asks_for_gaps(field));
        let acts = self.physics.colliders.iter().any(Collider::acts_on_nodes);
        let is_near = self.grid.walls.is_near && (is_any || acts);
        if !is_between && !is_near {
            return Ok(());
        }
        let mut nodes = match is_near {
            true => self.wall_nodes(),
            false => vec![0; self.grid.plan.blocks.len()],
        };
        self.grid.walls.known_over = is_near.then_some(lengths);
        let is_asked: Vec<bool> = (0..self.grid.fields.len())
            .map(|field| is_between || (is_near && self.asks_for_gaps(field)))
            .collect();
        if is_between {
            nodes
                .iter_mut()
                .zip(with_children(&self.grid.plan, meets))
                .for_each(|(nodes, meet)| *nodes |= meet);
        }
        self.find_volumes(&nodes, &is_asked, is_between)
    }

    /// Not collective. Nodes at surfaces that hold material back, and constrained ones that hand sums to
    /// them, block by block.
    fn wall_nodes(&mut self) -> Vec<u64> {
        let (physics, states) = (&self.physics, &self.contacts.states);
        let grid = &mut self.grid;
        let poses: Vec<_> = states.iter().map(|state| state.pose).collect();
        let (plan, colliders) = (&grid.plan, &physics.colliders);
        let still = grid.walls.still.get_or_insert_with(|| {
            let asked_of = |collider: &Collider<D>| Asked::of(physics, collider);
            StillWalls::find(plan, &physics.faces, colliders, &poses, asked_of, &mut grid.inside_still)
        });
        let known = still.nodes.clone();
        let moves = |collider: &Collider<D>| collider.acts_on_nodes() && !is_still(collider);
        grid.inside_moving.clear();
        if !colliders.iter().any(moves) {
            return known;
        }
        let mut nodes = vec![0; plan.blocks.len()];
        let all: Vec<_> = grid.all_fields().collect();
        let beside: Vec<_> = colliders.iter().zip(&poses).filter(|(collider, _)| moves(collider)).collect();
        let blocks = nodes.par_iter_mut().zip(&plan.blocks).enumerate().with_min_len(32);
        let moving = blocks.map(|(index, (nodes, block))| {
            if !all.iter().any(|fields| fields.active[index]) {
                return Vec::new();
            }
            let first = index * block_nodes(D);
            let has_mass = |bit: &u32| all.iter().any(|fields| fields.rows[first + *bit as usize].0[3] > 0.0);
            let real = bits(block.real_nodes()).filter(has_mass).fold(0, |mask, bit| mask | 1 << bit);
            let candidates =
                real | (block.constrained & nodes_in_domain(&plan.tree, block.level, block.coord));
            let inside = |(collider, pose): (&Collider<D>, _)| {
                let asked = Asked::of(physics, collider);
                // Constrained nodes have no velocity of their own.
                let candidates = if asked.planes { candidates } else { real };
                let find = || Inside::find(plan, block, candidates, (collider, pose), &beside, asked);
                let inside = moves(collider).then(find);
                *nodes |= inside.as_ref().map_or(0, |inside| inside.near & block.real_nodes());
                inside
            };
            colliders.iter().zip(&poses).map(inside).collect()
        });
        let moving = moving.collect();
        let mut all = with_children(plan, &nodes);
        all.iter_mut().zip(known).for_each(|(all, known)| *all |= known);
        grid.inside_moving = moving;
        all
    }

    /// Not collective. Whether own particles may be in reach of a surface in the next step.
    pub(in crate::solver) fn is_near_walls(&self) -> bool {
        let Some(still) = &self.grid.walls.still else { return true };
        let mut leaves = self.chunks.iter().zip(&still.leaves);
        self.has_moving_walls() || leaves.any(|(chunk, near)| *near && !chunk.is_empty())
    }

    /// Collective over neighbours. Holds the material of the velocity field numbered `field` to the
    /// conditions of colliders at feet, with those of nodes and faces. Adds impulse and angular impulse on
    /// each collider.
    pub(super) fn hold_at_feet(&mut self, field: usize, rates: &[Rate<D>], sums: &mut [[ExactSum; SUMS]]) {
        let Some(lengths) = self.grid.walls.known_over.filter(|_| self.has_feet(field)) else { return };
        let physics = &self.physics;
        let acts = |number: usize| physics.acts_at_feet(field, &physics.colliders[number]);
        let states = &self.contacts.states;
        let mut all =
            self.phases.time(Phase::Nodes, || self.grid.feet(field, &physics.colliders, states, acts));
        let Grid { plan, exchange, contact, .. } = &mut self.grid;
        contact.provide(plan);
        let bins = all.iter().map(|leaf| (leaf.bin, Window::FULL));
        contact.arenas.occupy(plan, &exchange.seam, bins);
        let covered = self.find_gaps(field, lengths, rates, &mut all);
        self.find_compliances_at_feet(field, &mut all, &covered);
        for _ in 0..SWEEPS {
            self.take_velocities(field);
            self.grid.contact.prolong(&self.grid.plan, &mut self.phases);
            let impulses = self.correct_at_feet(&mut all, &covered);
            self.scatter_at_feet(&all, |leaf, foot| impulses[leaf][foot]);
            self.add_impulses(field);
            self.hold_at_nodes(field, rates, sums);
            self.apply_faces(field, Lengths::NONE, true);
        }
        self.take_along(field, &all, &covered, rates, sums);
        let (colliders, states) = (&self.physics.colliders, &self.contacts.states);
        for leaf in &all {
            for (foot, contact) in leaf.feet.iter().zip(&leaf.touching) {
                let Some(contact) = contact else { continue };
                let impulse = contact.impulse.map(|j| -j);
                Touch { collider: foot.collider, position: foot.at, impulse }.book(colliders, states, sums);
            }
        }
    }
}
