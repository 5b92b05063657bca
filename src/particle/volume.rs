//! Volume and Cauchy stress of a particle.
use super::chunk::{Chunk, Layout, TILE};

/// Components xx, yy, zz, xy, yz, xz (the order of VTK) of the symmetric tensor at column `first`.
pub fn symmetric<const D: usize>(chunk: &Chunk<D>, first: usize, p: usize) -> [f64; 6] {
    in_tile::<D>(chunk.tile_of(p), first, p % TILE)
}

/// [`symmetric`] of a lane of a tile.
fn in_tile<const D: usize>(tile: &[[f64; TILE]], first: usize, lane: usize) -> [f64; 6] {
    let at = |component: usize| tile[first + component][lane];
    let (xz, yz) = if D == 2 { (0.0, 0.0) } else { (at(4), at(5)) };
    [at(0), at(1), at(2), at(3), yz, xz]
}

/// Volume over reference volume, det F.
pub fn volume_ratio<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    ratio_in_tile::<D>(chunk.tile_of(p), p % TILE)
}

/// [`volume_ratio`] of a lane of a tile.
fn ratio_in_tile<const D: usize>(tile: &[[f64; TILE]], lane: usize) -> f64 {
    let elastic = in_tile::<D>(tile, Layout::<D>::LEFT_CAUCHY_GREEN, lane);
    det_f(elastic, tile[Layout::<D>::PLASTIC_VOLUME][lane])
}

/// [`volume_ratio`] of the particles of a tile; values behind the last particle are undefined.
pub fn volume_ratios<const D: usize>(tile: &[[f64; TILE]]) -> [f64; TILE] {
    // Lane by lane without branches and calls, which the compiler turns into vectors.
    let mut ratios = [0.0; TILE];
    let column = |component: usize| &tile[Layout::<D>::LEFT_CAUCHY_GREEN + component];
    let [xx, yy, zz, xy] = [0, 1, 2, 3].map(column);
    if D == 2 {
        for (lane, ratio) in ratios.iter_mut().enumerate() {
            *ratio = elastic_ratio([xx[lane], yy[lane], zz[lane], xy[lane], 0.0, 0.0]);
        }
    } else {
        let [xz, yz] = [4, 5].map(column);
        for (lane, ratio) in ratios.iter_mut().enumerate() {
            *ratio = elastic_ratio([xx[lane], yy[lane], zz[lane], xy[lane], yz[lane], xz[lane]]);
        }
    }
    let plastic = &tile[Layout::<D>::PLASTIC_VOLUME];
    if plastic.iter().any(|volume| *volume != 0.0) {
        ratios.iter_mut().zip(plastic).for_each(|(ratio, volume)| *ratio = with_plastic(*ratio, *volume));
    }
    ratios
}

/// Volume, m³; in plane strain of one metre of thickness.
pub fn volume<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    reference_volume(chunk, p) * volume_ratio(chunk, p)
}

/// Greatest det F that measurements of volume count: that of a box at the default limit of the solver, a
/// stretch of two along each axis. A particle that flies alone may have a det F of thousands, with no
/// material in that volume.
fn greatest_ratio<const D: usize>() -> f64 {
    (0..D).fold(1.0, |product, _| 2.0 * product)
}

/// Volume of a particle where it is measured, m³; in plane strain of one metre of thickness. A det F that is
/// no number counts as 1.
pub fn measured_volume<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    let ratio = volume_ratio(chunk, p);
    reference_volume(chunk, p) * if ratio.is_nan() { 1.0 } else { ratio.min(greatest_ratio::<D>()) }
}

/// Volume of the undeformed particle, m³; in plane strain of one metre of thickness.
pub fn reference_volume<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    box_volume::<D>(chunk.column(Layout::<D>::HALF)[p])
}

/// Volume of a cube (square) of this half width, m³ (m²).
pub fn box_volume<const D: usize>(half: f64) -> f64 {
    (0..D).fold(1.0, |product, _| product * (2.0 * half))
}

/// det F: elastic part from the left Cauchy-Green tensor, plastic part from the second history
/// variable (0 where a model has none).
pub fn det_f(elastic: [f64; 6], plastic_volume: f64) -> f64 {
    with_plastic(elastic_ratio(elastic), plastic_volume)
}

/// The elastic part of [`det_f`].
#[inline(always)]
fn elastic_ratio([xx, yy, zz, xy, yz, xz]: [f64; 6]) -> f64 {
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    determinant.sqrt()
}

/// An elastic part of [`det_f`] with the plastic one.
#[inline(always)]
fn with_plastic(elastic: f64, plastic_volume: f64) -> f64 {
    if plastic_volume == 0.0 { elastic } else { elastic * libm::exp(plastic_volume) }
}

/// Cauchy stress σ = τ / det F, Pa, in the order of [`symmetric`].
pub fn cauchy_stress<const D: usize>(chunk: &Chunk<D>, p: usize) -> [f64; 6] {
    let ratio = volume_ratio(chunk, p);
    symmetric(chunk, Layout::<D>::STRESS, p).map(|component| component / ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particle::chunk::Tag;

    /// A foam that is stretched by a half has its volume, spray the volume of its greatest box.
    #[test]
    fn spray_fills_no_more_than_its_boxes() {
        let mut chunk = Chunk::<3>::new();
        let p = chunk.push_zeroed(1, Tag { material: 0, body: 0, level: 0 });
        chunk.column_mut(Layout::<3>::HALF)[p] = 0.5;
        for (b, plastic, expected) in
            [(2.25, 0.0, 3.375), (1.0, 9.0, 8.0), (1e8, 0.0, 8.0), (f64::NAN, 0.0, 1.0)]
        {
            for component in 0..3 {
                chunk.column_mut(Layout::<3>::LEFT_CAUCHY_GREEN + component)[p] = b;
            }
            chunk.column_mut(Layout::<3>::PLASTIC_VOLUME)[p] = plastic;
            approx::assert_relative_eq!(measured_volume(&chunk, p), expected, max_relative = 1e-14);
        }
    }
}
