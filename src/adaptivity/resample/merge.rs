//! Several particles become one.
use rustc_hash::{FxHashMap, FxHashSet};

use super::family::{self, Bounds, of_level};
use super::mixture::{Group, mixtures};
use super::{Limits, Setting, merge_backoff};
use crate::csr::Csr;
use crate::particle::chunk::{Chunk, Layout, Tag};

/// Results of [`merge`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Merged {
    /// Particles that stand for a group now.
    pub merged: u64,
    /// Those among them that were complete families, and are the parent again.
    pub families: u64,
    /// Decrease of the number of particles.
    pub removed: u64,
    /// Indices, ascending, of particles that stand for a group of strangers and carry the smallest identifier
    /// of the group. That identifier is unique among living particles. A caller that numbers these along the
    /// curve, from the first root that no particle ever had, makes it unique for the whole run and restores
    /// the generations used up (see [`super::ids`]).
    pub unnamed: Vec<u32>,
    /// Identifiers of particles whose merge the limits forbid, or that have no partner.
    pub refused: FxHashSet<u64>,
}

/// Merges particles made for levels finer than that of the leaf, level by level from the finest: first
/// complete families of siblings, then, with the `bounds` of the leaf given, strangers: particles of one
/// material and body whose centres lie in one cell of the lattice that seeding uses on the next coarser
/// level, in the order of the chunk, as many as fill the volume of an undeformed particle of that level. Only
/// groups within the `limits` merge, and only where `may_merge` allows it for their centre of mass.
///
/// Strangers that fill less than half of that volume become one particle of the level they have. Siblings
/// that may still meet do not merge as strangers (see [`super::family`]): a merge of strangers breaks up
/// families for good, and leaves particles of uneven size, while a family restores the particle that was
/// split.
///
/// A merged particle takes the place of the first of its group; all others keep their order. Mass, volume and
/// plastic work are conserved, momentum and, with APIC, angular momentum to round-off; the current volume is
/// conserved and the stress is admissible. `book` receives the kinetic energy that each merge removes, J,
/// which is not negative.
pub fn merge<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    limits: &Limits,
    bounds: Option<&Bounds<D>>,
    may_merge: impl Fn([f64; D]) -> bool,
    book: &mut impl FnMut(f64),
) -> Merged {
    let mut report = Merged::default();
    let finest = chunk.tags().iter().map(|&tag| Tag::unpack(tag).level).max().unwrap_or(0);
    let mut unnamed = Vec::new();
    for level in (setting.level + 1..=finest).rev() {
        for among_strangers in [false, true] {
            let due = merge_backoff::due(chunk, level, setting.turn);
            let refused = &mut report.refused;
            let mut groups = match bounds {
                _ if due.is_empty() => continue,
                _ if !among_strangers => families(chunk, level, &due),
                Some(bounds) => strangers(chunk, setting, limits, bounds, level, &due, refused),
                None => continue,
            };
            groups.retain(|group| may_merge(centre(chunk, group)));
            if groups.is_empty() {
                continue;
            }
            unnamed.resize(chunk.len(), false);
            let mixtures = mixtures(chunk, setting, limits, groups, level - 1, &mut report.refused);
            let mut stays = vec![true; chunk.len()];
            let mut done = Vec::new();
            for (number, group) in mixtures.groups.iter().enumerate() {
                let Some(energy) = mixtures.energy[number] else {
                    report.refused.extend(group.members.iter().map(|&p| chunk.ids()[p as usize]));
                    continue;
                };
                group.members[1..].iter().for_each(|&p| stays[p as usize] = false);
                unnamed[group.members[0] as usize] = !group.is_family;
                done.push((group.members[0], number));
                report.merged += 1;
                report.families += u64::from(group.is_family);
                report.removed += group.members.len() as u64 - 1;
                book(energy);
            }
            replace(chunk, &mut unnamed, &stays, &mut done, &mixtures.chunk);
        }
    }
    report.unnamed = (0..).zip(unnamed).filter(|(_, unnamed)| *unnamed).map(|(p, _)| p).collect();
    report
}

/// Centre of mass of a group, m.
fn centre<const D: usize>(chunk: &Chunk<D>, group: &Group) -> [f64; D] {
    let masses = chunk.column(Layout::<D>::MASS);
    let total: f64 = group.members.iter().map(|&p| masses[p as usize]).sum();
    group.members.iter().fold([0.0; D], |centre, &p| {
        let (x, share) = (chunk.position(p as usize), masses[p as usize] / total);
        std::array::from_fn(|axis| f64::mul_add(share, x[axis], centre[axis]))
    })
}

/// Writes the merged particles (index in the chunk, number in `merged`) over the first of their groups and
/// takes out those that do not stay.
fn replace<const D: usize>(
    chunk: &mut Chunk<D>,
    unnamed: &mut Vec<bool>,
    stays: &[bool],
    done: &mut [(u32, usize)],
    merged: &Chunk<D>,
) {
    if done.is_empty() {
        return;
    }
    done.sort_unstable();
    let source: Vec<u32> = (0..).zip(stays).filter(|(_, stays)| **stays).map(|(p, _)| p).collect();
    *unnamed = source.iter().map(|&p| unnamed[p as usize]).collect();
    chunk.keep(&source);
    let mut place = 0;
    for &(first, number) in done.iter() {
        place += source[place..].partition_point(|&p| p < first);
        chunk.replace(place, merged, number);
    }
}

