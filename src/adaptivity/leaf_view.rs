//! View of one leaf for criteria: its particles, nodes and surroundings, after a step.
//!
//! Everything follows from the particles of the leaf, from nodes that its rank sums anyway and from which
//! leaves are empty, so the values do not depend on the partition.
use partition::Octant;

use super::leaf_maxima::LeafMaxima;
use super::surroundings::{MassRange, Surroundings};
use crate::boundary::{Collider, ColliderState};
use crate::geometry::Aabb;
use crate::grid::leaf_geometry::leaf_box;
use crate::grid::mask::{block_nodes, offset_count};
use crate::grid::plan::NO_BLOCK;
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::{Coordinates, Row, Scheme, Select, domain};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Tag};

/// Value of an indicator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// In the leaf.
    pub leaf: f64,
    /// In the leaf's parent, as far as it is known without the parent's other children. A leaf becomes
    /// coarser only if that would not make the parent finer again.
    pub parent: f64,
}

impl Value {
    /// The same value for the leaf and for its parent.
    pub(crate) const fn of_leaf(value: f64) -> Self {
        Self { leaf: value, parent: value }
    }

    /// 1 if true, else 0, for the leaf and for its parent.
    pub(crate) fn flag(holds: bool) -> Self {
        Self::of_leaf(f64::from(u8::from(holds)))
    }
}

/// The state of one rank after a step.
pub(crate) struct RankState<'a, const D: usize> {
    pub leaves: &'a [Octant<D>],
    pub chunks: &'a [Chunk<D>],
    pub maxima: &'a [LeafMaxima<D>],
    pub plan: &'a GridPlan<D>,
    pub fields: &'a NodeFields<D>,
    pub colliders: &'a [Collider<D>],
    pub collider_states: &'a [ColliderState<D>],
    pub surroundings: &'a Surroundings,
    /// Masses of the nodes of each block, if a criterion needs the exposure of leaves.
    pub masses: &'a [MassRange],
    /// Whether each leaf touches one without particles, if a criterion needs the exposure of leaves.
    pub beside_empty: &'a [bool],
    pub scheme: Scheme<'a>,
    /// First column of the head of the water about particles, if they carry it.
    pub head: Option<usize>,
    /// Edge of a root octant, m.
    pub root_edge: f64,
    /// Time, s.
    pub time: f64,
}

impl<'a, const D: usize> RankState<'a, D> {
    /// An own leaf.
    pub(crate) fn leaf(&'a self, number: usize) -> LeafView<'a, D> {
        LeafView { state: self, number }
    }
}

/// A leaf as criteria see it.
#[derive(Clone, Copy)]
pub(crate) struct LeafView<'a, const D: usize> {
    state: &'a RankState<'a, D>,
    number: usize,
}

/// The nodes of a leaf's own block.
pub(crate) struct LeafNodes<'a> {
    /// Velocity (m/s) and mass (kg) of each node.
    pub rows: &'a [Row],
    /// Which of them are real, a bit each.
    pub real: u64,
    /// Edge of a cell, m.
    pub cell: f64,
}

impl<'a, const D: usize> LeafView<'a, D> {
    /// Its particles.
    pub(crate) fn chunk(&self) -> &'a Chunk<D> {
        &self.state.chunks[self.number]
    }

    /// Extrema of its particles; only those that criteria need are recorded.
    pub(crate) fn maxima(&self) -> &'a LeafMaxima<D> {
        &self.state.maxima[self.number]
    }

    /// Greatest gradient of the head of the water about a particle, m/m; 0 where no heads have been found.
    pub(crate) fn head_gradient(&self) -> f64 {
        let (chunk, Some(first)) = (self.chunk(), self.state.head) else { return 0.0 };
        let square = |p: usize| (1..=D).map(|axis| chunk.carried(first + axis)[p].powi(2)).sum::<f64>();
        let is_known = !chunk.carried(first).is_empty();
        let squares = (0..chunk.len()).filter(|_| is_known).map(square);
        squares.fold(0.0, f64::max).sqrt()
    }

    /// The nodes of its own block, unless none of them has been summed.
    pub(crate) fn nodes(&self) -> Option<LeafNodes<'a>> {
        let RankState { plan, fields, .. } = self.state;
        let block = plan.bins[plan.leaf_start[self.number] as usize].around[offset_count(D) / 2];
        if block == NO_BLOCK || !fields.active[block as usize] {
            return None;
        }
        let number = block as usize;
        let block = &plan.blocks[number];
        let rows = &fields.rows[number * block_nodes(D)..][..block_nodes(D)];
        Some(LeafNodes { rows, real: block.real_nodes(), cell: plan.cell(block.level) })
    }

    /// A collider, and where it is.
    pub(crate) fn collider(&self, index: usize) -> (&'a Collider<D>, &'a ColliderState<D>) {
        (&self.state.colliders[index], &self.state.collider_states[index])
    }

    /// Time of the state, s.
    pub(crate) fn time(&self) -> f64 {
        self.state.time
    }

    /// Value for the leaf and for its parent of a function of the box of an octant (m).
    pub(crate) fn in_boxes(&self, value: impl Fn(&Aabb<D>) -> f64) -> Value {
        let of = |octant: &Octant<D>| {
            let (lower, upper) = leaf_box(octant, self.state.root_edge);
            value(&Aabb::new(lower, upper))
        };
        let here = &self.state.leaves[self.number];
        let leaf = of(here);
        Value { leaf, parent: here.parent().map_or(leaf, |parent| of(&parent)) }
    }

    /// Whether the leaf touches one without particles, or nodes around are free of material. Only where the
    /// criterion needs it.
    pub(crate) fn is_exposed(&self) -> bool {
        let RankState { plan, fields, surroundings, masses, beside_empty, .. } = self.state;
        beside_empty[self.number] || surroundings.is_exposed(self.number, plan, fields, masses)
    }

    /// Half widths of cubes of the volume of its undeformed particles, m: of rings, of squares of the area of
    /// their undeformed sections. The stretch along the hoop is known where material does not flow, and
    /// counts as 1 where it does.
    pub(crate) fn undeformed(&self) -> Vec<f64> {
        let (chunk, scheme) = (self.chunk(), &self.state.scheme);
        let halves = chunk.column(Layout::<D>::HALF);
        if scheme.coordinates == Coordinates::Cartesian {
            return halves.iter().copied().collect();
        }
        let hoops = chunk.column(Layout::<D>::LEFT_CAUCHY_GREEN + 2);
        let of = |p: usize| {
            let section = scheme.coordinates.half_width(halves[p], chunk.position(p)[0]);
            match scheme.materials[usize::from(Tag::unpack(chunk.tags()[p]).material)].is_plastic() {
                true => section,
                false => section * hoops[p].sqrt().sqrt(),
            }
        };
        (0..chunk.len()).map(of).collect()
    }

    /// Half widths of the boxes of its particles, m.
    pub(crate) fn half_widths(&self) -> Vec<[f64; D]> {
        let RankState { plan, scheme, leaves, .. } = self.state;
        let cell = plan.cell(leaves[self.number].level);
        let mut halves = Vec::new();
        domain::full_half_widths(self.chunk(), Select::All, cell, &plan.extent(), scheme, &mut halves);
        halves
    }
}
