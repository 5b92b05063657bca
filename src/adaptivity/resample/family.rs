//! Siblings: which of them may still meet, and which are separated by a face of their leaf.
//!
//! The particles of a family that was split from one particle are the only group whose merge gives that
//! particle back. So siblings wait for each other as long as they may be near: while all of them are in the
//! leaf and not torn apart; while a sibling in the leaf is itself split; and for a limited number of attempts
//! if the others may be just beyond a face of the leaf. They count as torn apart when the centres of those in
//! the leaf are further from each other along an axis than those of undeformed siblings whose boxes just fit
//! the widest box that a merge may make.
//!
//! A family that a face cuts in two is in two leaves, so neither can merge it. [`separated`] returns the
//! particles that have to cross to the leaf on the lower side for a while. It cannot know which faces cut a
//! family that is near several, so the caller tries the combinations of axes in turn.
use super::{Limits, Setting, ids, merge_backoff};
use crate::csr::Csr;
use crate::particle::chunk::{Chunk, Tag};

/// Lower and upper corner of a leaf, m.
pub type Bounds<const D: usize> = ([f64; D], [f64; D]);

/// A particle that has a parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sibling {
    /// Identifier of the parent.
    pub parent: u64,
    /// Packed tag.
    pub tag: u64,
    /// Number among the children.
    pub number: usize,
    /// Index in the chunk.
    pub p: u32,
}

/// Parents of some particles, ascending.
pub(super) fn parents<const D: usize>(chunk: &Chunk<D>, of: impl Iterator<Item = u32>) -> Vec<u64> {
    let parent = |p: u32| ids::parent::<D>(chunk.ids()[p as usize]);
    let mut parents: Vec<u64> = of.filter_map(parent).map(|(parent, _)| parent).collect();
    // Siblings are neighbours in the chunk as a rule.
    parents.dedup();
    parents.sort_unstable();
    parents.dedup();
    parents
}

/// Particles of a level that have one of the parents (ascending), by parent and number.
pub(super) fn siblings<const D: usize>(chunk: &Chunk<D>, level: u8, parents: &[u64]) -> Csr<Sibling> {
    let (mut found, mut last) = (Vec::new(), 0);
    for (p, tag) in of_level(chunk, level) {
        let Some((parent, number)) = ids::parent::<D>(chunk.ids()[p as usize]) else { continue };
        if parents.get(last) != Some(&parent) {
            let Ok(place) = parents.binary_search(&parent) else { continue };
            last = place;
        }
        found.push((last as u32, Sibling { parent, tag, number, p }));
    }
    let mut siblings = Csr::new(parents.len(), found.into_iter());
    siblings.each_mut().for_each(|family| family.sort_unstable());
    siblings
}

/// Whether two are siblings that may become one.
pub(super) fn same_parent(a: &Sibling, b: &Sibling) -> bool {
    (a.parent, a.tag) == (b.parent, b.tag)
}

/// Distance along an axis beyond which siblings of a level count as torn apart, m.
fn greatest_distance<const D: usize>(setting: &Setting<D>, limits: &Limits, tag: u64, level: u8) -> f64 {
    // The width of the merged box, less half the width of a sibling on either side.
    (2.0 * limits.stretch - 1.0) * setting.nominal(Tag::unpack(tag), level - 1)
}

/// Whether siblings are further apart along some axis than a distance.
fn are_torn<const D: usize>(chunk: &Chunk<D>, siblings: &[Sibling], distance: f64) -> bool {
    (0..D).any(|axis| {
        let places = siblings.iter().map(|sibling| chunk.position(sibling.p as usize)[axis]);
        let (least, greatest) =
            places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, g), x| (f64::min(l, x), f64::max(g, x)));
        greatest - least > distance
    })
}

