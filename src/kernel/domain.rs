//! Half widths of the particles' boxes.
//!
//! A pure function of particle state, cell size and domain size: scatter, gather and the search for
//! the block of a particle call the same code and get the same bits.
use super::batch::{Batch, Batches, Tile};
use super::{BoxPolicy, Coordinates, Scheme, Select};
use crate::material::eigen::determinant;
use crate::particle::chunk::{Chunk, Layout, Place};
use crate::particle::halvings;
use crate::particle::volume::det_f;
use crate::simd::math::{exp, ln};
use crate::simd::{LANES, Lanes, Vector, VectorMask, prefetch};

/// Least half width, as a share of the cell (2^-46): keeps the weights of a box at a wall defined. So small
/// that the part of such a box outside the domain is below round-off.
const LEAST_SHARE: f64 = 1.0 / 70_368_744_177_664.0;

/// Half width, as a share of the cell, below which the slopes of a box that a wall cuts are reduced (see
/// [`softening`]): that of the usual box of half a cell at the usual least stretch.
const SOFT_SHARE: f64 = 1.0 / 16.0;

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

/// [`full_half_widths`] of up to [`LANES`] particles, at least one; lanes behind the last are undefined.
pub fn full_half_widths_of<const D: usize>(
    chunk: &Chunk<D>,
    particles: &[u32],
    cell: f64,
    extent: &[f64; D],
    scheme: &Scheme,
) -> [Lanes; D] {
    let mut spare = Tile::new();
    let batch = Batch::of_particles(particles);
    let tile = batch.tile::<D>(chunk.tiles(), columns::<D>(), &mut spare);
    of_batch(tile, chunk.tags(), &batch, &batch.positions(tile), cell, f64::INFINITY, extent, scheme)
}

/// Prefetches the columns that [`full_half_widths_of`] reads of the batch from `first` on.
pub fn read_ahead<const D: usize>(place: Place, first: usize) {
    let place = place.of_particle::<D>(first);
    columns::<D>().for_each(|column| prefetch(place.tiles + column * size_of::<[f64; LANES]>()));
    prefetch(place.tags);
}

/// Columns that the widths of boxes follow from, positions among them.
pub fn columns<const D: usize>() -> impl Iterator<Item = usize> {
    let elastic = Layout::<D>::LEFT_CAUCHY_GREEN..Layout::<D>::LEFT_CAUCHY_GREEN + Layout::<D>::SYMMETRIC;
    let position = Layout::<D>::POSITION..Layout::<D>::POSITION + D;
    position.chain(elastic).chain([Layout::<D>::HALF, Layout::<D>::PLASTIC_VOLUME])
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
    let mut spare = Tile::new();
    for batch in Batches::new(select, chunk, Place::default()) {
        let tile = batch.tile::<D>(chunk.tiles(), columns::<D>(), &mut spare);
        let position = batch.positions(tile);
        let half = of_batch(tile, chunk.tags(), &batch, &position, cell, greatest, extent, scheme);
        let half: [[f64; LANES]; D] = half.map(Lanes::to_array);
        out.extend(batch.members().map(|lane| std::array::from_fn(|axis| half[axis][lane])));
    }
}

/// Half widths of a batch.
#[inline(always)]
pub(super) fn of_batch<V: Vector, const D: usize>(
    tile: &[[f64; LANES]],
    tags: &[u64],
    batch: &Batch,
    position: &[V; D],
    cell: f64,
    greatest: f64,
    extent: &[f64; D],
    scheme: &Scheme,
) -> [V; D] {
    let whole = whole_of_batch(tile, tags, batch, greatest, scheme);
    cut_at_walls(&whole, position, cell, extent)
}

/// Half widths of boxes within the domain `[0, extent]`, each side cut as the side at the wall.
#[inline(always)]
pub(super) fn cut_at_walls<V: Vector, const D: usize>(
    whole: &[V; D],
    position: &[V; D],
    cell: f64,
    extent: &[f64; D],
) -> [V; D] {
    let mut half = *whole;
    for axis in 0..D {
        let wall = position[axis].min(V::splat(extent[axis]) - position[axis]);
        half[axis] = half[axis].min(wall).max(V::splat(LEAST_SHARE * cell));
    }
    half
}

/// Half widths of boxes that no wall cuts, with the bits of [`cut_at_walls`].
#[inline(always)]
pub(super) fn away_from_walls<V: Vector, const D: usize>(whole: &[V; D], cell: f64) -> [V; D] {
    let mut half = *whole;
    for half in &mut half {
        *half = half.max(V::splat(LEAST_SHARE * cell));
    }
    half
}

