//! What refinement criteria look at, leaf by leaf, after a step.
//!
//! Everything follows from the particles of the leaf, from nodes that its rank sums anyway and from which leaves are
//! empty, so the values do not depend on the partition.
use partition::{Octant, Region};
use rayon::prelude::*;

use super::migrate::leaf_box;
use super::transfer::extent;
use super::{Physics, Solver};
use crate::adaptivity::{Criterion, Kind, Value};
use crate::boundary::ColliderState;
use crate::geometry::Aabb;
use crate::grid::known::Cover;
use crate::grid::mask::{arena_overlap, bits, block_nodes, node_of_bit, offset, offset_count};
use crate::grid::plan::NO_BLOCK;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::{Select, domain};
use crate::particle::chunk::{Chunk, Layout, Tag};

/// Share of the greatest node mass nearby below which a node counts as free of material. A full node in a
/// corner of three walls has an eighth.
const NEXT_TO_NOTHING: f64 = 0.1;

/// What the values follow from: the state of one rank after a step.
#[derive(Clone, Copy)]
struct State<'a, const D: usize> {
    leaves: &'a [Octant<D>],
    chunks: &'a [Chunk<D>],
    physics: &'a Physics<D>,
    colliders: &'a [ColliderState<D>],
    plan: &'a GridPlan<D>,
    fields: &'a NodeFields<D>,
    plastic_rate: &'a [f64],
    beside_empty: &'a [bool],
    time: f64,
}

