//! Constrained nodes of an arena, those that first and second moments belong to.
//!
//! In most arenas beside a level jump a few layers of nodes are constrained. Their moments are kept one after
//! the other, and a stencil visits only those among its nodes that are constrained: elsewhere moments are zero.
use super::batch::Batch;
use super::simd::{F64x4, LANES, Lanes};
use super::weights::Weights;
use super::{ARENA_EDGE, Row, arena_nodes, stencil_bases};

/// Place of a node that is not constrained.
const NONE: u16 = u16::MAX;

/// Nodes of a stencil, `a + 3 b (+ 9 c)`, in the arena from its first node on; padded, so that no index is out of bounds.
const STENCIL: [u8; 32] = {
    let mut nodes = [0; 32];
    let mut node = 0;
    while node < 27 {
        nodes[node] = (node % 3 + ARENA_EDGE * (node / 3 % 3 + ARENA_EDGE * (node / 9))) as u8;
        node += 1;
    }
    nodes
};

/// Which nodes of an arena are constrained, and their second moments.
#[derive(Clone, Debug)]
pub struct ConstrainedNodes {
    /// Per base of a stencil (see [`super::stencil_bases`]) its constrained nodes: bit `a + 3 b (+ 9 c)`.
    stencils: Vec<u32>,
    /// Per arena node, its number among the constrained ones.
    place: Vec<u16>,
    /// Second moments S: `(S_x, S_y, S_z, unused)`, m².
    second: Vec<Row>,
}

impl ConstrainedNodes {
    /// The given nodes, no node twice, with their second moments. They are numbered in the order given.
    pub fn new<const D: usize>(nodes: impl IntoIterator<Item = (usize, Row)>) -> Self {
        let (mut place, mut second) = (vec![NONE; arena_nodes(D)], Vec::new());
        for (node, moments) in nodes {
            place[node] = second.len() as u16;
            second.push(moments);
        }
        let edge = stencil_bases(1);
        let stencil = |base: usize| {
            let lowest: usize =
                (0..D).map(|k| base / edge.pow(k as u32) % edge * ARENA_EDGE.pow(k as u32)).sum();
            let nodes = STENCIL.iter().take(3usize.pow(D as u32)).enumerate();
            let constrained = nodes.filter(|(_, node)| place[lowest + usize::from(**node)] != NONE);
            constrained.fold(0, |bits, (bit, _)| bits | 1 << bit)
        };
        Self { stencils: (0..stencil_bases(D)).map(stencil).collect(), place, second }
    }

    /// Number of constrained nodes.
    pub fn len(&self) -> usize {
        self.second.len()
    }

    /// True if no node is constrained.
    pub fn is_empty(&self) -> bool {
        self.second.is_empty()
    }

    /// Number of an arena node among the constrained ones.
    pub fn place(&self, node: usize) -> Option<usize> {
        (self.place[node] != NONE).then_some(usize::from(self.place[node]))
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        4 * self.stencils.capacity() + 2 * self.place.capacity() + size_of::<Row>() * self.second.capacity()
    }

    /// Whether the stencil of any member of a batch has constrained nodes; if so, the weights of all nodes are made ready.
    #[inline(always)]
    pub(super) fn prepare<const D: usize>(&self, weights: &mut Weights<D>, batch: &Batch) -> bool {
        let touched = batch.members().any(|lane| self.stencils[weights.base(lane)] != 0);
        if touched {
            weights.fill_nodes();
        }
        touched
    }

    /// Calls `f` with number and weight of each constrained node in the stencil of a lane of a batch that
    /// [`ConstrainedNodes::prepare`] has been called for.
    #[inline(always)]
    pub(super) fn for_each<const D: usize>(
        &self,
        weights: &Weights<D>,
        lane: usize,
        mut f: impl FnMut(usize, F64x4),
    ) {
        let mut left = self.stencils[weights.base(lane)];
        let places = &self.place[weights.first(lane)..];
        while left != 0 {
            let node = left.trailing_zeros() as usize;
            left &= left - 1;
            let place = places[usize::from(STENCIL[node])];
            f(usize::from(place), F64x4::splat(weights.nodes[node][lane]));
        }
    }

    /// Adds `Σ w S` of the members of a batch that [`ConstrainedNodes::prepare`] has been called for.
    #[inline(never)]
    pub(super) fn add_spread<const D: usize>(
        &self,
        weights: &Weights<D>,
        batch: &Batch,
        spread: &mut [Lanes; D],
    ) {
        let mut values: [[f64; LANES]; D] = spread.map(Lanes::to_array);
        for lane in batch.members() {
            let mut sum = F64x4::splat(0.0);
            self.for_each(weights, lane, |node, weight| {
                sum = weight.mul_add(F64x4::new(self.second[node].0), sum);
            });
            let sum = sum.to_array();
            for axis in 0..D {
                values[axis][lane] += sum[axis];
            }
        }
        *spread = values.map(Lanes::new);
    }
}