/// Boxes of a batch in a block at a wall of the domain.
#[derive(Clone, Copy)]
pub(super) struct AtWall<'a, V, const D: usize> {
    /// Half widths before walls cut them, m.
    pub whole: [V; D],
    /// Half widths within the domain, m.
    pub half: [V; D],
    /// Edge of the cells, m.
    pub cell: f64,
    /// Upper corner of the domain, m.
    pub extent: &'a [f64; D],
}

impl<V: Vector, const D: usize> AtWall<'_, V, D> {
    /// Factors of the columns of B of particles that move to `moved`; `None` if all are 1.
    ///
    /// `C = B D⁻¹` takes D at the new position. At a distance d from the wall D is about `d h`: with B kept,
    /// C grows like `1/d`, and a particle that drifts to the wall would accelerate its nodes without bound
    /// and pass through. So B falls with the distance.
    #[inline(always)]
    pub(super) fn kept_affine_velocity(&self, moved: &[V; D]) -> Option<[V; D]> {
        if !is_cut(&self.whole, &self.half) {
            return None;
        }
        let next = cut_at_walls(&self.whole, moved, self.cell, self.extent);
        let one = V::splat(1.0);
        let mut kept = next;
        for axis in 0..D {
            let share = (next[axis] / self.half[axis]).min(one);
            kept[axis] = self.half[axis].lt(self.whole[axis]).select(share, one);
        }
        Some(kept)
    }
}

/// Factors of the slopes along each axis, for boxes of half widths `half` that were cut from `whole`; `None`
/// if all are 1.
///
/// A particle at a distance d from a wall has the weight `d/h` at the next node, and the slope `1/h`. Where
/// it is alone, so that this node has no other mass, its stress acts on its own velocity gradient with a
/// stiffness in proportion to `1/d`, which no time step in use resolves when d is small: fragments near walls
/// would gain energy without bound. With the factor `d/d₀` below `d₀ = h/16`, or below the half width of the
/// box before it was cut, this stiffness falls with d instead. As the same factor is in the force and in the
/// velocity gradient, it neither adds nor removes energy.
#[inline(always)]
pub(super) fn softening<V: Vector, const D: usize>(
    whole: &[V; D],
    half: &[V; D],
    cell: f64,
) -> Option<[V; D]> {
    let mut least = *whole;
    let mut is_cut = V::Mask::from_bits(0);
    for axis in 0..D {
        least[axis] = whole[axis].min(V::splat(SOFT_SHARE * cell));
        is_cut = is_cut | half[axis].lt(least[axis]);
    }
    // Few particles come so near to a wall.
    is_cut.any().then(|| factors(half, &least))
}

/// `softening` of a box that is wider than a cell along another axis, of cells of edge `cell`. Before a wall
/// cut it, it was wider than the limit along every axis.
pub fn softening_at<const D: usize>(
    position: &[f64; D],
    half: &[f64; D],
    cell: f64,
    extent: &[f64; D],
) -> [f64; D] {
    std::array::from_fn(|axis| {
        let is_cut = half[axis] >= position[axis].min(extent[axis] - position[axis]);
        if is_cut { (half[axis] / (SOFT_SHARE * cell)).min(1.0) } else { 1.0 }
    })
}

/// Whether a wall cuts any of the boxes.
#[inline(always)]
fn is_cut<V: Vector, const D: usize>(whole: &[V; D], half: &[V; D]) -> bool {
    let mut is_cut = V::Mask::from_bits(0);
    for axis in 0..D {
        is_cut = is_cut | half[axis].lt(whole[axis]);
    }
    is_cut.any()
}

#[inline(always)]
fn factors<V: Vector, const D: usize>(half: &[V; D], least: &[V; D]) -> [V; D] {
    let mut factor = *half;
    for axis in 0..D {
        factor[axis] = (half[axis] / least[axis]).min(V::splat(1.0));
    }
    factor
}

