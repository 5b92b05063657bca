//! Elastic particles that are stretched become two each, and one again once they are not, so that elastic
//! bodies do not tear.
//!
//! Where particles in tension are a cell apart, one sample for each node, their motion in opposite directions
//! from node to node costs no strain, while the tension gives energy to it: for such modes the least
//! eigenvalue of the stiffness is negative for any tension, and the body tears (`docs/design/resampling.md`).
//! So an elastic particle whose box has become wider than [`WIDE`] cells along an axis, and is in tension
//! along it, becomes two, half as wide along this axis alone, and with it all of its material in the
//! leaf that is at least [`SLACK`] as wide: beside grips, where the stretch changes within a cell, whole ones
//! among halves tear. Their centres are where the stretch has carried those of the halves of the undeformed
//! box, at `± V d`: along the axis itself, material that is stretched on a slant would move across. Its tag
//! says so (see [`crate::particle::halvings`]). Mass, momentum and angular momentum are kept as
//! [`pair::part`] says.
use std::collections::BTreeMap;

use super::mixture::{Group, mixtures};
use super::split::displacement::{hand_displacement, stretched};
use super::split::moments::spread_on_lattice;
use super::split::pair;
use super::{Limits, Merged, Setting, ids, merge_backoff};
use crate::kernel::Scheme;
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::halvings;

/// Width of a box, in cells of its leaf, from which on it is halved; measured, see
/// `docs/design/resampling.md`.
const WIDE: f64 = 0.6;
/// Stretch from which on it is halved at the earliest: boxes may be wider from the start.
const GROWN: f64 = 2.0 * WIDE;
/// Two halves become one where the box of this is narrower than so much of the width at which it was halved.
const NARROW: f64 = 0.9;
/// Those that are narrower than so much of the width at which they are halved are not halved with others, nor
/// kept from becoming one by others.
const SLACK: f64 = 0.5;
/// Stretch beyond which a body has torn: its strands stretch without end, and halves would not mend that.
const TORN: f64 = 8.0;

/// A bound on the half widths (m) of the boxes of elastic particles in a chunk that are stretched; 0 if none
/// is stretched enough to be halved. Particles that flow may be taken for such.
pub(crate) fn widest<const D: usize>(chunk: &Chunk<D>, scheme: &Scheme) -> f64 {
    let first = Layout::<D>::LEFT_CAUCHY_GREEN;
    let square = (first..first + D).map(|column| chunk.column(column).greatest()).fold(0.0, f64::max);
    if square < GROWN * GROWN {
        return 0.0;
    }
    if !scheme.has_halves {
        return square.sqrt() * chunk.greatest_half();
    }
    let widest = |p: usize| half_widths(chunk, p).into_iter().fold(0.0, f64::max);
    (0..chunk.len()).map(widest).fold(0.0, f64::max)
}

/// Whether boxes of these half widths (m) are to be looked at in a leaf with cells of this edge, m.
pub(crate) fn may_be_wide(half: f64, cell: f64) -> bool {
    2.0 * half > WIDE * cell
}

/// Half widths of the box of an elastic particle, without bounds, m.
pub(crate) fn half_widths<const D: usize>(chunk: &Chunk<D>, p: usize) -> [f64; D] {
    let stretch = chunk.read::<D>(Layout::<D>::LEFT_CAUCHY_GREEN, p).map(f64::sqrt);
    let undeformed = undeformed(chunk, p);
    std::array::from_fn(|axis| undeformed[axis] * stretch[axis])
}

/// Half widths of the undeformed box of a particle, m.
fn undeformed<const D: usize>(chunk: &Chunk<D>, p: usize) -> [f64; D] {
    let [half] = chunk.read(Layout::<D>::HALF, p);
    halvings::shape::<D>(chunk.tags()[p]).map(|shape| half * shape)
}

/// Whether the box of a particle is that of a strand between parts that have torn, along an axis.
fn has_torn(half: f64, undeformed: f64) -> bool {
    half > TORN * undeformed
}

/// Half width (m) at which a box of an undeformed half width is halved, on cells of edge `cell`, m.
fn greatest(undeformed: f64, cell: f64) -> f64 {
    (0.5 * WIDE * cell).max(GROWN * undeformed)
}

/// Least half widths (m) that undeformed boxes of halves in a leaf have, by material and axis.
#[derive(Default)]
struct Halved(BTreeMap<(u16, usize), f64>);

impl Halved {
    fn add(&mut self, of: (u16, usize), half: f64) {
        let least = self.0.entry(of).or_insert(half);
        *least = least.min(half);
    }

