//! Identifiers that encode the family of a particle.
//!
//! From the lowest bit: the *root*, the number that seeding or a merge of strangers gave; the *path*, one
//! child number of `D` bits per split, the first split lowest; and in the three highest bits the
//! *generation*, the number of splits. A seeded particle has generation 0, so its identifier is its root.
//!
//! Identifiers of living particles are unique, by this invariant: none is an ancestor of another, where the
//! ancestors of an identifier are its parent, the parent of that, and so on. It holds for different roots; a
//! split replaces a living identifier by all its children; the merge of a complete family does the reverse,
//! and as all children were alive none of them had living descendants; any other merge takes identifiers away
//! and keeps one of them, or uses a root that no particle had before.
use crate::particle::Chunk;

/// Greatest number of splits between a particle and its root.
pub const GENERATIONS: u32 = 7;
/// Lowest bit of the generation.
const GENERATION_SHIFT: u32 = 61;

/// Bits of the root: 47 in plane strain, 40 in 3D.
const fn root_bits(dimension: usize) -> u32 {
    GENERATION_SHIFT - GENERATIONS * dimension as u32
}

/// Number of roots that identifiers have room for: 1.4e14 in plane strain, 1.1e12 in 3D.
pub const fn roots(dimension: usize) -> u64 {
    1 << root_bits(dimension)
}

/// Number of splits between a particle and its root.
pub fn generation(id: u64) -> u32 {
    (id >> GENERATION_SHIFT) as u32
}

/// Whether there is room for another generation.
pub fn has_room(id: u64) -> bool {
    generation(id) < GENERATIONS
}

/// The number that seeding, or a merge of strangers, gave to the oldest ancestor.
pub fn root<const D: usize>(id: u64) -> u64 {
    id & (roots(D) - 1)
}

/// Greatest root in a chunk, if it has particles.
pub fn highest_root<const D: usize>(chunk: &Chunk<D>) -> Option<u64> {
    chunk.ids().iter().map(|&id| root::<D>(id)).max()
}

/// Identifier of child `number` (below `2^D`); `None` if there is no room for another generation.
pub fn child<const D: usize>(id: u64, number: usize) -> Option<u64> {
    let path = (number as u64) << (root_bits(D) + generation(id) * D as u32);
    has_room(id).then(|| (id | path) + (1 << GENERATION_SHIFT))
}

/// Identifier of the parent and the number among its children; `None` for generation 0.
pub fn parent<const D: usize>(id: u64) -> Option<(u64, usize)> {
    let before = generation(id).checked_sub(1)?;
    let shift = root_bits(D) + before * D as u32;
    let number = id >> shift & ((1 << D) - 1);
    Some(((id & !(number << shift)) - (1 << GENERATION_SHIFT), number as usize))
}

/// Whether two identifiers are the same, or one is an ancestor of the other.
pub fn are_kin<const D: usize>(a: u64, b: u64) -> bool {
    let bits = root_bits(D) + generation(a).min(generation(b)) * D as u32;
    (a ^ b) & ((1 << bits) - 1) == 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn check<const D: usize>() {
        for seed in [0, 1, 12_345, roots(D) - 1] {
            let mut generation_of_ids = vec![seed];
            let mut seen = BTreeSet::from([seed]);
            for depth in 1..=3 {
                let mut next = Vec::new();
                for id in generation_of_ids {
                    for number in 0..1 << D {
                        let child = child::<D>(id, number).unwrap();
                        assert_eq!(parent::<D>(child), Some((id, number)));
                        assert_eq!((root::<D>(child), generation(child)), (seed, depth));
                        assert!(are_kin::<D>(id, child) && are_kin::<D>(child, seed));
                        assert!(!next.iter().any(|&other| are_kin::<D>(child, other)));
                        assert!(seen.insert(child));
                        next.push(child);
                    }
                }
                generation_of_ids = next;
            }
            let last = |id| child::<D>(id, (1 << D) - 1);
            let deepest = (0..GENERATIONS).try_fold(seed, |id, _| last(id)).unwrap();
            assert_eq!(last(deepest), None);
            assert_eq!(parent::<D>(seed), None);
        }
    }

    #[test]
    fn children_are_unique_and_know_their_parent() {
        check::<2>();
        check::<3>();
    }
}