impl<const D: usize> State<'_, D> {
    fn value(&self, criterion: &Criterion<D>, leaf: usize) -> Value {
        let of = |octant: &Octant<D>| self.distance(criterion, octant);
        let here = &self.leaves[leaf];
        match of(here) {
            Some(distance) => {
                let parent = here.parent().and_then(|parent| of(&parent)).unwrap_or(distance);
                Value { leaf: distance, parent }
            }
            None => {
                let value = self.indicator(criterion, leaf);
                Value { leaf: value, parent: value }
            }
        }
    }

    /// Distance of an octant's box, if that is what the criterion looks at, m.
    fn distance(&self, criterion: &Criterion<D>, octant: &Octant<D>) -> Option<f64> {
        let (lower, upper) = leaf_box(octant, self.physics.root_edge);
        let octant_box = Aabb::new(lower, upper);
        match &criterion.kind {
            Kind::Region { shape, motion } => {
                let (way, _) = motion.place(self.time);
                let centre = octant_box.centre();
                let centre = std::array::from_fn(|axis| centre[axis] - way[axis]);
                Some(shape.distance(&centre) - octant_box.half_diagonal())
            }
            Kind::Collider(index) => {
                let (collider, state) = (&self.physics.colliders[*index], &self.colliders[*index]);
                Some(collider.distance_to_box(&octant_box, &state.pose))
            }
            _ => None,
        }
    }

    /// The value of a criterion that looks at the content of the leaf.
    fn indicator(&self, criterion: &Criterion<D>, leaf: usize) -> f64 {
        let chunk = &self.chunks[leaf];
        let greatest = |column: usize| chunk.column(column).iter().copied().fold(0.0, f64::max);
        match &criterion.kind {
            Kind::Region { .. } | Kind::Collider(_) => f64::INFINITY,
            Kind::FreeSurface => f64::from(u8::from(self.is_exposed(leaf))),
            Kind::VelocityGradient => self.velocity_gradient(leaf),
            Kind::PlasticStrain => greatest(Layout::<D>::HISTORY),
            Kind::PlasticStrainRate => self.plastic_rate.get(leaf).copied().unwrap_or(0.0),
            Kind::Stretch => self.greatest_stretch(leaf),
            Kind::Material(material) => {
                let found = chunk.tags().iter().any(|&tag| Tag::unpack(tag).material == *material);
                f64::from(u8::from(found))
            }
        }
    }

    /// Number of the leaf's own block of nodes.
    fn own_block(&self, leaf: usize) -> Option<usize> {
        let plan = self.plan;
        let block = plan.bins[plan.leaf_start[leaf] as usize].around[offset_count(D) / 2];
        (block != NO_BLOCK && self.fields.active[block as usize]).then_some(block as usize)
    }

    /// Root mean square of the norm of the velocity gradient over the leaf's real nodes, weighted with mass, 1/s.
    fn velocity_gradient(&self, leaf: usize) -> f64 {
        let Some(number) = self.own_block(leaf) else { return 0.0 };
        let block = &self.plan.blocks[number];
        let real = block.value & !block.constrained;
        let rows = &self.fields.rows[number * block_nodes(D)..][..block_nodes(D)];
        let per_cell = 1.0 / self.plan.cell(block.level);
        let mut sum_of_axes = 0.0;
        for axis in 0..D {
            let (mut squares, mut weights) = (0.0, 0.0);
            for bit in bits(real).filter(|&bit| node_of_bit::<D>(bit)[axis] < 3) {
                let next = bit + (1 << (2 * axis));
                let (here, there) = (&rows[bit as usize].0, &rows[next as usize].0);
                let weight = here[3].min(there[3]);
                if real >> next & 1 == 1 && weight > 0.0 {
                    let slopes = (0..D).map(|i| (there[i] - here[i]) * per_cell);
                    squares += weight * slopes.fold(0.0, |sum: f64, slope| slope.mul_add(slope, sum));
                    weights += weight;
                }
            }
            if weights > 0.0 {
                sum_of_axes += squares / weights;
            }
        }
        sum_of_axes.sqrt()
    }

    /// Whether the leaf touches one without particles, or any real node in the arena of its own bin is free of
    /// material. Only nodes on the leaf and on leaves of its level count: the lattice goes on over finer leaves, but
    /// what is there has its mass on finer nodes.
    fn is_exposed(&self, leaf: usize) -> bool {
        if self.beside_empty.get(leaf) == Some(&true) {
            return true;
        }
        let plan = self.plan;
        let around = &plan.bins[plan.leaf_start[leaf] as usize].around;
        let (mut least, mut greatest) = (f64::INFINITY, 0.0);
        for (index, &number) in around.iter().enumerate().take(offset_count(D)) {
            if number == NO_BLOCK {
                continue;
            }
            let block = &plan.blocks[number as usize];
            let is_of_level = match plan.tree.cover(block.level, block.coord) {
                Cover::Leaf(other) => plan.tree.leaves()[other].level == block.level,
                Cover::Outside | Cover::Finer(_) | Cover::Unknown => false,
            };
            let beside = offset::<D>(index);
            let on_leaf = |bit: u32| {
                let node = node_of_bit::<D>(bit);
                (0..D).all(|a| beside[a] == 0 || beside[a] > 0 && node[a] == 0)
            };
            let nodes = block.value & !block.constrained & arena_overlap::<D>(beside);
            let rows = &self.fields.rows[number as usize * block_nodes(D)..][..block_nodes(D)];
            for bit in bits(nodes).filter(|&bit| is_of_level || on_leaf(bit)) {
                let mass = rows[bit as usize].0[3];
                least = f64::min(least, mass);
                greatest = f64::max(greatest, mass);
            }
        }
        least < NEXT_TO_NOTHING * greatest
    }

    fn greatest_stretch(&self, leaf: usize) -> f64 {
        let chunk = &self.chunks[leaf];
        let plan = self.plan;
        let cell = plan.cell(self.leaves[leaf].level);
        let mut halves = Vec::new();
        let scheme = self.physics.scheme();
        domain::full_half_widths(chunk, Select::All, cell, &extent(plan), &scheme, &mut halves);
        let undeformed = chunk.column(Layout::<D>::HALF);
        let stretches = halves.iter().zip(undeformed).flat_map(|(half, own)| half.map(|half| half / own));
        stretches.fold(0.0, f64::max)
    }
}