    /// Whether an undeformed box of a half width is wider than that of a half.
    fn has_narrower(&self, of: (u16, usize), half: f64) -> bool {
        self.0.get(&of).is_some_and(|least| half > 1.5 * least)
    }
}

fn material<const D: usize>(chunk: &Chunk<D>, p: usize) -> u16 {
    Tag::unpack(chunk.tags()[p]).material
}

/// Half width (m) below which halves of an undeformed half width become one.
fn joined(undeformed: f64, cell: f64) -> f64 {
    0.5 * NARROW * greatest(2.0 * undeformed, cell)
}

impl<const D: usize> Setting<'_, D> {
    fn is_elastic(&self, chunk: &Chunk<D>, p: usize) -> bool {
        !self.scheme.materials[usize::from(material(chunk, p))].is_plastic()
    }
}

/// Axis along which a particle is to be halved: the one along which its box exceeds what it may have by most.
fn wide_axis<const D: usize>(chunk: &Chunk<D>, setting: &Setting<D>, p: usize) -> Option<usize> {
    let (half, undeformed) = (half_widths(chunk, p), undeformed(chunk, p));
    let (mut most, mut axis) = (1.0, None);
    for a in 0..D {
        let excess = half[a] / greatest(undeformed[a], setting.cell());
        let is_drawn = chunk.column(Layout::<D>::STRESS + a)[p] > 0.0 && !has_torn(half[a], undeformed[a]);
        if excess > most && is_drawn {
            (most, axis) = (excess, Some(a));
        }
    }
    axis
}

/// Axes along which others of the same material are to be halved with those that have become too wide.
fn beside<const D: usize>(
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    wide: &[(u32, usize)],
) -> Vec<(u32, usize)> {
    let mut halved = Halved::default();
    for &(p, axis) in wide {
        halved.add((material(chunk, p as usize), axis), 0.5 * undeformed(chunk, p as usize)[axis]);
    }
    let is_other = |p: &usize| wide.binary_search_by_key(&(*p as u32), |(p, _)| *p).is_err();
    let others = (0..chunk.len()).filter(is_other).filter(|&p| setting.is_elastic(chunk, p));
    let others = others.filter_map(|p| {
        let (material, half, undeformed) = (material(chunk, p), half_widths(chunk, p), undeformed(chunk, p));
        let axis = (0..D).find(|&axis| {
            halved.has_narrower((material, axis), undeformed[axis])
                && half[axis] > SLACK * greatest(undeformed[axis], setting.cell())
        })?;
        ids::has_room(chunk.ids()[p]).then_some((p as u32, axis))
    });
    others.collect()
}

/// Replaces elastic particles that have become too wide by two each, in their place, and with them those of
/// the same material that are as wide from the start. `book` gets the kinetic energy that each split adds, J.
/// Returns how many were replaced, and how many stayed since their identifiers have no room for another
/// generation.
pub(crate) fn halve<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    book: &mut impl FnMut(f64),
) -> super::Split {
    let mut report = super::Split::default();
    let mut wanted = Vec::new();
    for p in (0..chunk.len()).filter(|&p| setting.is_elastic(chunk, p)) {
        let Some(axis) = wide_axis(chunk, setting, p) else { continue };
        match ids::has_room(chunk.ids()[p]) {
            true => wanted.push((p as u32, axis)),
            false => report.refused += 1,
        }
    }
    if wanted.is_empty() {
        return report;
    }
    wanted.extend(beside(chunk, setting, &wanted));
    wanted.sort_unstable();
    report.split = wanted.len() as u64;
    let (doubled, pairs) = pair::doubled(chunk, wanted.iter().map(|(p, _)| *p));
    *chunk = doubled;
    for (first, &(_, axis)) in pairs.into_iter().zip(&wanted) {
        let (x, half) = (chunk.position(first), half_widths(chunk, first));
        let spread = std::array::from_fn(|a| spread_on_lattice(x[a], half[a], setting.cell()));
        let mut middle = [0.0; D];
        middle[axis] = 0.5 * undeformed::<D>(chunk, first)[axis];
        let offset = stretched(chunk, first, &middle, |stretch| stretch);
        book(pair::part(chunk, setting, first, &offset, &spread));
        hand_displacement(chunk, setting, first..first + 2, &x);
        for p in [first, first + 1] {
            let tag = merge_backoff::plain(chunk.tags()[p]);
            let split = ids::generation(chunk.ids()[p]) - 1;
            chunk.tags_mut()[p] = halvings::halved(tag, axis, split);
        }
    }
    report
}

