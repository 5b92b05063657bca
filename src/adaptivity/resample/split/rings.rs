//! Rings: splits in axisymmetry.
//!
//! A ring at the radius r is the turn of its section, so its parts at `r ∓ o` have the shares
//! `(1 ∓ o/r) / 2` of mass and volume: sections of equal area, which tile that of the whole. Velocity and
//! affine matrix belong to the centre of mass, which is not the position, the centre of the section
//! (`docs/design/axisymmetry.md`). So parts take the velocity of the affine field at their own centres of
//! mass, and the mean of these is that of the whole.
use super::child::{hand_share, make_child};
use super::offsets::{opposite, sides};
use crate::adaptivity::resample::affine::{gradient, read_matrix, write_matrix};
use crate::adaptivity::resample::{Setting, ids};
use crate::kernel::Transfer;
use crate::particle::chunk::{Chunk, Layout};
use crate::particle::halvings;
use crate::particle::volume::volume_ratio;

/// Masses of the two parts of a ring of a mass at a radius (m) that are at an offset (m, of either sign)
/// before and behind it. Their sum is the mass to the last bit.
pub(super) fn masses(mass: f64, radius: f64, offset: f64) -> [f64; 2] {
    let more = if radius > 0.0 { (offset / radius).clamp(-1.0, 1.0) } else { 0.0 };
    let (first, second) = opposite(0.5 * mass, 0.5 * mass * more);
    [first, second]
}

/// Turns `2^D` copies of a ring from index `first` into its children, as [`super::split()`] does. Returns the
/// kinetic energy added, J.
pub(super) fn divide<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    first: usize,
    half: &[f64; D],
    spread: &[f64; D],
) -> f64 {
    let number = 1 << D;
    let x = chunk.position(first);
    let ([mass], [width]) = (chunk.read(Layout::<D>::MASS, first), chunk.read(Layout::<D>::HALF, first));
    let places: [(f64, f64); D] =
        std::array::from_fn(|axis| sides(x[axis], 0.5 * half[axis], setting.extent[axis]));
    // The number of layers along the axis is a power of two.
    let masses = masses(mass * 2.0 / number as f64, x[0], places[0].1 - x[0]);
    for child in 0..number {
        let (p, of_mass) = (first + child, masses[child & 1]);
        let place: [f64; D] =
            std::array::from_fn(|a| if child >> a & 1 == 1 { places[a].1 } else { places[a].0 });
        chunk.write(Layout::<D>::POSITION, p, &place);
        resize(chunk, setting, p, width, (of_mass, of_mass / mass));
        make_child(chunk, p, child);
    }
    share_motion(chunk, setting, first, number, spread)
}

/// Gives a part of a ring its mass and its share of volume and carried columns; `width` is the half width of
/// the whole (see [`Layout::HALF`]).
pub(super) fn resize<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    p: usize,
    width: f64,
    (mass, share): (f64, f64),
) {
    chunk.write(Layout::<D>::MASS, p, &[mass]);
    chunk.write(Layout::<D>::HALF, p, &[width * share.sqrt()]);
    hand_share(chunk, setting, p, share);
}

