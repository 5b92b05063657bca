//! Constrained nodes of an arena, those that first and second moments belong to.
//!
//! In most arenas beside a level jump a few layers of nodes are constrained, and of their moments most columns are zero
//! (see `grid/columns.rs`). Those that are not are kept one after the other, and a stencil visits those of its own nodes.
use std::sync::LazyLock;

use super::batch::{Batch, lanes_in};
use super::simd::{LANES, Lanes};
use super::weights::Weights;
use super::{ARENA_EDGE, stencil_bases};

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
#[derive(Clone, Copy, Debug, Default)]
struct Visit {
    /// Node of the stencil, `a + 3 b (+ 9 c)`.
    node: u8,
    axis: u8,
    /// Number of the column.
    column: u16,
}

/// Which columns of moments the nodes of an arena have, and their second moments.
#[derive(Clone, Debug)]
pub struct ConstrainedNodes {
    /// What stencils visit, by base of the stencil (see [`super::stencil_bases`]) and axis.
    visits: Vec<Visit>,
    /// Start of each of these lists, and the end.
    start: Vec<u16>,
    /// Second moments, by column.
    second: Vec<f64>,
}

impl ConstrainedNodes {
    /// The given columns, none twice. They are numbered in the order given, in which stencils visit them.
    pub fn new<const D: usize>(columns: impl IntoIterator<Item = Column>) -> Self {
        let columns: Vec<Column> = columns.into_iter().collect();
        let lists = D * stencil_bases(D);
        let seen = Seen::of::<D>();
        let mut start = vec![0; lists + 1];
        for column in &columns {
            for &(base, _) in seen.from(column.node) {
                start[D * usize::from(base) + column.axis + 1] += 1;
            }
        }
        (0..lists).for_each(|list| start[list + 1] += start[list]);
        let mut visits = vec![Visit::default(); usize::from(start[lists])];
        let mut next = start.clone();
        for (number, column) in (0..).zip(&columns) {
            for &(base, node) in seen.from(column.node) {
                let place = &mut next[D * usize::from(base) + column.axis];
                visits[usize::from(*place)] = Visit { node, axis: column.axis as u8, column: number };
                *place += 1;
            }
        }
        Self { visits, start, second: columns.iter().map(|column| column.second).collect() }
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
        size_of::<Visit>() * self.visits.capacity() + 2 * self.start.capacity() + 8 * self.second.capacity()
    }

    /// Members of a batch whose stencils have columns, a bit each; if there are any, the weights of all nodes are made ready.
    #[inline(always)]
    pub(super) fn prepare<const D: usize>(&self, weights: &mut Weights<D>, batch: &Batch) -> u32 {
        let has_any = |lane: usize| {
            let base = weights.base(lane);
            self.start[D * base] != self.start[D * base + D]
        };
        let touched = (0..LANES).fold(0, |lanes, lane| lanes | u32::from(has_any(lane)) << lane);
        let touched = batch.members_among(touched);
        if touched != 0 {
            weights.fill_nodes();
        }
        touched
    }

    /// What the stencil of a lane visits along the axes `first` to `last`.
    #[inline(always)]
    fn visits<const D: usize>(
        &self,
        weights: &Weights<D>,
        lane: usize,
        first: usize,
        last: usize,
    ) -> &[Visit] {
        let list = D * weights.base(lane);
        &self.visits[usize::from(self.start[list + first])..usize::from(self.start[list + last + 1])]
    }

    /// Calls `f` with number and axis of each column in the stencil of a lane of a batch that
    /// [`ConstrainedNodes::prepare`] has been called for, and the weight of its node.
    #[inline(always)]
    pub(super) fn for_each<const D: usize>(
        &self,
        weights: &Weights<D>,
        lane: usize,
        mut f: impl FnMut(usize, usize, f64),
    ) {
        for visit in self.visits(weights, lane, 0, D - 1) {
            f(usize::from(visit.column), usize::from(visit.axis), visit.weight(weights, lane));
        }
    }

    /// [`ConstrainedNodes::for_each`] of the columns along one axis.
    #[inline(always)]
    pub(super) fn for_each_along<const D: usize>(
        &self,
        weights: &Weights<D>,
        lane: usize,
        axis: usize,
        mut f: impl FnMut(usize, f64),
    ) {
        for visit in self.visits(weights, lane, axis, axis) {
            f(usize::from(visit.column), visit.weight(weights, lane));
        }
    }

    /// Adds `Σ w S` of the lanes that [`ConstrainedNodes::prepare`] gave.
    #[inline(never)]
    pub(super) fn add_spread<const D: usize>(
        &self,
        weights: &Weights<D>,
        touched: u32,
        spread: &mut [Lanes; D],
    ) {
        let mut values: [[f64; LANES]; D] = spread.map(Lanes::to_array);
        for lane in lanes_in(touched) {
            for axis in 0..D {
                let mut sum = 0.0;
                self.for_each_along(weights, lane, axis, |column, weight| {
                    sum = weight.mul_add(self.second[column], sum);
                });
                values[axis][lane] += sum;
            }
        }
        *spread = values.map(Lanes::new);
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
    fn weight<const D: usize>(self, weights: &Weights<D>, lane: usize) -> f64 {
        weights.nodes[usize::from(self.node) % STENCIL.next_power_of_two()][lane]
    }
}