/// Makes one again of halves that are in one chunk and no longer stretched, as none of their material there
/// is, where their states are alike.
/// `book` gets the kinetic energy that each merge removes, J.
pub(crate) fn rejoin<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    limits: &Limits,
    book: &mut impl FnMut(f64),
) -> Merged {
    let mut report = Merged::default();
    let groups = narrow_pairs(chunk, setting);
    let mut levels: Vec<u8> = groups.iter().map(|(level, _)| *level).collect();
    levels.sort_unstable();
    levels.dedup();
    let mut stays = vec![true; chunk.len()];
    for level in levels {
        let of_level = groups.iter().filter(|(of, _)| *of == level).map(|(_, group)| group.clone());
        let mixtures = mixtures(chunk, setting, limits, of_level.collect(), level, &mut report.refused);
        for (number, group) in mixtures.groups.iter().enumerate() {
            let Some(energy) = mixtures.energy[number] else { continue };
            chunk.replace(group.members[0] as usize, &mixtures.chunk, number);
            group.members[1..].iter().for_each(|&p| stays[p as usize] = false);
            report.merged += 1;
            report.removed += group.members.len() as u64 - 1;
            book(energy);
        }
    }
    if report.merged > 0 {
        let source: Vec<u32> = (0..).zip(stays).filter(|(_, stays)| *stays).map(|(p, _)| p).collect();
        chunk.keep(&source);
    }
    report
}

/// Halves of a chunk that are still too wide for one.
fn still_wide<const D: usize>(chunk: &Chunk<D>, halves: impl Iterator<Item = usize>, cell: f64) -> Halved {
    let mut wide = Halved::default();
    for p in halves {
        let (tag, half, undeformed) = (chunk.tags()[p], half_widths(chunk, p), undeformed(chunk, p));
        let axes = (0..D).filter(|&axis| halvings::along(tag, axis) > 0);
        axes.filter(|&axis| half[axis] >= joined(undeformed[axis], cell))
            .filter(|&axis| !has_torn(half[axis], undeformed[axis]))
            .for_each(|axis| wide.add((material(chunk, p), axis), undeformed[axis]));
    }
    wide
}

/// Pairs of halves that may become one, with their level, by identifier.
fn narrow_pairs<const D: usize>(chunk: &Chunk<D>, setting: &Setting<D>) -> Vec<(u8, Group)> {
    let plain = |p: u32| merge_backoff::plain(chunk.tags()[p as usize]);
    let mut halves: Vec<(u64, u64, u32)> = (0..chunk.len() as u32)
        .filter(|&p| halvings::is_any([plain(p)]) && setting.is_elastic(chunk, p as usize))
        .filter_map(|p| {
            let (parent, _) = ids::parent::<D>(chunk.ids()[p as usize])?;
            // Particles of finer levels that came of a half are no halves.
            halvings::is_half(plain(p), ids::generation(parent)).then_some((parent, plain(p), p))
        })
        .collect();
    halves.sort_unstable();
    let wide = still_wide(chunk, halves.iter().map(|(_, _, p)| *p as usize), setting.cell());
    let pairs = halves.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|pair| pair.len() == 2);
    let narrow = pairs.filter_map(|pair| {
        let (parent, tag, members) = (pair[0].0, pair[0].1, [pair[0].2, pair[1].2]);
        let [x, y] = members.map(|p| chunk.position(p as usize));
        let [half, other] = members.map(|p| half_widths(chunk, p as usize));
        let undeformed = members.map(|p| undeformed(chunk, p as usize));
        // Halved along several axes, they became two along the one that has them apart.
        let share = |a: usize| (y[a] - x[a]).abs() / (half[a] + other[a]);
        let halved = (0..D).filter(|&a| halvings::along(tag, a) > 0);
        let axis = halved.max_by(|&a, &b| share(a).total_cmp(&share(b)))?;
        let (undeformed, most) = (undeformed[0][axis], half[axis].max(other[axis]));
        let bound = joined(undeformed, setting.cell());
        let of = (material(chunk, members[0] as usize), axis);
        let is_narrow = most < bound && (most < SLACK * bound || !wide.has_narrower(of, 2.0 * undeformed));
        let group = Group { rejoined: Some(axis), ..Group::new(members.to_vec(), parent, true) };
        is_narrow.then_some((Tag::unpack(tag).level, group))
    });
    narrow.collect()
}