/// Parents, ascending, of which a child in the chunk was split: particles of a finer level descend from it.
fn parents_of_split<const D: usize>(chunk: &Chunk<D>, level: u8) -> Vec<u64> {
    let mut parents = Vec::new();
    for (&id, &tag) in chunk.ids().iter().zip(chunk.tags()) {
        if Tag::unpack(tag).level > level {
            let child = ids::parent::<D>(id).map(|(child, _)| child);
            let mut ancestor = child.and_then(ids::parent::<D>);
            while let Some((parent, _)) = ancestor {
                parents.push(parent);
                ancestor = ids::parent::<D>(parent);
            }
        }
    }
    parents.sort_unstable();
    parents.dedup();
    parents
}

/// Indices of particles of a level with one of the parents (ascending) whose siblings may still come, so that
/// they do not merge as strangers.
pub(super) fn waiting<const D: usize>(
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    limits: &Limits,
    (lower, upper): &Bounds<D>,
    level: u8,
    parents: &[u64],
) -> Vec<u32> {
    let siblings = siblings(chunk, level, parents);
    let parents_of_split = parents_of_split(chunk, level);
    let mut waiting = Vec::new();
    for family in siblings.items().chunk_by(same_parent) {
        let distance = greatest_distance(setting, limits, family[0].tag, level);
        if are_torn(chunk, family, distance) {
            continue;
        }
        let all = family.len() == 1 << D || parents_of_split.binary_search(&family[0].parent).is_ok();
        let beside_leaf = |x: [f64; D]| {
            // No sibling is beyond a wall.
            (0..D).any(|a| {
                lower[a] > 0.0 && x[a] < lower[a] + distance
                    || upper[a] < setting.extent[a] && x[a] >= upper[a] - distance
            })
        };
        if all {
            waiting.extend(family.iter().map(|sibling| sibling.p));
        } else if family.iter().all(|sibling| beside_leaf(chunk.position(sibling.p as usize))) {
            let patient = family.iter().map(|sibling| sibling.p);
            waiting.extend(patient.filter(|&p| !merge_backoff::has_given_up(chunk.tags()[p as usize])));
        }
    }
    waiting
}

/// Particles (ascending) of incomplete families finer than the leaf that lie near its lower faces along some
/// of the `axes` (one bit each), with a place beyond all these faces.
pub fn separated<const D: usize>(
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    limits: &Limits,
    (lower, _): &Bounds<D>,
    axes: usize,
) -> Vec<(u32, [f64; D])> {
    let finest = chunk.tags().iter().map(|&tag| Tag::unpack(tag).level).max().unwrap_or(0);
    let mut separated = Vec::new();
    for level in setting.level + 1..=finest {
        let due = merge_backoff::due(chunk, level, setting.turn).into_iter();
        let due = parents(chunk, due.filter(|&p| !merge_backoff::has_given_up(chunk.tags()[p as usize])));
        if due.is_empty() {
            continue;
        }
        let siblings = siblings(chunk, level, &due);
        for family in siblings.items().chunk_by(same_parent).filter(|family| family.len() < 1 << D) {
            let distance = greatest_distance(setting, limits, family[0].tag, level);
            if are_torn(chunk, family, distance) {
                continue;
            }
            for sibling in family {
                let x = chunk.position(sibling.p as usize);
                let crosses = |a: usize| axes >> a & 1 == 1 && lower[a] > 0.0 && x[a] < lower[a] + distance;
                if (0..D).any(crosses) {
                    let beyond = |a: usize| if crosses(a) { lower[a] - 0.5 * distance } else { x[a] };
                    separated.push((sibling.p, std::array::from_fn(beyond)));
                }
            }
        }
    }
    separated.sort_unstable_by_key(|(p, _)| *p);
    separated
}

/// Index and packed tag, without count, of the particles made for a level.
pub(super) fn of_level<const D: usize>(chunk: &Chunk<D>, level: u8) -> impl Iterator<Item = (u32, u64)> {
    let tags = (0..).zip(chunk.tags().iter().copied().map(merge_backoff::plain));
    tags.filter(move |(_, tag)| Tag::unpack(*tag).level == level)
}
