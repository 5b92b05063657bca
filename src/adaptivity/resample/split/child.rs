//! State that every part of a particle takes from it.
use crate::adaptivity::resample::{Setting, ids};
use crate::particle::chunk::{Chunk, Tag};
use crate::particle::halvings;

/// Leaves a part of a particle its share of what the whole carried for loads.
pub(super) fn hand_share<const D: usize>(chunk: &mut Chunk<D>, setting: &Setting<D>, p: usize, share: f64) {
    let shares = chunk.carried_columns().min(setting.scheme.shares);
    (0..shares).for_each(|column| chunk.carried_mut(column)[p] *= share);
}

/// Gives a copy of a particle the identifier and the level of its child of this number.
pub(super) fn make_child<const D: usize>(chunk: &mut Chunk<D>, p: usize, child: usize) {
    let parent = chunk.ids()[p];
    chunk.ids_mut()[p] = ids::child::<D>(parent, child).unwrap_or(parent);
    let packed = halvings::otherwise_split(chunk.tags()[p], ids::generation(parent));
    let tag = Tag::unpack(packed);
    chunk.tags_mut()[p] = halvings::with(packed, Tag { level: tag.level + 1, ..tag });
}
