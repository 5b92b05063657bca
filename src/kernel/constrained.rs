//! Constrained nodes of an arena: hanging ones, and those that first and second moments belong to.
//!
//! Moments are for nodes whose parents are constrained themselves, beside jumps over more than one level. Most of their
//! columns are zero (see `grid/constraints/columns.rs`). Those that are not are kept one after the other, and a stencil visits those of its
//! own nodes.
use std::sync::LazyLock;

use super::batch::{Batch, lanes_in};
use super::hanging::HangingNodes;
use super::weights::{NodeWeights, Weights};
use super::{ARENA_EDGE, stencil_bases};
use crate::simd::LANES;

/// Nodes of a stencil in 3D.
const STENCIL: usize = 27;

/// A column of first moments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Its node in the arena.
    pub node: usize,
    /// Its axis.
    pub axis: usize,
    /// The node's second moment S along this axis, m².
    pub second: f64,
}

/// A column as a stencil finds it.
#[derive(Clone, Copy, Debug)]
struct Visit {
    /// Number of the column.
    column: u16,
    /// Node of the stencil, `a + 3 b (+ 9 c)`, or [`NO_NODE`].
    node: u16,
}

/// In the place of a node: one of the weights behind those of the stencil, which are zero.
const NO_NODE: u16 = STENCIL.next_power_of_two() as u16 - 1;

/// The constrained nodes of an arena: which are hanging, and which columns of moments the others have, with their second
/// moments.
#[derive(Clone, Debug)]
pub struct ConstrainedNodes {
    /// Those without columns.
    pub hanging: HangingNodes,
    /// What stencils visit, by base of the stencil (see [`super::stencil_bases`]), in rounds: one column along each axis, so
    /// that one loop does for all axes. An axis that has fewer columns than another visits some other with [`NO_NODE`].
    visits: Vec<Visit>,
    /// Start of each of these lists, and the end.
    start: Vec<u16>,
    /// Second moments, by column.
    second: Vec<f64>,
}

impl ConstrainedNodes {
    /// The given columns, none twice, and hanging nodes. Columns are numbered in the order given, in which stencils visit
    /// them.
    pub fn new<const D: usize>(columns: impl IntoIterator<Item = Column>, hanging: HangingNodes) -> Self {
        let columns: Vec<Column> = columns.into_iter().collect();
        let seen = Seen::of::<D>();
        let mut counts = vec![[0; D]; stencil_bases(D)];
        for column in &columns {
            for &(base, _) in seen.from(column.node) {
                counts[usize::from(base)][column.axis] += 1;
            }
        }
        let mut start = vec![0];
        for count in &counts {
            let rounds = count.iter().max().map_or(0, |&most: &u16| most);
            start.push(start[start.len() - 1] + D as u16 * rounds);
        }
        let mut visits = vec![Visit { column: 0, node: NO_NODE }; usize::from(start[counts.len()])];
        let mut next = vec![[0; D]; counts.len()];
        for (number, column) in (0..).zip(&columns) {
            for &(base, node) in seen.from(column.node) {
                let base = usize::from(base);
                let round = &mut next[base][column.axis];
                let place = usize::from(start[base]) + D * *round + column.axis;
                visits[place] = Visit { column: number, node: u16::from(node) };
                *round += 1;
            }
        }
        // Stores to one and the same column would wait for each other from round to round.
        for round in visits.chunks_exact_mut(D) {
            let column = round.iter().find(|visit| visit.node != NO_NODE).map_or(0, |visit| visit.column);
            round.iter_mut().filter(|visit| visit.node == NO_NODE).for_each(|visit| visit.column = column);
        }
        Self { hanging, visits, start, second: columns.iter().map(|column| column.second).collect() }
    }

    /// Second moments, by column, m².
    pub fn second(&self) -> &[f64] {
        &self.second
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.second.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.second.is_empty()
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        let lists = size_of::<Visit>() * self.visits.capacity() + 2 * self.start.capacity();
        self.hanging.heap_bytes() + lists + 8 * self.second.capacity()
    }

    /// Members of a batch whose stencils have columns, a bit each; if there are any, the weights of all nodes are made
    /// ready in `nodes`.
    #[inline(always)]
    pub(super) fn prepare<const D: usize>(
        &self,
        weights: &Weights<D>,
        nodes: &mut NodeWeights,
        batch: &Batch,
    ) -> u32 {
        if self.is_empty() {
            return 0;
        }
        let has_any = |lane: usize| {
            let base = weights.base(lane);
            self.start[base] != self.start[base + 1]
        };
        let touched = (0..LANES).fold(0, |lanes, lane| lanes | u32::from(has_any(lane)) << lane);
        let touched = batch.members_among(touched);
        if touched != 0 {
            nodes.fill(weights);
        }
        touched
    }

    /// Calls `f` with number, axis and weight of each column in the stencil of a lane of a batch that
    /// [`ConstrainedNodes::prepare`] has been called for, and of some others with weight 0.
    #[inline(always)]
    pub(super) fn for_each<const D: usize>(
        &self,
        weights: &Weights<D>,
        nodes: &NodeWeights,
        lane: usize,
        mut f: impl FnMut(usize, usize, f64),
    ) {
        let base = weights.base(lane);
        let list = &self.visits[usize::from(self.start[base])..usize::from(self.start[base + 1])];
        let (rounds, _) = list.as_chunks::<D>();
        for round in rounds {
            for axis in 0..D {
                f(usize::from(round[axis].column), axis, round[axis].weight(nodes, lane));
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
            self.for_each(weights, nodes, lane, |column, axis, weight| {
                sums[axis] = weight.mul_add(self.second[column], sums[axis]);
            });
            for axis in 0..D {
                spread[axis][lane] += sums[axis];
            }
        }
    }
}

/// Which stencils have each node of an arena.
struct Seen {
    /// Base of the stencil and the node's number in it, node by node.
    from: Vec<(u8, u8)>,
    /// First of each node, and the end.
    start: Vec<u16>,
}

static SEEN_IN_2D: LazyLock<Seen> = LazyLock::new(Seen::new::<2>);
static SEEN_IN_3D: LazyLock<Seen> = LazyLock::new(Seen::new::<3>);

impl Seen {
    fn of<const D: usize>() -> &'static Self {
        if D == 2 { &SEEN_IN_2D } else { &SEEN_IN_3D }
    }

    fn new<const D: usize>() -> Self {
        let mut seen = Self { from: Vec::new(), start: vec![0] };
        for node in 0..ARENA_EDGE.pow(D as u32) {
            let at: [usize; D] = std::array::from_fn(|k| node / ARENA_EDGE.pow(k as u32) % ARENA_EDGE);
            for number in 0..3usize.pow(D as u32) {
                let base = (0..D).try_fold(0, |base, k| {
                    let first = at[k].checked_sub(number / 3usize.pow(k as u32) % 3)?;
                    (first < stencil_bases(1)).then(|| base + first * stencil_bases(k))
                });
                seen.from.extend(base.map(|base| (base as u8, number as u8)));
            }
            seen.start.push(seen.from.len() as u16);
        }
        seen
    }

    /// Base of each stencil that has a node, and the number of the node in it.
    fn from(&self, node: usize) -> &[(u8, u8)] {
        &self.from[usize::from(self.start[node])..usize::from(self.start[node + 1])]
    }
}

impl Visit {
    /// Weight of the node for the box of a lane.
    #[inline(always)]
    fn weight(self, nodes: &NodeWeights, lane: usize) -> f64 {
        nodes.0[usize::from(self.node) % STENCIL.next_power_of_two()][lane]
    }
}
