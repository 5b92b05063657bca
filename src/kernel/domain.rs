//! Half widths of the particles' boxes.
//!
//! A pure function of particle state, cell size and domain size: scatter, gather and the search for
//! the block of a particle call the same code and get the same bits.
use super::batch::Batch;
use super::math::{exp, ln};
use super::simd::{LANES, Lanes, Mask};
use super::{BoxPolicy, Scheme, Select};
use crate::material::eigen::determinant;
use crate::particle::chunk::{Chunk, Layout, Tag};

/// Least half width, as a share of the cell: keeps the weights of a box at a wall defined.
const LEAST_SHARE: f64 = 1e-6;

/// Half widths of the selected particles along each axis, m, as the kernels use them on cells of edge
/// `cell`: at most half a cell, and cut so that the box stays within the domain `[0, extent]`.
/// Replaces the content of `out`.
pub fn half_widths<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    cell: f64,
    extent: &[f64; D],
    scheme: &Scheme,
    out: &mut Vec<[f64; D]>,
) {
    collect(chunk, select, cell, 0.5 * cell, extent, scheme, out);
}

/// Half widths as [`half_widths`], but not limited to half a cell: the boxes to be cut into parts
/// where they are wider than a cell (see [`super::SubBox`]).
pub fn full_half_widths<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    cell: f64,
    extent: &[f64; D],
    scheme: &Scheme,
    out: &mut Vec<[f64; D]>,
) {
    collect(chunk, select, cell, f64::INFINITY, extent, scheme, out);
}

fn collect<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    cell: f64,
    greatest: f64,
    extent: &[f64; D],
    scheme: &Scheme,
    out: &mut Vec<[f64; D]>,
) {
    out.clear();
    let (reals, stride) = chunk.reals();
    for i in 0..Batch::number(&select, chunk.len()) {
        let batch = Batch::of(&select, chunk.len(), i);
        let position: [Lanes; D] =
            std::array::from_fn(|axis| batch.load(reals, stride, Layout::<D>::POSITION + axis));
        let half = of_batch(reals, stride, chunk.tags(), &batch, &position, cell, greatest, extent, scheme);
        let half = half.map(Lanes::to_array);
        out.extend((0..batch.count).map(|lane| std::array::from_fn(|axis| half[axis][lane])));
    }
}

/// Half widths of a batch.
#[inline(always)]
pub(super) fn of_batch<const D: usize>(
    reals: &[f64],
    stride: usize,
    tags: &[u64],
    batch: &Batch,
    position: &[Lanes; D],
    cell: f64,
    greatest: f64,
    extent: &[f64; D],
    scheme: &Scheme,
) -> [Lanes; D] {
    let own = match scheme.boxes {
        BoxPolicy::Fixed => [batch.load(reals, stride, Layout::<D>::HALF); D],
        BoxPolicy::Cell => {
            let half = std::array::from_fn(|lane| {
                let level = Tag::unpack(tags[batch.particle(lane)]).level;
                0.5 * scheme.root_cell / f64::from(1u32 << level.min(31))
            });
            [Lanes::new(half); D]
        }
        BoxPolicy::Volume { min_stretch, max_stretch } => {
            let half = batch.load(reals, stride, Layout::<D>::HALF);
            let stretch = stretches(reals, stride, tags, batch, scheme);
            let (least, most) = (Lanes::splat(min_stretch), Lanes::splat(max_stretch));
            stretch.map(|s| half * s.max(least).min(most))
        }
    };
    std::array::from_fn(|axis| {
        let wall = position[axis].min(Lanes::splat(extent[axis]) - position[axis]);
        own[axis].min(Lanes::splat(greatest)).min(wall).max(Lanes::splat(LEAST_SHARE * cell))
    })
}

/// Ratio of the half widths to the undeformed ones that keeps the volume.
#[inline(always)]
fn stretches<const D: usize>(
    reals: &[f64],
    stride: usize,
    tags: &[u64],
    batch: &Batch,
    scheme: &Scheme,
) -> [Lanes; D] {
    let index = batch.materials(tags);
    let plastic = (0..LANES).fold(0u32, |bits, lane| {
        bits | u32::from(scheme.materials[usize::from(index[lane])].is_plastic()) << lane
    });
    let load = |c: usize| batch.load(reals, stride, Layout::<D>::LEFT_CAUCHY_GREEN + c);
    let along_axes: [Lanes; D] = std::array::from_fn(|axis| load(axis).sqrt());
    if plastic == 0 {
        return along_axes;
    }
    let zero = Lanes::splat(0.0);
    let elastic = std::array::from_fn(|c| if c < Layout::<D>::SYMMETRIC { load(c) } else { zero });
    let gain = batch.load(reals, stride, Layout::<D>::HISTORY + 1);
    let volume_log = ln(determinant(&elastic)).mul_add(Lanes::splat(0.5), gain);
    let isotropic = exp(volume_log * (1.0 / D as f64));
    let mask = Mask::from_bits(plastic);
    along_axes.map(|axis| mask.select(isotropic, axis))
}
