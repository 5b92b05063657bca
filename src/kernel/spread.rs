//! Second moments D of the weights about their particles.
//!
//! `D_k = Σ_j w ((x_j - x_p)_k² + S_j,k)` is diagonal for axis-aligned boxes on any tree, but not constant:
//! it depends on where the box lies in its cells. S_j are the second moments that constrained nodes inherit
//! from their parents, `S_j = Σ c (S_i + (x_i - x_j)²)`, zero on real nodes.
use super::batch::{Batch, Batches, Tile};
use super::constrained_nodes::ConstrainedNodes;
use super::weights::{NodeWeights, Weights};
use super::{Coordinates, Frame, Scheme, Select, SubBox, domain};
use crate::particle::chunk::{Chunk, Layout, Place};
use crate::simd::{LANES, Lanes};

/// D of the selected particles, whose boxes are whole, in the order of the selection.
pub fn of_particles<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    constraints: Option<&ConstrainedNodes>,
    mut each: impl FnMut(usize, [f64; D]),
) {
    let (tags, cell) = (chunk.tags(), frame.cell);
    let (mut weights, mut spare) = (Weights::new(), Tile::new());
    for batch in Batches::new(select, chunk, Place::default()) {
        let tile = batch.tile::<D>(chunk.tiles(), 0..Layout::<D>::REALS, &mut spare);
        let position: [Lanes; D] = batch.positions(tile);
        let half = domain::of_batch(tile, tags, &batch, &position, cell, 0.5 * cell, &frame.extent, scheme);
        weights.fill_whole(scheme, frame, &position, &half);
        let spread = complete(&mut weights, &batch, frame.cell, constraints);
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
    coordinates: Coordinates,
    constraints: Option<&ConstrainedNodes>,
    mut each: impl FnMut(usize, [f64; D]),
) {
    let (mut weights, mut spare) = (Weights::new(), Tile::new());
    for (first, parts) in (0..).step_by(LANES).zip(parts.chunks(LANES)) {
        let batch = Batch::from_indices(parts, |part| part.particle);
        let position: [Lanes; D] = batch.positions(batch.tile::<D>(
            chunk.tiles(),
            Layout::<D>::POSITION..Layout::<D>::POSITION + D,
            &mut spare,
        ));
        weights.fill_parts(coordinates, frame, &position, parts);
        let spread = complete(&mut weights, &batch, frame.cell, constraints);
        for lane in batch.members() {
            each(first + lane, spread.map(|axis| axis[lane]));
        }
    }
}

fn complete<const D: usize>(
    weights: &mut Weights<D>,
    batch: &Batch,
    cell: f64,
    constraints: Option<&ConstrainedNodes>,
) -> [[f64; LANES]; D] {
    let mut spread = weights.spread;
    if let Some(constraints) = constraints {
        let hanging = constraints.hanging.touched(weights, batch);
        constraints.hanging.add_spread(weights, hanging, cell, &mut spread);
        let mut nodes = NodeWeights::new();
        let touched = constraints.prepare(weights, &mut nodes, batch);
        constraints.add_spread(weights, &nodes, touched, &mut spread);
    }
    spread
}