/// Half widths of a batch, at most `greatest`, wherever the particles are.
#[inline(always)]
pub(super) fn whole_of_batch<V: Vector, const D: usize>(
    tile: &[[f64; LANES]],
    tags: &[u64],
    batch: &Batch,
    greatest: f64,
    scheme: &Scheme,
) -> [V; D] {
    let mut half = match scheme.boxes {
        BoxPolicy::Fixed => [batch.load(tile, Layout::<D>::HALF); D],
        BoxPolicy::Cell => {
            let half = scheme.sizes(tags, batch).map(|size| 0.5 * size);
            [V::new(half); D]
        }
        BoxPolicy::Volume { min_stretch, max_stretch } => {
            let original: V = batch.load(tile, Layout::<D>::HALF);
            let mut half: [V; D] = stretches(tile, tags, batch, scheme);
            if scheme.coordinates == Coordinates::Axisymmetric {
                half = of_rings(tile, tags, batch, scheme).map(V::new);
            } else if scheme.has_halves || is_far(&half, scheme, max_stretch) {
                let mut arrays = half.map(V::to_array);
                far_stretched(&original.to_array(), &mut arrays, tags, batch, scheme);
                half = arrays.map(V::new);
            } else {
                for half in &mut half {
                    *half = original * half.max(V::splat(min_stretch)).min(V::splat(max_stretch));
                }
            }
            half
        }
    };
    for half in &mut half {
        *half = half.min(V::splat(greatest));
    }
    half
}

/// Half widths of sections of rings: of a square section with the undeformed volume at the present radius,
/// times the stretches that keep the volume. As the stretch along the hoop is the ratio of the radii, the
/// half width along the radius of an elastic particle is `√(V₀ / (2π r)) / 2 · √λ_θ λ_r`, and the
/// section of any has the area `J V₀ / (2π r)`. At most half a cell of the particle's level: towards the
/// axis sections grow without bound.
#[inline(never)]
fn of_rings<const D: usize>(
    tile: &[[f64; LANES]],
    tags: &[u64],
    batch: &Batch,
    scheme: &Scheme,
) -> [[f64; LANES]; D] {
    let BoxPolicy::Volume { min_stretch, max_stretch } = scheme.boxes else { return [[0.0; LANES]; D] };
    let plastic = plastic_lanes(|| batch.materials(tags), scheme);
    let widest = scheme.sizes(tags, batch).map(|cell| 0.5 * cell);
    let stretches = stretches::<Lanes, D>(tile, tags, batch, scheme).map(Lanes::to_array);
    stretches.map(|stretches| {
        std::array::from_fn(|lane| {
            let at = |column: usize| tile[column][lane];
            let section = scheme.coordinates.half_width(at(Layout::<D>::HALF), at(Layout::<D>::POSITION));
            let hoop = match plastic >> lane & 1 {
                1 => 1.0,
                _ => at(Layout::<D>::LEFT_CAUCHY_GREEN + 2).sqrt().sqrt(),
            };
            let stretch = (hoop * stretches[lane]).max(min_stretch).min(max_stretch);
            (section * stretch).min(widest[lane])
        })
    })
}

/// Whether any box of a batch is stretched beyond what boxes of materials that flow may be, and others may.
#[inline(always)]
fn is_far<V: Vector, const D: usize>(stretches: &[V; D], scheme: &Scheme, max_stretch: f64) -> bool {
    if scheme.elastic_stretch <= max_stretch {
        return false;
    }
    let mut greatest = stretches[0];
    for stretch in stretches {
        greatest = greatest.max(*stretch);
    }
    V::splat(max_stretch).lt(greatest).any()
}

/// From stretches to half widths, where particles of elastic materials have been halved or are stretched far.
/// The bounds are those of the whole, as parts of a wide box are narrow, and those of what has torn would
/// be slivers, whose stable step is far below that of the cells. A call, so that the kernels keep their
/// registers for what is usual.
#[cold]
#[inline(never)]
fn far_stretched<const D: usize>(
    original: &[f64; LANES],
    stretches: &mut [[f64; LANES]; D],
    tags: &[u64],
    batch: &Batch,
    scheme: &Scheme,
) {
    let BoxPolicy::Volume { min_stretch, max_stretch } = scheme.boxes else { return };
    let plastic = plastic_lanes(|| batch.materials(tags), scheme);
    for lane in 0..LANES {
        let tag = tags[batch.particle(lane)];
        let most = if plastic >> lane & 1 == 1 { max_stretch } else { scheme.elastic_stretch };
        let (shape, whole) = match halvings::is_any([tag]) {
            true => (halvings::shape::<D>(tag), halvings::edge_of_whole::<D>(halvings::number::<D>(tag))),
            false => ([1.0; D], 1.0),
        };
        for (stretch, shape) in stretches.iter_mut().zip(shape) {
            let own = (shape * stretch[lane]).max(whole * min_stretch).min(whole * most);
            stretch[lane] = original[lane] * own;
        }
    }
}

