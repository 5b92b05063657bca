//! Constrained nodes of an arena, those that first and second moments belong to.
//!
//! In most arenas beside a level jump a few layers of nodes are constrained, and of their moments most columns are zero
//! (see `grid/columns.rs`). Those that are not are kept one after the other, and a stencil visits those of its own nodes.
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
        let mut start = vec![0; lists + 1];
        each_visit::<D>(&columns, |list, _| start[list + 1] += 1);
        (0..lists).for_each(|list| start[list + 1] += start[list]);
        let mut visits = vec![Visit::default(); usize::from(start[lists])];
        let mut next = start.clone();
        each_visit::<D>(&columns, |list, visit| {
            visits[usize::from(next[list])] = visit;
            next[list] += 1;
        });
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

/// Calls `f` with the list and the visit of each column in each stencil.
fn each_visit<const D: usize>(columns: &[Column], mut f: impl FnMut(usize, Visit)) {
    for (column, &Column { node, axis, .. }) in (0..).zip(columns) {
        let at: [usize; D] = std::array::from_fn(|k| node / ARENA_EDGE.pow(k as u32) % ARENA_EDGE);
        for visit in 0..3usize.pow(D as u32) {
            // The stencil has the node at `visit` if its base is a valid one.
            let base = (0..D).try_fold(0, |base, k| {
                let first = at[k].checked_sub(visit / 3usize.pow(k as u32) % 3)?;
                (first < stencil_bases(1)).then(|| base + first * stencil_bases(k))
            });
            if let Some(base) = base {
                f(D * base + axis, Visit { node: visit as u8, axis: axis as u8, column });
            }
        }
    }
}

impl Visit {
    /// Weight of the node for the box of a lane.
    #[inline(always)]
    fn weight<const D: usize>(self, weights: &Weights<D>, lane: usize) -> f64 {
        weights.nodes[usize::from(self.node) % STENCIL.next_power_of_two()][lane]
    }
}