/// Gives the parts of a ring, which have its velocity and affine matrix, those of its affine field at their
/// centres of mass: `v + C o` and, with APIC, `B - C Σ s o ⊗ o` with the shares s of mass and the arms o from
/// the common centre of mass, so that momentum is kept, and a merge undoes the split. `spread` is the second
/// moment of the weights that gave the ring its matrix, m². Returns the kinetic energy added, J.
pub(super) fn share_motion<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    first: usize,
    number: usize,
    spread: &[f64; D],
) -> f64 {
    let parts: Vec<u32> = (first..first + number).map(|p| p as u32).collect();
    let ahead = setting.ways_to_mass_centres(chunk, &parts);
    let masses: Vec<f64> = parts.iter().map(|&p| chunk.column(Layout::<D>::MASS)[p as usize]).collect();
    let total: f64 = masses.iter().sum();
    let origin = chunk.position(first);
    let mut arms: Vec<[f64; D]> = Vec::with_capacity(number);
    for (&p, ahead) in parts.iter().zip(&ahead) {
        let x = chunk.position(p as usize);
        arms.push(std::array::from_fn(|a| x[a] - origin[a] + if a == 0 { *ahead } else { 0.0 }));
    }
    let mean = arms.iter().zip(&masses).fold([0.0; D], |mean: [f64; D], (arm, mass)| {
        std::array::from_fn(|a| f64::mul_add(mass / total, arm[a], mean[a]))
    });
    arms.iter_mut().for_each(|arm| (0..D).for_each(|a| arm[a] -= mean[a]));

    let v: [f64; D] = chunk.read(Layout::<D>::VELOCITY, first);
    let mut kept = read_matrix(chunk, first);
    let gradient = gradient(setting.scheme.transfer, &kept, spread);
    let mut energy = 0.0;
    for ((&p, arm), mass) in parts.iter().zip(&arms).zip(&masses) {
        let affine = gradient.map(|row: [f64; D]| (0..D).fold(0.0, |sum, k| row[k].mul_add(arm[k], sum)));
        let velocity: [f64; D] = std::array::from_fn(|i| v[i] + affine[i]);
        chunk.write(Layout::<D>::VELOCITY, p as usize, &velocity);
        for i in 0..D {
            let more = velocity[i] - v[i];
            energy = f64::mul_add(0.5 * mass * more, more, energy);
            for k in 0..D {
                if setting.scheme.transfer == Transfer::Apic {
                    kept[i][k] = f64::mul_add(-affine[i] * (mass / total), arm[k], kept[i][k]);
                }
            }
        }
    }
    parts.iter().for_each(|&p| write_matrix(chunk, p as usize, &kept));
    energy
}

/// Half width of the undeformed section of the space of a ring, m, whose stretch in the plane of the section
/// is `e + 1` (see [`crate::particle::strain`]): of one that the stretch makes as large as the ring's
/// section.
pub(super) fn space<const D: usize>(chunk: &Chunk<D>, setting: &Setting<D>, p: usize, b: &[f64; 6]) -> f64 {
    let [half] = chunk.read(Layout::<D>::HALF, p);
    let ratio = volume_ratio(chunk, p);
    let in_plane = f64::mul_add(b[0], b[1], -b[3] * b[3]).max(f64::MIN_POSITIVE).sqrt();
    setting.scheme.coordinates.half_width(half, chunk.position(p)[0]) * (ratio / in_plane).sqrt()
}

/// Turns two copies of a ring from index `first` into halves of its section at `-offset` and `offset` (m), as
/// [`super::pair::part`] does. Returns the kinetic energy added, J.
pub(super) fn halve<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    first: usize,
    places: &[(f64, f64); D],
    spread: &[f64; D],
) -> f64 {
    let x = chunk.position(first);
    let ([mass], [width]) = (chunk.read(Layout::<D>::MASS, first), chunk.read(Layout::<D>::HALF, first));
    let masses = masses(mass, x[0], places[0].1 - x[0]);
    // The outer half is heavier: both are shifted along the axis, so that their centre stays.
    let lean = (masses[1] - masses[0]) / mass;
    for (side, of_mass) in masses.into_iter().enumerate() {
        let p = first + side;
        let mut place = places.map(|(before, behind)| if side == 0 { before } else { behind });
        for a in 1..D {
            place[a] = f64::mul_add(-lean, places[a].1 - x[a], place[a]);
        }
        chunk.write(Layout::<D>::POSITION, p, &place);
        resize(chunk, setting, p, width, (of_mass, of_mass / mass));
        let parent = chunk.ids()[p];
        let generation = ids::generation(parent);
        chunk.ids_mut()[p] = ids::child::<D>(parent, side * ((1 << D) - 1)).unwrap_or(parent);
        chunk.tags_mut()[p] = halvings::otherwise_split(chunk.tags()[p], generation);
    }
    share_motion(chunk, setting, first, 2, spread)
}