/// Complete families of a level with one of the given members, by identifier. Children in the order of their
/// numbers.
fn families<const D: usize>(chunk: &Chunk<D>, level: u8, with: &[u32]) -> Vec<Group> {
    let siblings = family::siblings(chunk, level, &family::parents(chunk, with.iter().copied()));
    let whole = siblings.items().chunk_by(family::same_parent).filter(|siblings| siblings.len() == 1 << D);
    whole
        .map(|siblings| Group::new(siblings.iter().map(|child| child.p).collect(), siblings[0].parent, true))
        .collect()
}

/// Particles of a level that wait for no siblings and share a cell of the lattice of the next coarser level,
/// by material, body and cell; in cells where one of the given ones is. Identifiers of those among the given
/// ones that are alone are added to `refused`.
fn strangers<const D: usize>(
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    limits: &Limits,
    bounds: &Bounds<D>,
    level: u8,
    with: &[u32],
    refused: &mut FxHashSet<u64>,
) -> Vec<Group> {
    let waiting = |of: &[u32]| {
        let parents = family::parents(chunk, of.iter().copied());
        let mut waits = vec![false; chunk.len()];
        let waiting = family::waiting(chunk, setting, limits, bounds, level, &parents);
        waiting.iter().for_each(|&p| waits[p as usize] = true);
        waits
    };
    // Most particles refused by the limits wait for siblings; their cells need not be searched.
    let waits = waiting(with);
    let stays = |p: u32| !setting.merges_with_strangers(chunk.tags()[p as usize]);
    let with = with.iter().copied().filter(|&p| !waits[p as usize]);
    let (stay, with): (Vec<u32>, Vec<u32>) = with.partition(|&p| stays(p));
    refused.extend(stay.iter().map(|&p| chunk.ids()[p as usize]));
    if with.is_empty() {
        return Vec::new();
    }
    let per_spacing = |body| 0.5 / setting.nominal(Tag { material: 0, body, level }, level - 1);
    let per_spacing: Vec<f64> = (0..setting.nominal.len() as u16).map(per_spacing).collect();
    let cell_of = |p: u32, tag: u64| {
        let per_spacing = per_spacing[usize::from(Tag::unpack(tag).body)];
        // Cell as one number, which is quick to hash: 42 bits for each coordinate, in their order.
        let place = |x: f64| ((x * per_spacing).floor() as i64 + (1 << 41)) as u128;
        (tag, chunk.position(p as usize).iter().fold(0, |cell, &x| cell << 42 | place(x)))
    };
    let mut cells: FxHashMap<(u64, u128), u32> = FxHashMap::default();
    let of_given = with.iter().map(|&p| cell_of(p, merge_backoff::plain(chunk.tags()[p as usize])));
    let mut in_order: Vec<(u64, u128)> = of_given.filter(|&cell| cells.insert(cell, 0).is_none()).collect();
    in_order.sort_unstable();
    (0..).zip(&in_order).for_each(|(number, cell)| *cells.entry(*cell).or_default() = number);
    let in_cells = of_level(chunk, level).filter_map(|(p, tag)| Some((*cells.get(&cell_of(p, tag))?, p)));
    let mut members: Vec<(u32, u32)> = in_cells.collect();
    let waits = waiting(&members.iter().map(|(_, p)| *p).collect::<Vec<u32>>());
    members.retain(|(_, p)| !waits[*p as usize]);
    let (mut groups, mut alone) = (Vec::new(), Vec::new());
    let cells = Csr::new(in_order.len(), members.iter().copied());
    for (number, (tag, _)) in in_order.iter().enumerate() {
        let edge = 2.0 * setting.nominal(Tag::unpack(*tag), level - 1);
        // A lattice of equal parts fills the volume to round-off. More must not come in: boxes wider than a
        // cell by more than that would need another grid.
        let room = (1..D).fold(edge, |volume, _| volume * edge) * (1.0 + 8.0 * f64::EPSILON);
        let mut group: Vec<u32> = Vec::new();
        let mut filled = 0.0;
        for &p in cells.of(number) {
            let part = setting.section(chunk, p as usize);
            if filled + part > room {
                close(chunk, &mut group, &mut groups, &mut alone);
                filled = 0.0;
            }
            group.push(p);
            filled += part;
        }
        close(chunk, &mut group, &mut groups, &mut alone);
    }
    let mut is_given = vec![false; chunk.len()];
    with.iter().for_each(|&p| is_given[p as usize] = true);
    let alone = alone.iter().filter(|&&p| is_given[p as usize]);
    refused.extend(alone.map(|&p| chunk.ids()[p as usize]));
    groups.retain(|group| group.members.iter().any(|&p| is_given[p as usize]));
    groups
}

/// Ends a group, which counts if it has two members or more.
fn close<const D: usize>(
    chunk: &Chunk<D>,
    group: &mut Vec<u32>,
    groups: &mut Vec<Group>,
    alone: &mut Vec<u32>,
) {
    let members = std::mem::take(group);
    if members.len() < 2 {
        alone.extend(members);
        return;
    }
    let smallest = members.iter().map(|&p| chunk.ids()[p as usize]).min();
    groups.extend(smallest.map(|id| Group::new(members, id, false)));
}
