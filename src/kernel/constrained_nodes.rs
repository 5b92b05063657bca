//! Constrained nodes of an arena: hanging ones, and those with first and second moments.
//!
//! Moments are for nodes whose parents are constrained themselves, beside jumps over more than one level.
//! First moments are matrices, kept as one row for each axis, node by node; a stencil visits those of its own
//! nodes.
use super::batch::{Batch, lanes_in};
use super::hanging::HangingNodes;
use super::weights::{NodeWeights, Weights};
use super::{ARENA_EDGE, stencil_bases};
use crate::csr::Csr;
use crate::simd::LANES;

/// Nodes of a stencil in 3D, as a power of two.
const STENCIL: usize = 32;

/// A node with moments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentNode<const D: usize> {
    /// Its place in the arena.
    pub node: usize,
    /// Its second moments S along each axis, m².
    pub second: [f64; D],
}

/// A node with moments as a stencil finds it.
#[derive(Clone, Copy, Debug)]
struct Visit {
    /// First row of its moments.
    first: u16,
    /// Node of the stencil, `a + 3 b (+ 9 c)`.
    node: u16,
}

/// The constrained nodes of an arena: which are hanging, and which have moments, with their second moments.
#[derive(Clone, Debug)]
pub struct ConstrainedNodes {
    /// Those without moments.
    pub hanging: HangingNodes,
    /// Nodes with moments of each stencil, by its base (see [`super::stencil_bases`]).
    visits: Csr<Visit>,
    /// Second moments, by row of the first moments.
    second: Vec<f64>,
}

impl ConstrainedNodes {
    /// Nodes with moments, none twice, and hanging nodes. Stencils visit nodes in the order given, in which
    /// their rows of moments follow each other.
    pub fn new<const D: usize>(nodes: &[MomentNode<D>], hanging: HangingNodes) -> Self {
        let visits = nodes.iter().zip((0..).step_by(D)).flat_map(|(node, first)| {
            stencils_with::<D>(node.node).map(move |(base, node)| (base, Visit { first, node }))
        });
        let bases = if nodes.is_empty() { 0 } else { stencil_bases(D) };
        let second = nodes.iter().flat_map(|node| node.second).collect();
        Self { hanging, visits: Csr::new(bases, visits), second }
    }

    /// Number of rows of first moments.
    pub fn moments(&self) -> usize {
        self.second.len()
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.hanging.heap_bytes() + self.visits.heap_bytes() + 8 * self.second.capacity()
    }

    /// Members of a batch whose stencils have nodes with moments, a bit each; if there are any, `nodes` gets
    /// the weights of all nodes.
    #[inline(always)]
    pub(super) fn prepare<const D: usize>(
        &self,
        weights: &Weights<D>,
        nodes: &mut NodeWeights,
        batch: &Batch,
    ) -> u32 {
        if self.second.is_empty() {
            return 0;
        }
        let has_any = |lane: usize| !self.visits.of(weights.base(lane)).is_empty();
        let touched = (0..LANES).fold(0, |lanes, lane| lanes | u32::from(has_any(lane)) << lane);
        let touched = batch.members_among(touched);
        if touched != 0 {
            nodes.fill(weights);
        }
        touched
    }

    /// Calls `f` with row, axis and weight of each row of moments in the stencil of a lane of a batch, after
    /// [`ConstrainedNodes::prepare`] for it.
    #[inline(always)]
    pub(super) fn for_each<const D: usize>(
        &self,
        weights: &Weights<D>,
        nodes: &NodeWeights,
        lane: usize,
        mut f: impl FnMut(usize, usize, f64),
    ) {
        for visit in self.visits.of(weights.base(lane)) {
            let weight = nodes.0[usize::from(visit.node) % STENCIL][lane];
            for axis in 0..D {
                f(usize::from(visit.first) + axis, axis, weight);
            }
        }
    }

    /// Adds `Σ w S` of the lanes that [`ConstrainedNodes::prepare`] gave.
    #[inline(never)]
    pub(super) fn add_spread<const D: usize>(
        &self,
        weights: &Weights<D>,
        nodes: &NodeWeights,
        touched: u32,
        spread: &mut [[f64; LANES]; D],
    ) {
        for lane in lanes_in(touched) {
            let mut sums = [0.0; D];
            self.for_each(weights, nodes, lane, |row, axis, weight| {
                sums[axis] = weight.mul_add(self.second[row], sums[axis]);
            });
            for axis in 0..D {
                spread[axis][lane] += sums[axis];
            }
        }
    }
}

/// Base of each stencil that has a node of the arena, and the number of the node in it.
fn stencils_with<const D: usize>(node: usize) -> impl Iterator<Item = (u32, u16)> + Clone {
    let at: [usize; D] = std::array::from_fn(|k| node / ARENA_EDGE.pow(k as u32) % ARENA_EDGE);
    (0..3usize.pow(D as u32)).filter_map(move |number| {
        let base = (0..D).try_fold(0, |base, k| {
            let first = at[k].checked_sub(number / 3usize.pow(k as u32) % 3)?;
            (first < stencil_bases(1)).then(|| base + first * stencil_bases(k))
        });
        Some((base? as u32, number as u16))
    })
}
