//! What refinement criteria look at, leaf by leaf, after a step.
//!
//! Everything follows from the particles of the leaf, from nodes that its rank sums anyway and from which leaves are
//! empty, so the values do not depend on the partition.
use partition::Octant;
use rayon::prelude::*;

use crate::adaptivity::{Criterion, Kind, Value};
use crate::boundary::ColliderState;
use crate::geometry::Aabb;
use crate::grid::leaf_geometry::leaf_box;
use crate::grid::mask::{bits, block_nodes, offset_count, product};
use crate::grid::plan::NO_BLOCK;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::{Select, domain};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::solver::physics::Physics;
use crate::solver::state::Solver;
use crate::solver::state::free_surface::{MassRange, Surroundings};
use crate::solver::state::leaf_maxima::LeafMaxima;

/// What the values follow from: the state of one rank after a step.
#[derive(Clone, Copy)]
struct State<'a, const D: usize> {
    leaves: &'a [Octant<D>],
    chunks: &'a [Chunk<D>],
    physics: &'a Physics<D>,
    colliders: &'a [ColliderState<D>],
    plan: &'a GridPlan<D>,
    fields: &'a NodeFields<D>,
    maxima: &'a [LeafMaxima<D>],
    surroundings: &'a Surroundings,
    masses: &'a [MassRange],
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
        match &criterion.kind {
            Kind::Region { .. } | Kind::Collider(_) => f64::INFINITY,
            Kind::FreeSurface => f64::from(u8::from(self.is_exposed(leaf))),
            Kind::VelocityGradient => self.velocity_gradient(leaf),
            Kind::PlasticStrain => self.maxima[leaf].plastic_strain,
            Kind::PlasticStrainRate => self.maxima[leaf].plastic_rate,
            // Only leaves that may have something to say get a close look.
            Kind::Stretch if self.maxima[leaf].stretch < criterion.coarsen => self.maxima[leaf].stretch,
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
        let real = block.real_nodes();
        let rows = &self.fields.rows[number * block_nodes(D)..][..block_nodes(D)];
        let per_cell = 1.0 / self.plan.cell(block.level);
        let mut sum_of_axes = 0.0;
        for axis in 0..D {
            let (mut squares, mut weights) = ([0.0; 4], 0.0);
            // Nodes that have the next one along the axis in the block.
            let pairs = product::<D>(std::array::from_fn(|a| if a == axis { 0b0111 } else { 0b1111 }));
            let step = 1 << (2 * axis);
            for bit in bits(real & real >> step & pairs) {
                let (here, there) = (&rows[bit as usize].0, &rows[bit as usize + step].0);
                let weight = here[3].min(there[3]);
                for i in 0..4 {
                    let change = there[i] - here[i];
                    squares[i] = f64::mul_add(weight * change, change, squares[i]);
                }
                weights += weight;
            }
            if weights > 0.0 {
                sum_of_axes += squares[..D].iter().sum::<f64>() / weights;
            }
        }
        sum_of_axes.sqrt() * per_cell
    }

    /// Whether the leaf touches one without particles, or nodes around are free of material.
    fn is_exposed(&self, leaf: usize) -> bool {
        self.beside_empty[leaf] || self.surroundings.is_exposed(leaf, self.plan, self.fields, self.masses)
    }

    fn greatest_stretch(&self, leaf: usize) -> f64 {
        let chunk = &self.chunks[leaf];
        let plan = self.plan;
        let cell = plan.cell(self.leaves[leaf].level);
        let mut halves = Vec::new();
        let scheme = self.physics.scheme();
        domain::full_half_widths(chunk, Select::All, cell, &plan.extent(), &scheme, &mut halves);
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
            maxima: &self.leaf_data.maxima,
            surroundings: &self.regrid_cache.surroundings,
            masses: &[],
            beside_empty: &[],
            time: self.clock.time,
        }
    }

    /// Collective. The value of each criterion (inner) in each own leaf (outer); all zero for leaves without particles.
    /// [`Solver::survey_now`], or a step after which this is due, comes before.
    pub(super) fn indicators(&mut self) -> Vec<Value> {
        let Some(adaptivity) = &self.physics.adaptivity else { return Vec::new() };
        let criteria = &adaptivity.criteria;
        let is_asked = criteria.iter().any(|criterion| matches!(criterion.kind, Kind::FreeSurface));
        let (mut beside_empty, mut masses) = (Vec::new(), Vec::new());
        let surroundings = &mut self.regrid_cache.surroundings;
        if is_asked {
            surroundings.update(&self.forest, &self.grid.plan);
            // A leaf cannot see it from its nodes where the empty one is coarser.
            beside_empty = surroundings.beside_empty(&self.forest, &self.comm, &self.chunks);
            masses = MassRange::of_blocks(&self.grid.plan, &self.grid.fields);
        }
        let (beside_empty, masses) = (&beside_empty[..], &masses[..]);
        let state = State { beside_empty, masses, ..self.state() };
        let mut values = vec![Value::default(); self.chunks.len() * criteria.len()];
        let leaves = values.par_chunks_mut(criteria.len().max(1)).enumerate().with_min_len(16);
        leaves.filter(|(leaf, _)| !state.chunks[*leaf].is_empty()).for_each(|(leaf, values)| {
            for (value, criterion) in values.iter_mut().zip(criteria) {
                *value = state.value(criterion, leaf);
            }
        });
        values
    }
}
