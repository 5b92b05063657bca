//! The particle that stands for a group.
//!
//! | module | |
//! |---|---|
//! | `group` | particles that might become one |
//! | `motion` | mass, place and motion of the one |
//! | `matter` | its volume, state and stress |
//! | `means` | means that are exact where all values are equal |
mod group;
mod matter;
mod means;
mod motion;

use rustc_hash::FxHashSet;

pub(super) use self::group::Group;
use self::matter::{hencky, mix_matter, restore, symmetric};
use self::means::square;
use self::motion::{Motion, mix_motion};
use super::{Limits, Setting, ids};
use crate::kernel::Select;
use crate::material::HISTORIES;
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::halvings;

/// Merged particles, one per group.
pub(super) struct Mixtures<const D: usize> {
    /// The groups that pass the quick tests, in their order.
    pub groups: Vec<Group>,
    /// Their particles.
    pub chunk: Chunk<D>,
    /// Kinetic energy that the merge would remove, J; `None` if the group is not within the other limits
    /// either.
    pub energy: Vec<Option<f64>>,
}

/// Merges each group into a particle of a level, and finds which groups are within the limits. Identifiers of
/// the others are added to `refused`.
pub(super) fn mixtures<const D: usize>(
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    limits: &Limits,
    mut groups: Vec<Group>,
    level: u8,
    refused: &mut FxHashSet<u64>,
) -> Mixtures<D> {
    // The quickest test comes first.
    keep(&mut groups, chunk, refused, |_, group| {
        is_alike(chunk, group, limits) && has_like_histories(chunk, group, setting)
    });
    let members: Vec<u32> = groups.iter().flat_map(|group| &group.members).copied().collect();
    let half = setting.territories(chunk, Select::List(&members));
    let ahead = setting.ways_to_mass_centres(chunk, &members);
    let mut out = chunk.gathered(&groups.iter().map(|group| group.members[0]).collect::<Vec<u32>>());
    let mut motions = Vec::with_capacity(groups.len());
    let mut start = 0;
    for (number, group) in groups.iter().enumerate() {
        let range = start..start + group.members.len();
        start = range.end;
        let boxes = (&half[range.clone()], &ahead[range]);
        motions.push(mix_motion(&mut out, number, chunk, setting, group, boxes));
    }
    let close = keep(&mut groups, chunk, refused, |number, group| {
        let material = usize::from(Tag::unpack(chunk.tags()[group.members[0] as usize]).material);
        motions[number].difference <= limits.velocity * setting.scheme.materials[material].wave_speed()
    });
    let mut out = out.gathered(&close);
    let motions: Vec<&Motion<D>> = close.iter().map(|&number| &motions[number as usize]).collect();

    let members: Vec<u32> = groups.iter().flat_map(|group| &group.members).copied().collect();
    let strain = hencky(chunk, &members);
    let mut energy = Vec::with_capacity(groups.len());
    let mut strains = Vec::with_capacity(groups.len());
    let mut start = 0;
    for (number, group) in groups.iter().enumerate() {
        let range = start..start + group.members.len();
        start = range.end;
        let packed = chunk.tags()[group.members[0] as usize];
        let tag = halvings::with(packed, Tag { level, ..Tag::unpack(packed) });
        out.ids_mut()[number] = group.id;
        out.tags_mut()[number] =
            group.rejoined.map_or(tag, |axis| halvings::rejoined(tag, axis, ids::generation(group.id)));
        let (mean, difference) = mix_matter(&mut out, number, chunk, setting, group, &strain[range]);
        let close = difference.strain <= limits.strain
            && difference.volume <= limits.volume
            && difference.history <= limits.history;
        energy.push(close.then_some(motions[number].energy));
        strains.push(mean);
    }
    restore(&mut out, setting, &strains);

    for (number, half) in setting.territories(&out, Select::All).iter().enumerate() {
        let tag = Tag::unpack(out.tags()[number]);
        // A box that just fits does so to round-off.
        let nominal = setting.nominal(tag, level) * (1.0 + 1e-9);
        let reach = if groups[number].is_family { limits.stretch } else { limits.stretch + 0.5 };
        let exceeds = |halves: &[f64; D], limit: f64| halves.iter().any(|&half| half > limit * nominal);
        if exceeds(half, limits.stretch) || exceeds(&motions[number].reach, reach) {
            energy[number] = None;
        }
        // Strangers that fill less than half of a particle of the level become one of the finer level, which
        // may merge again; as one of the coarser level it would split into tiny particles as soon as it
        // entered finer cells.
        let whole = (0..D).fold(1.0, |volume, _| volume * 2.0 * setting.nominal(tag, level));
        if !groups[number].is_family && setting.section(&out, number) < 0.5 * whole * (1.0 - 1e-9) {
            out.tags_mut()[number] = halvings::with(out.tags()[number], Tag { level: level + 1, ..tag });
        }
    }
    Mixtures { groups, chunk: out, energy }
}