impl<const D: usize> Solver<D> {
    fn state(&self) -> State<'_, D> {
        State {
            leaves: self.forest.leaves(),
            chunks: &self.chunks,
            physics: &self.physics,
            colliders: &self.contacts.states,
            plan: &self.grid.plan,
            fields: &self.grid.fields,
            plastic_rate: &self.plastic_rate,
            beside_empty: &[],
            time: self.clock.time,
        }
    }

    /// Collective. Whether each own leaf touches one without particles; nothing where no criterion asks for that. A
    /// leaf cannot see it from its nodes where the other one is coarser.
    fn beside_empty(&self, criteria: &[Criterion<D>]) -> Vec<bool> {
        if !criteria.iter().any(|criterion| matches!(criterion.kind, Kind::FreeSurface)) {
            return Vec::new();
        }
        let leaves = self.forest.leaves();
        let empty = leaves.iter().zip(&self.chunks).filter(|(_, chunk)| chunk.is_empty());
        let around: Vec<(Region<D>, u32)> =
            empty.map(|(leaf, _)| (Region { lo: leaf.lower(), hi: leaf.upper() }, 0)).collect();
        let mut beside = vec![false; leaves.len()];
        for (region, _) in self.forest.to_owners(&self.comm, &around) {
            self.forest.own_leaves_in(&region, &mut |leaf| beside[leaf] = true);
        }
        beside
    }

    /// Collective. The value of each criterion (inner) in each own leaf (outer); empty for leaves without particles.
    pub(super) fn indicators(&self, criteria: &[Criterion<D>]) -> Vec<Vec<Value>> {
        let beside_empty = self.beside_empty(criteria);
        let state = State { beside_empty: &beside_empty, ..self.state() };
        let leaves = (0..self.chunks.len()).into_par_iter().with_min_len(16);
        leaves
            .map(|leaf| match state.chunks[leaf].is_empty() {
                true => Vec::new(),
                false => criteria.iter().map(|criterion| state.value(criterion, leaf)).collect(),
            })
            .collect()
    }

    /// Least and greatest velocity along each axis of an own leaf's particles, 0 among them, m/s. Nodes would not do:
    /// those with next to no mass may be very fast.
    pub(super) fn velocity_range(&self, leaf: usize) -> [[f64; D]; 2] {
        let velocity = |axis: usize| self.chunks[leaf].column(Layout::<D>::VELOCITY + axis).iter().copied();
        let least = std::array::from_fn(|axis| velocity(axis).fold(0.0, f64::min));
        [least, std::array::from_fn(|axis| velocity(axis).fold(0.0, f64::max))]
    }

    /// Not collective. Sum of the plastic strain of each leaf's particles, where a criterion will need its rate.
    pub(super) fn plastic_strain_sums(&self) -> Option<Vec<f64>> {
        let adaptivity = self.physics.adaptivity.as_ref()?;
        let wanted = adaptivity.criteria.iter().any(|c| matches!(c.kind, Kind::PlasticStrainRate));
        // In every step, as files show the rate whenever they are written.
        wanted.then(|| {
            let sum = |chunk: &Chunk<D>| chunk.column(Layout::<D>::HISTORY).iter().sum();
            self.chunks.par_iter().map(sum).collect()
        })
    }

    /// Not collective. Mean rate of the plastic strain in each leaf over the step `dt` (s), from the sums before it.
    pub(super) fn note_plastic_rate(&mut self, before: Option<Vec<f64>>, dt: f64) {
        let after = self.plastic_strain_sums();
        let Some((before, after)) = before.zip(after) else { return };
        let each = self.chunks.iter().zip(before.iter().zip(&after));
        self.plastic_rate = each
            .map(|(chunk, (before, after))| (after - before) / (dt * chunk.len().max(1) as f64))
            .collect();
    }
}
