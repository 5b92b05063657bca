//! Displacements of the parts of a particle.
use std::ops::Range;

use crate::adaptivity::resample::Setting;
use crate::material::eigen::decompose;
use crate::particle::chunk::{Chunk, Layout};
use crate::particle::volume;
use crate::simd::{Lanes, Vector};

/// Adds to the displacements that the parts of a particle carry by how much their way from it, which was at
/// `x` (m), has grown since the body was undeformed: `o - V⁻¹ o` with the offset o and the elastic left
/// stretch V. What the body has turned is not known.
pub(crate) fn hand_displacement<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    parts: Range<usize>,
    x: &[f64; D],
) {
    let column = setting.scheme.displacement.filter(|first| chunk.carried_columns() >= first + D);
    let Some(column) = column else { return };
    for p in parts {
        let place = chunk.position(p);
        let offset = std::array::from_fn(|a| place[a] - x[a]);
        let before = stretched(chunk, p, &offset, f64::recip);
        (0..D).for_each(|a| chunk.carried_mut(column + a)[p] += offset[a] - before[a]);
    }
}

/// `f(V) d` with the left stretch V of a particle.
pub(crate) fn stretched<const D: usize>(
    chunk: &Chunk<D>,
    p: usize,
    d: &[f64; D],
    f: impl Fn(f64) -> f64,
) -> [f64; D] {
    let [xx, yy, zz, xy, yz, xz] = volume::symmetric(chunk, Layout::<D>::LEFT_CAUCHY_GREEN, p);
    let axes = decompose(&[xx, yy, zz, xy, xz, yz].map(Lanes::splat), D == 2);
    let mut image = [0.0; D];
    for (value, vector) in axes.value.iter().zip(&axes.vector) {
        let direction: [f64; D] = std::array::from_fn(|a| vector[a].to_array()[0]);
        let along = (0..D).map(|a| direction[a] * d[a]).sum::<f64>() * f(value.to_array()[0].sqrt());
        (0..D).for_each(|a| image[a] = along.mul_add(direction[a], image[a]));
    }
    image
}
