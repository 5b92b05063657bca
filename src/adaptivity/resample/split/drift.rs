//! Particles that drift apart become two each, so that thin flow keeps no gaps.
//!
//! Elastic strains stay small where material flows, and with them boxes; but neighbours drift apart by all of
//! the stretch. Particles carry it as `e = b - 1`, with b of [`crate::particle::strain`] in terms of a cube
//! of their half width l: the space of a particle is an ellipsoid with half axes l √λ. A particle whose
//! longest axis exceeds some cells becomes two, offset by half a half axis to each side, and each has half of
//! that axis. Mass and momentum are conserved as in [`super::split()`], and angular momentum since both take
//! `B - C (o ⊗ o)` with the offset o. Particles whose space has grown in volume are left alone: separated
//! grains (tension cut-off, spray) are no flow.
use super::displacement::hand_displacement;
use super::{pair, rings};
use crate::adaptivity::resample::{Setting, ids};
use crate::material::tensor::eigen::{decompose, determinant};
use crate::particle::chunk::{Chunk, Layout};
use crate::particle::halvings::edge_of_whole;
use crate::particle::strain::{self, Components};
use crate::particle::volume::volume_ratio;
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
fn longest<const D: usize>(
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    p: usize,
    first: usize,
) -> Option<(f64, [f64; D])> {
    let b = strain::tensor(D, &strain::read(chunk, first, p)).map(Lanes::splat);
    let is_torn = match setting.has_rings() {
        true => volume_ratio(chunk, p) > TORN,
        false => determinant(&b).to_array()[0] > TORN * TORN,
    };
    if is_torn {
        return None;
    }
    let axes = decompose(&b, D == 2);
    let values = axes.value.map(|value| value.to_array()[0]);
    let most = (0..D).fold(0, |most, k| if values[k] > values[most] { k } else { most });
    let half = half_width(chunk, setting, p, first);
    let direction = std::array::from_fn(|a| axes.vector[most][a].to_array()[0]);
    Some((half * values[most].sqrt(), direction))
}

/// Half width of the undeformed space of a particle, m.
fn half_width<const D: usize>(chunk: &Chunk<D>, setting: &Setting<D>, p: usize, first: usize) -> f64 {
    match setting.has_rings() {
        true => rings::space(chunk, setting, p, &strain::tensor(D, &strain::read(chunk, first, p))),
        false => chunk.column(Layout::<D>::HALF)[p],
    }
}

/// Replaces particles that have drifted apart by two each, in their place. `spread` is the second moment of a
/// particle's weights in the grid that last gave it its affine matrix, m². `book` receives the kinetic energy
/// that each split adds, J. Returns how many were replaced.
pub(crate) fn close_gaps<const D: usize>(
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
        let half = half_width(chunk, setting, *p, gap.column);
        let trace = D as f64 + (0..D).map(|a| chunk.carried(gap.column + a)[*p]).sum::<f64>();
        if 4.0 * half * half * trace <= gap.cells * gap.cells * cell * cell {
            return None;
        }
        let (axis, direction) = longest(chunk, setting, *p, gap.column)?;
        let is_wide = 2.0 * axis > gap.cells * cell && ids::has_room(chunk.ids()[*p]);
        is_wide.then_some((*p as u32, axis, direction))
    };
    let wanted: Vec<(u32, f64, [f64; D])> = (0..chunk.len()).filter_map(|p| wanted(&p)).collect();
    if wanted.is_empty() {
        return 0;
    }
    let (doubled, pairs) = pair::doubled(chunk, wanted.iter().map(|(p, ..)| *p));
    *chunk = doubled;
    for (first, &(_, axis, direction)) in pairs.into_iter().zip(&wanted) {
        let (spread, half) = (spread(chunk, first), half_width(chunk, setting, first, gap.column));
        let stretch = halved::<D>(&strain::read(chunk, gap.column, first), axis / half, &direction);
        let offset = direction.map(|component: f64| 0.5 * axis * component);
        let x = chunk.position(first);
        book(pair::part(chunk, setting, first, &offset, &spread));
        hand_displacement(chunk, setting, first..first + 2, &x);
        for p in [first, first + 1] {
            strain::write(chunk, gap.column, p, &stretch);
        }
    }
    wanted.len() as u64
}

/// Stretch of a half, in terms of its own cube, whose edge is `1 / s` of that of the whole, `s = 2^(1/D)`:
/// `s² (b - ¾ λ n ⊗ n) - 1`, where the longest half axis is √λ along n.
fn halved<const D: usize>(e: &Components, root: f64, n: &[f64; D]) -> Components {
    let square = edge_of_whole::<D>(1) * edge_of_whole::<D>(1);
    let mut new = [0.0; 6];
    for ((new, e), &(i, j)) in new.iter_mut().zip(e).zip(strain::places(D)) {
        let unit = if i == j { 1.0 } else { 0.0 };
        *new = square * (e + unit - 0.75 * root * root * n[i] * n[j]) - unit;
    }
    new
}
