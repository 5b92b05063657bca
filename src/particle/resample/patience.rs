//! When a merge that could not be is tried again.
//!
//! Particles that are finer than their leaf are tried at every regrid at first, then more and more rarely, since what
//! keeps them apart does not go away soon as a rule, and looking is dear. How often a particle has been tried in vain is
//! part of its state: three bits of its packed tag. Turns of particles with neighbouring roots, which lie together as
//! long as nothing mixes them, come at the same time, and those of others at other times; so the work is spread.
use super::ids;
use crate::particle::Chunk;
use crate::particle::chunk::Tag;

/// Lowest bit of the count in a packed tag.
const SHIFT: u32 = 40;
/// All bits of the count.
const BITS: u64 = 7 << SHIFT;
/// Greatest count of a particle that limits keep from merging: tried at one regrid of 64.
const REFUSED: u64 = 6;
/// Greatest count of a particle that waits for its siblings, or is too near to finer leaves: at one of four.
const WAITING: u64 = 2;
/// Bits of the root that neighbours differ in: about as many particles as a leaf has.
const NEIGHBOURS: u32 = 9;

/// The packed tag without its count.
pub fn plain(tag: u64) -> u64 {
    tag & !BITS
}

/// Whether a particle is to be tried at the regrid of number `turn`.
pub fn is_due<const D: usize>(tag: u64, id: u64, turn: u64) -> bool {
    let phase = turn.wrapping_add(ids::root::<D>(id) >> NEIGHBOURS);
    phase & ((1 << ((tag & BITS) >> SHIFT)) - 1) == 0
}

/// Particles of a chunk made for a level that are due.
pub fn due<const D: usize>(chunk: &Chunk<D>, level: u8, turn: u64) -> impl Iterator<Item = u32> {
    let each = (0..).zip(chunk.tags().iter().zip(chunk.ids()));
    let of_level = each.filter(move |(_, (tag, _))| Tag::unpack(**tag).level == level);
    of_level.filter(move |(_, (tag, id))| is_due::<D>(**tag, **id, turn)).map(|(p, _)| p)
}

/// Whether a chunk in a leaf of a level has particles made for finer ones, and whether any of those is due.
pub fn look<const D: usize>(chunk: &Chunk<D>, level: u8, turn: u64) -> Look {
    const LEVEL: u64 = 0xff << 32;
    let own = u64::from(level) << 32;
    // Most leaves have particles of their own level only, without counts.
    let differs = chunk.tags().iter().fold(0, |differs, tag| differs | (tag ^ own));
    let mut look = Look { coarser: false, finer: false, due: false, stale: false };
    if differs & (LEVEL | BITS) == 0 {
        return look;
    }
    for (&tag, &id) in chunk.tags().iter().zip(chunk.ids()) {
        match (tag & LEVEL).cmp(&own) {
            std::cmp::Ordering::Less => look.coarser = true,
            std::cmp::Ordering::Equal => look.stale |= tag & BITS != 0,
            std::cmp::Ordering::Greater => {
                look.finer = true;
                look.due |= is_due::<D>(tag, id, turn);
            }
        }
    }
    look
}

/// What [`look`] sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// Particles made for coarser leaves.
    pub coarser: bool,
    /// Particles made for finer leaves.
    pub finer: bool,
    /// Some of the finer ones are due.
    pub due: bool,
    /// Particles that fit their leaf have been tried elsewhere.
    pub stale: bool,
}

/// After a turn: counts those that were tried in vain, and forgets about those that fit the leaf.
pub fn count<const D: usize>(chunk: &mut Chunk<D>, level: u8, turn: u64) {
    for p in 0..chunk.len() {
        let (tag, id) = (chunk.tags()[p], chunk.ids()[p]);
        if Tag::unpack(tag).level <= level {
            chunk.tags_mut()[p] = plain(tag);
        } else if is_due::<D>(tag, id, turn) {
            chunk.tags_mut()[p] = with_one_more(tag, WAITING);
        }
    }
}

/// Counts those that the limits keep apart, by identifier, ascending.
pub fn count_refused<const D: usize>(chunk: &mut Chunk<D>, refused: &[u64]) {
    for p in 0..chunk.len() {
        if !refused.is_empty() && refused.binary_search(&chunk.ids()[p]).is_ok() {
            chunk.tags_mut()[p] = with_one_more(chunk.tags()[p], REFUSED);
        }
    }
}

/// The tag with a count one higher, but not above `most` if it was not before.
fn with_one_more(tag: u64, most: u64) -> u64 {
    let tried = (tag & BITS) >> SHIFT;
    plain(tag) | (tried + 1).min(most.max(tried)) << SHIFT
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regrids at which a particle is tried when nothing comes of it.
    fn turns(id: u64, refused: bool) -> Vec<u64> {
        let mut chunk = Chunk::<2>::new();
        chunk.push_zeroed(id, Tag { material: 1, body: 2, level: 3 });
        let mut tried = Vec::new();
        for turn in 0..400 {
            let look = look(&chunk, 2, turn);
            assert!(look.finer && !look.coarser && !look.stale);
            if look.due {
                tried.push(turn);
                match refused {
                    true => count_refused(&mut chunk, &[id]),
                    false => count(&mut chunk, 2, turn),
                }
                assert_eq!(Tag::unpack(chunk.tags()[0]), Tag { material: 1, body: 2, level: 3 });
            }
        }
        assert!(look(&chunk, 3, 0).stale);
        count(&mut chunk, 3, 0);
        assert_eq!(chunk.tags()[0], plain(chunk.tags()[0]));
        tried
    }

    #[test]
    fn ever_more_rarely() {
        assert_eq!(turns(7, true), [0, 2, 4, 8, 16, 32, 64, 128, 192, 256, 320, 384]);
        assert_eq!(turns(7, false)[..6], [0, 2, 4, 8, 12, 16]);
        // Other roots, other times.
        assert_eq!(turns(5 << NEIGHBOURS, true)[5..8], [59, 123, 187]);
    }
}
