//! Second moments D of the weights about their particles.
//!
//! `D_k = Σ_j w ((x_j - x_p)_k² + S_j,k)` is diagonal for axis-aligned boxes on any tree, but not constant: it
//! depends on where the box lies in its cells. S_j are the second moments that constrained nodes inherit from their
//! parents, `S_j = Σ c (S_i + (x_i - x_j)²)`, zero on real nodes.
use super::batch::{Batch, Batches};
use super::simd::{F64x4, LANES, Lanes};
use super::weights::Weights;
use super::{Frame, Row, Scheme, Select, SubBox, domain};
use crate::particle::chunk::{Chunk, Place};

/// Constrained nodes in an arena.
#[derive(Clone, Copy)]
pub struct Constraints<'a> {
    /// Whether a stencil touches a constrained node; index of [`super::stencil_bases`].
    pub touched: &'a [bool],
    /// Second moments S of the arena's nodes: `(S_x, S_y, S_z, unused)`, m².
    pub second: &'a [Row],
}

impl Constraints<'_> {
    /// Adds `Σ w S` of the members of a batch.
    #[inline(always)]
    pub(super) fn add_spread<const D: usize>(
        &self,
        weights: &Weights<D>,
        batch: &Batch,
        spread: &mut [Lanes; D],
    ) {
        if batch.members().any(|lane| self.touched[weights.base(lane)]) {
            self.add_some_spread(weights, batch, spread);
        }
    }

    #[inline(never)]
    fn add_some_spread<const D: usize>(&self, weights: &Weights<D>, batch: &Batch, spread: &mut [Lanes; D]) {
        let mut values = spread.map(Lanes::to_array);
        for lane in batch.members().filter(|&lane| self.touched[weights.base(lane)]) {
            let nodes = &self.second[weights.first(lane)..][..super::stencil_span(D)];
            let mut sum = F64x4::splat(0.0);
            weights.for_each_node(lane, |node, weight| {
                sum = weight.mul_add(F64x4::new(nodes[node].0), sum);
            });
            let sum = sum.to_array();
            for axis in 0..D {
                values[axis][lane] += sum[axis];
            }
        }
        *spread = values.map(Lanes::new);
    }
}

/// D of the selected particles, whose boxes are whole, in the order of the selection.
pub fn of_particles<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    constraints: Option<Constraints>,
    mut each: impl FnMut(usize, [f64; D]),
) {
    let (reals, stride) = chunk.reals();
    let (tags, cell) = (chunk.tags(), frame.cell);
    let mut weights = Weights::new();
    for batch in Batches::new(select, chunk, Place::default()) {
        let position = batch.positions(reals, stride);
        let half =
            domain::of_batch(reals, stride, tags, &batch, &position, cell, 0.5 * cell, &frame.extent, scheme);
        weights.fill(frame, &position, &position, &half);
        let spread = complete(&weights, &batch, constraints);
        for lane in batch.members() {
            each(batch.particle(lane), spread.map(|axis| axis[lane]));
        }
    }
}

/// D of parts of boxes about their particles; `each` gets the number of the part.
pub fn of_parts<const D: usize>(
    chunk: &Chunk<D>,
    parts: &[SubBox<D>],
    frame: &Frame<D>,
    constraints: Option<Constraints>,
    mut each: impl FnMut(usize, [f64; D]),
) {
    let (reals, stride) = chunk.reals();
    let mut weights = Weights::new();
    for (first, parts) in (0..).step_by(LANES).zip(parts.chunks(LANES)) {
        let batch = Batch::from_indices(parts, |part| part.particle);
        let position = batch.positions(reals, stride);
        let (centre, half) = SubBox::lanes(parts);
        weights.fill(frame, &position, &centre, &half);
        let spread = complete(&weights, &batch, constraints);
        for lane in batch.members() {
            each(first + lane, spread.map(|axis| axis[lane]));
        }
    }
}

fn complete<const D: usize>(
    weights: &Weights<D>,
    batch: &Batch,
    constraints: Option<Constraints>,
) -> [[f64; LANES]; D] {
    let mut spread = weights.spread;
    if let Some(constraints) = constraints {
        constraints.add_spread(weights, batch, &mut spread);
    }
    spread.map(Lanes::to_array)
}