/// Half widths of one box over its undeformed one, as `whole_of_batch` has them where a box follows the
/// volume: for pictures. `elastic` is the left Cauchy-Green tensor: xx, yy, zz, xy, yz, xz.
pub fn stretches_of_one(
    elastic: &[f64; 6],
    plastic_volume: f64,
    dimension: usize,
    is_plastic: bool,
    [least, greatest]: [f64; 2],
) -> [f64; 3] {
    let stretch: [f64; 3] = if is_plastic {
        [libm::pow(det_f(*elastic, plastic_volume), 1.0 / dimension as f64); 3]
    } else {
        std::array::from_fn(|axis| elastic[axis].sqrt())
    };
    stretch.map(|stretch| if stretch.is_nan() { 1.0 } else { stretch.clamp(least, greatest) })
}

/// Ratio of the half widths to the undeformed ones that keeps the volume.
#[inline(always)]
fn stretches<V: Vector, const D: usize>(
    tile: &[[f64; LANES]],
    tags: &[u64],
    batch: &Batch,
    scheme: &Scheme,
) -> [V; D] {
    let plastic = plastic_lanes(|| batch.materials(tags), scheme);
    let mut elastic = [V::splat(0.0); 6];
    let mut stretch = [V::splat(0.0); D];
    for axis in 0..D {
        elastic[axis] = batch.load(tile, Layout::<D>::LEFT_CAUCHY_GREEN + axis);
        stretch[axis] = elastic[axis].sqrt();
    }
    if plastic == 0 {
        return stretch;
    }
    for c in D..Layout::<D>::SYMMETRIC {
        elastic[c] = batch.load(tile, Layout::<D>::LEFT_CAUCHY_GREEN + c);
    }
    let gain = batch.load(tile, Layout::<D>::PLASTIC_VOLUME);
    let volume_log = ln(determinant(&elastic)).mul_add(V::splat(0.5), gain);
    let isotropic = exp(volume_log * (1.0 / D as f64));
    if plastic == (1 << LANES) - 1 {
        return [isotropic; D];
    }
    let mask = V::Mask::from_bits(plastic);
    for stretch in &mut stretch {
        *stretch = mask.select(isotropic, *stretch);
    }
    stretch
}

/// Bit i says whether lane i is of a plastic material. `index` gives the materials, and is called only if
/// some are plastic.
#[inline(always)]
pub(super) fn plastic_lanes(index: impl Fn() -> [u16; LANES], scheme: &Scheme) -> u32 {
    if !scheme.is_plastic {
        return 0;
    }
    if scheme.is_all_plastic {
        return (1 << LANES) - 1;
    }
    let index = index();
    let is_plastic = |lane: usize| scheme.materials[usize::from(index[lane])].is_plastic();
    if index.iter().all(|&i| i == index[0]) {
        return if is_plastic(0) { (1 << LANES) - 1 } else { 0 };
    }
    (0..LANES).fold(0, |bits, lane| bits | u32::from(is_plastic(lane)) << lane)
}

/// A bound on the half widths of a chunk's boxes, m.
pub fn widest<const D: usize>(chunk: &Chunk<D>) -> f64 {
    greatest_stretch(chunk) * greatest_undeformed(chunk)
}

/// A bound on the half widths of a chunk's undeformed boxes, m.
pub fn greatest_undeformed<const D: usize>(chunk: &Chunk<D>) -> f64 {
    let halves = chunk.column(Layout::<D>::HALF);
    if !halvings::is_any(chunk.tags().iter().copied()) {
        return halves.greatest();
    }
    let greatest = |tag: u64| halvings::shape::<D>(tag).into_iter().fold(0.0, f64::max);
    halves.iter().zip(chunk.tags()).map(|(half, &tag)| half * greatest(tag)).fold(0.0, f64::max)
}

/// A bound on the widths of a chunk's boxes over their undeformed widths.
pub fn greatest_stretch<const D: usize>(chunk: &Chunk<D>) -> f64 {
    let first = Layout::<D>::LEFT_CAUCHY_GREEN;
    // xx, yy and zz come first in either dimension. No axis is stretched more than the root of the greatest
    // of them, no volume more than its power 3/2.
    let elastic = (first..first + 3).map(|column| chunk.column(column).greatest()).fold(0.0, f64::max);
    let plastic = chunk.column(Layout::<D>::PLASTIC_VOLUME).greatest();
    let isotropic = libm::exp((1.5 * libm::log(elastic) + plastic) / D as f64);
    elastic.sqrt().max(isotropic)
}
