//! Particles that drift apart become two each, so that thin flow keeps no gaps.
//!
//! Elastic strains stay small where material flows, and with them boxes; but neighbours drift apart by all of the stretch. Particles
//! carry it as `e = b - 1`, with b of [`crate::particle::strain`] in terms of a cube of their half width l: the space of a particle is an
//! ellipsoid with half axes l √λ. One whose longest axis is wider than some cells becomes two, half a half axis to each side, and each has
//! half of that axis. Mass and momentum are kept as in [`super::split()`], and angular momentum since both take
//! `B - C (o ⊗ o)` with the offset o. Space that has grown with them is left alone: grains that are apart (tension cut-off, spray) are no flow.
use super::{Setting, gradient, ids, opposite, read_matrix, sides, write_matrix};
use crate::kernel::Transfer;
use crate::material::tensor::eigen::{decompose, determinant};
use crate::particle::chunk::{Chunk, Layout};
use crate::particle::strain::{self, Components};
use crate::simd::{Lanes, Vector};

/// Greatest volume of the space of a particle over the undeformed one: beyond it material is torn.
const TORN: f64 = 1.5;

/// Condition under which particles split for their distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Width of a particle's space, in cells of its leaf.
    pub cells: f64,
    /// First column of the stretch that particles carry.
    pub column: usize,
}

/// Longest half axis (m) of a particle's space, and its direction; nothing where the material is torn.
fn longest<const D: usize>(chunk: &Chunk<D>, p: usize, first: usize) -> Option<(f64, [f64; D])> {
    let b = strain::tensor(D, &strain::read(chunk, first, p)).map(Lanes::splat);
    if determinant(&b).to_array()[0] > TORN * TORN {
        return None;
    }
    let axes = decompose(&b, D == 2);
    let values = axes.value.map(|value| value.to_array()[0]);
    let most = (0..D).fold(0, |most, k| if values[k] > values[most] { k } else { most });
    let [half] = chunk.read(Layout::<D>::HALF, p);
    let direction = std::array::from_fn(|a| axes.vector[most][a].to_array()[0]);
    Some((half * values[most].sqrt(), direction))
}

/// Replaces particles that have drifted apart by two each, in their place. `spread` is the second moment of a particle's weights in the
/// grid that last gave it its affine matrix, m². `book` gets the kinetic energy that each split adds, J. Returns how many were replaced.
pub(super) fn close_gaps<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    gap: Gap,
    spread: impl Fn(&Chunk<D>, usize) -> [f64; D],
    book: &mut impl FnMut(f64),
) -> u64 {
    let cell = setting.cell();
    if chunk.carried_columns() < gap.column + strain::columns(D) {
        return 0;
    }
    let wanted = |p: &usize| {
        // The greatest eigenvalue is at most the trace: most particles are far from a split.
        let [half] = chunk.read(Layout::<D>::HALF, *p);
        let trace = D as f64 + (0..D).map(|a| chunk.carried(gap.column + a)[*p]).sum::<f64>();
        if 4.0 * half * half * trace <= gap.cells * gap.cells * cell * cell {
            return None;
        }
        let (axis, direction) = longest(chunk, *p, gap.column)?;
        let is_wide = 2.0 * axis > gap.cells * cell && ids::generation(chunk.ids()[*p]) < ids::GENERATIONS;
        is_wide.then_some((*p as u32, axis, direction))
    };
    let wanted: Vec<(u32, f64, [f64; D])> = (0..chunk.len()).filter_map(|p| wanted(&p)).collect();
    if wanted.is_empty() {
        return 0;
    }
    let mut source = Vec::with_capacity(chunk.len() + wanted.len());
    let mut listed = wanted.iter().peekable();
    let mut pairs = Vec::new();
    for p in 0..chunk.len() as u32 {
        if let Some(&&(_, axis, direction)) = listed.peek().filter(|(listed, ..)| *listed == p) {
            listed.next();
            pairs.push((source.len(), axis, direction));
            source.push(p);
        }
        source.push(p);
    }
    *chunk = chunk.gathered(&source);
    for &(first, axis, direction) in &pairs {
        let spread = spread(chunk, first);
        book(part(chunk, setting, gap, first, (axis, direction), spread));
    }
    pairs.len() as u64
}

/// Turns two copies of a particle from index `first` into its halves. Returns the kinetic energy added, J.
fn part<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    gap: Gap,
    first: usize,
    (axis, direction): (f64, [f64; D]),
    spread: [f64; D],
) -> f64 {
    let x = chunk.position(first);
    let v: [f64; D] = chunk.read(Layout::<D>::VELOCITY, first);
    let [mass] = chunk.read(Layout::<D>::MASS, first);
    let [half] = chunk.read(Layout::<D>::HALF, first);
    let places: [(f64, f64); D] = std::array::from_fn(|a| {
        let (lower, upper) = sides(x[a], (0.5 * axis * direction[a]).abs(), setting.extent[a]);
        if direction[a] < 0.0 { (upper, lower) } else { (lower, upper) }
    });
    let offset: [f64; D] = std::array::from_fn(|a| places[a].1 - x[a]);
    let mut kept = read_matrix(chunk, first);
    let gradient = gradient(setting.scheme.transfer, &kept, &spread);
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
    let stretch = halved::<D>(&strain::read(chunk, gap.column, first), axis / half, &direction);
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
        chunk.write(Layout::<D>::HALF, p, &[half / edge_of_two(D)]);
        let shares = chunk.carried_columns().min(setting.scheme.shares);
        (0..shares).for_each(|column| chunk.carried_mut(column)[p] *= 0.5);
        strain::write(chunk, gap.column, p, &stretch);
        write_matrix(chunk, p, &kept);
        chunk.ids_mut()[p] = ids::child::<D>(parent, child).unwrap_or(parent);
    }
    0.25 * mass * energy
}

/// Edge of a cube of twice the volume of one of edge 1: `2^(1/D)`.
fn edge_of_two(dimension: usize) -> f64 {
    if dimension == 2 { std::f64::consts::SQRT_2 } else { 1.259_921_049_894_873_2 }
}

/// Stretch of a half, in terms of its own cube, whose edge is `1 / s` of that of the whole, `s = 2^(1/D)`:
/// `s² (b - ¾ λ n ⊗ n) - 1`, where the longest half axis is √λ along n.
fn halved<const D: usize>(e: &Components, root: f64, n: &[f64; D]) -> Components {
    let square = edge_of_two(D) * edge_of_two(D);
    let mut new = [0.0; 6];
    for ((new, e), &(i, j)) in new.iter_mut().zip(e).zip(strain::places(D)) {
        let unit = if i == j { 1.0 } else { 0.0 };
        *new = square * (e + unit - 0.75 * root * root * n[i] * n[j]) - unit;
    }
    new
}
