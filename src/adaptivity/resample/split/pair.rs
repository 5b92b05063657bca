//! One particle becomes two.
use super::offsets::{opposite, sides};
use super::rings;
use crate::adaptivity::resample::affine::{gradient, read_matrix, write_matrix};
use crate::adaptivity::resample::{Setting, ids};
use crate::kernel::Transfer;
use crate::particle::chunk::{Chunk, Layout};
use crate::particle::halvings;

/// Chunk with the particles listed (ascending) twice, one behind the other, and all others once; and where
/// the first of each two are.
pub(crate) fn doubled<const D: usize>(
    chunk: &Chunk<D>,
    which: impl Iterator<Item = u32>,
) -> (Chunk<D>, Vec<usize>) {
    let mut source = Vec::with_capacity(chunk.len());
    let mut listed = which.peekable();
    let mut pairs = Vec::new();
    for p in 0..chunk.len() as u32 {
        if listed.next_if_eq(&p).is_some() {
            pairs.push(source.len());
            source.push(p);
        }
        source.push(p);
    }
    (chunk.gathered(&source), pairs)
}

/// Turns two copies of a particle from index `first` into halves at `-offset` and `offset` from it (m; less
/// where a wall is near), with half its mass and volume each. `spread` is the second moment of the particle's
/// weights in the grid that last gave it its affine matrix, m². Both take `B - C (o ⊗ o)` with the offset o,
/// so that momentum is kept, and angular momentum to round-off. Returns the kinetic energy added, J.
pub(crate) fn part<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    first: usize,
    offset: &[f64; D],
    spread: &[f64; D],
) -> f64 {
    let x = chunk.position(first);
    let v: [f64; D] = chunk.read(Layout::<D>::VELOCITY, first);
    let [mass] = chunk.read(Layout::<D>::MASS, first);
    let [half] = chunk.read(Layout::<D>::HALF, first);
    let places: [(f64, f64); D] = std::array::from_fn(|a| {
        let (lower, upper) = sides(x[a], offset[a].abs(), setting.extent[a]);
        if offset[a] < 0.0 { (upper, lower) } else { (lower, upper) }
    });
    if setting.has_rings() {
        return rings::halve(chunk, setting, first, &places, spread);
    }
    let offset: [f64; D] = std::array::from_fn(|a| places[a].1 - x[a]);
    let mut kept = read_matrix(chunk, first);
    let gradient = gradient(setting.scheme.transfer, &kept, spread);
    let affine =
        gradient.map(|row: [f64; D]| (0..D).fold(0.0, |sum, k| f64::mul_add(row[k], offset[k], sum)));
    if setting.scheme.transfer == Transfer::Apic {
        for i in 0..D {
            for k in 0..D {
                kept[i][k] = f64::mul_add(-affine[i], offset[k], kept[i][k]);
            }
        }
    }
    let velocities: [(f64, f64); D] = std::array::from_fn(|i| opposite(v[i], affine[i]));
    let parent = chunk.ids()[first];
    let mut energy = 0.0;
    for (side, child) in [(0, 0), (1, (1 << D) - 1)] {
        let p = first + side;
        let pick = |pair: &(f64, f64)| if side == 0 { pair.0 } else { pair.1 };
        let velocity = velocities.each_ref().map(pick);
        energy += (0..D).map(|i| (velocity[i] - v[i]) * (velocity[i] - v[i])).sum::<f64>();
        chunk.write(Layout::<D>::POSITION, p, &places.each_ref().map(pick));
        chunk.write(Layout::<D>::VELOCITY, p, &velocity);
        chunk.write(Layout::<D>::MASS, p, &[0.5 * mass]);
        chunk.write(Layout::<D>::HALF, p, &[half / halvings::edge_of_whole::<D>(1)]);
        let shares = chunk.carried_columns().min(setting.scheme.shares);
        (0..shares).for_each(|column| chunk.carried_mut(column)[p] *= 0.5);
        write_matrix(chunk, p, &kept);
        chunk.ids_mut()[p] = ids::child::<D>(parent, child).unwrap_or(parent);
        chunk.tags_mut()[p] = halvings::otherwise_split(chunk.tags()[p], ids::generation(parent));
    }
    0.25 * mass * energy
}