/// Keeps the groups that pass and returns their numbers; identifiers of all others are added to `refused`.
fn keep<const D: usize>(
    groups: &mut Vec<Group>,
    chunk: &Chunk<D>,
    refused: &mut FxHashSet<u64>,
    passes: impl Fn(usize, &Group) -> bool,
) -> Vec<u32> {
    let mut kept = Vec::with_capacity(groups.len());
    let mut number = 0;
    groups.retain(|group| {
        let stays = passes(number, group);
        if stays {
            kept.push(number as u32);
        } else {
            refused.extend(group.members.iter().map(|&p| chunk.ids()[p as usize]));
        }
        number += 1;
        stays
    });
    kept
}

/// False if a member differs from the first by so much that one of them must be too far from the mean, even
/// if both are at the limit on opposite sides. Strains are not known yet; as `|a - b| <= λ |ln a - ln b|` for
/// the greatest eigenvalue λ of two positive definite tensors, which is below the greater trace, those of b
/// give a bound.
fn is_alike<const D: usize>(chunk: &Chunk<D>, group: &Group, limits: &Limits) -> bool {
    let first = group.members[0] as usize;
    let within = |column: usize, limit: f64| {
        let values = chunk.column(column);
        group.members.iter().all(|&p| (values[p as usize] - values[first]).abs() <= 2.0 * limit)
    };
    let strains_may_be = || {
        let tensor = |p: usize| symmetric(chunk, Layout::<D>::LEFT_CAUCHY_GREEN, p);
        let trace = |b: &[f64; 6]| b[0] + b[1] + b[2];
        let own = tensor(first);
        group.members[1..].iter().all(|&p| {
            let other = tensor(p as usize);
            let difference: [f64; 6] = std::array::from_fn(|c| other[c] - own[c]);
            // Hencky strains are halves of logarithms.
            let bound = 4.0 * limits.strain * trace(&own).max(trace(&other));
            square(&difference).sqrt() <= bound * (1.0 + 1e-9) + 1e-12
        })
    };
    within(Layout::<D>::PLASTIC_STRAIN, limits.history)
        && within(Layout::<D>::PLASTIC_VOLUME, limits.volume)
        && strains_may_be()
}

/// Whether the material lets particles with the histories of a group become one.
fn has_like_histories<const D: usize>(chunk: &Chunk<D>, group: &Group, setting: &Setting<D>) -> bool {
    let history = |p: u32| -> [f64; HISTORIES] { chunk.read(Layout::<D>::HISTORY, p as usize) };
    let [first, others @ ..] = group.members.as_slice() else { return true };
    let material = Tag::unpack(chunk.tags()[*first as usize]).material;
    let material = &setting.scheme.materials[usize::from(material)];
    let own = history(*first);
    others.iter().all(|&p| material.alike(&own, &history(p)))
}
