//! Pressure of the water in the pores of particles.
use super::chunk::{Chunk, Layout, Tag};
use super::followed::head;
use super::volume::symmetric;
use crate::load::Water;
use crate::material::undrained;
use crate::quantity::in_job;

/// Pressure (Pa) of the water that a job gives, at a time (s) of its own and in this gravity (m/s²).
/// Particles carry its head from column `first` on where it seeps; `origin` is the lower corner of the
/// domain, m.
pub fn given_pressure<const D: usize>(
    water: &Water,
    time: f64,
    gravity: &[f64; D],
    (first, origin): (Option<usize>, &[f64; D]),
    chunk: &Chunk<D>,
    p: usize,
) -> f64 {
    let about = water.about(head(chunk, first, p, origin));
    about.pressure(in_job(origin, &chunk.position(p)), time, gravity)
}

/// Pressure (Pa) of water that cannot leave the pores, since consolidation; `moduli` are the stiffnesses of
/// that water by material, Pa, 0 where there is none.
pub fn excess_pressure<const D: usize>(moduli: &[f64], chunk: &Chunk<D>, p: usize) -> f64 {
    let material = usize::from(Tag::unpack(chunk.tags()[p]).material);
    match moduli.get(material) {
        Some(&modulus) if modulus > 0.0 => {
            let [xx, yy, zz, xy, yz, xz] = symmetric(chunk, Layout::<D>::LEFT_CAUCHY_GREEN, p);
            let history = chunk.read(Layout::<D>::HISTORY, p);
            undrained::excess_pressure(modulus, &[xx, yy, zz, xy, xz, yz], &history)
        }
        _ => 0.0,
    }
}
