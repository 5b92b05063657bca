//! When a merge that could not be is tried again.
//!
//! Particles that are finer than their leaf are tried at every regrid at first, then more and more rarely, since what
//! keeps them apart does not go away soon as a rule, and looking is dear. How often a particle has been tried in vain is
//! part of its state: eight bits of its packed tag. The time between two tries becomes four times as long with each, so that nobody
//! waits longer than about four times what was needed. From every sixteenth regrid on leaves have their turns at different
//! regrids, so that the work is spread.
//!
//! Particles whose siblings may still come are tried eight times, at every regrid, and eight times at every second, before
//! they take their chance with strangers: siblings meet across faces of leaves only at the right turn (see [`super::family`]), which is one of
//! three or seven, and the same for all leaves. Families that met and were too different go on. Those in leaves beside finer ones, which keep siblings apart as well, go on
//! waiting instead, and begin anew when the finer leaves are gone.
use rustc_hash::FxHashSet;

use crate::particle::Chunk;
use crate::particle::chunk::Tag;

/// Lowest bit of the count in a packed tag.
const SHIFT: u32 = 40;
/// All bits of the count.
const COUNT: u64 = 0x7f << SHIFT;
/// Bit of particles whose whole family has been seen together, if not yet close enough.
const MET: u64 = 1 << 47;
/// All that is noted in a tag.
const BITS: u64 = COUNT | MET;
/// By how much the count grows from one interval to the next, which is twice as long. A particle that limits keep from merging goes on
/// by two of them.
const DOUBLING: u64 = 8;
/// Greatest count of a particle that limits keep from merging: tried at one regrid of 256.
const REFUSED: u64 = 8 * DOUBLING;
/// Greatest count of a particle that waits for its siblings, or is too near to finer leaves: at one of 64.
const WAITING: u64 = 6 * DOUBLING;
/// Greatest count of one of a family that has been seen together: at one of eight, when all leaves have their turn.
const TOGETHER: u64 = 4 * DOUBLING - 1;
/// Count from which on nobody waits for siblings who have not come, and most likely have become one with others: after
/// all turns of the axes.
const GIVEN_UP: u64 = 2 * DOUBLING;
/// Count of a particle that waits for siblings, or to get away from finer leaves, as long as its leaf is beside finer ones.
const PARKED: u64 = 0x7f;
/// Bits of the level in a packed tag.
const LEVEL: u64 = 0xff << 32;

/// The packed tag without its count.
pub fn plain(tag: u64) -> u64 {
    tag & !BITS
}

/// Who in a leaf is tried at a regrid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetrySlot {
    /// One bit for each interval between tries.
    intervals: u32,
    /// Whether finer leaves touch the leaf.
    beside_finer: bool,
}

impl RetrySlot {
    /// Everybody, in a leaf that is not beside finer ones.
    pub const ALL: Self = Self { intervals: u32::MAX, beside_finer: false };

    /// At regrid `number` in the leaf that begins at a key of the curve.
    pub fn new(number: u64, leaf: u64, beside_finer: bool) -> Self {
        let own = number.wrapping_add(leaf.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 48);
        let is_due = |interval: u64| match interval {
            _ if interval == PARKED / DOUBLING => !beside_finer || own & 63 == 0,
            _ if interval <= TOGETHER / DOUBLING => number & ((1 << interval) - 1) == 0,
            _ => own & ((1 << interval) - 1) == 0,
        };
        let due = (0..=PARKED / DOUBLING).filter(|&interval| is_due(interval));
        Self { intervals: due.fold(0, |bits, interval| bits | 1 << interval), beside_finer }
    }

    /// Whether a particle that is finer than the leaf is tried.
    pub fn has(self, tag: u64) -> bool {
        self.intervals & interval(tag) != 0
    }
}

/// How often a particle has been tried, more or less.
fn count_of(tag: u64) -> u64 {
    (tag & COUNT) >> SHIFT
}

/// The bit of a particle's interval between tries.
fn interval(tag: u64) -> u32 {
    1 << (count_of(tag) / DOUBLING)
}

/// Whether a particle has been tried so often that it stops waiting for siblings that are not there.
pub fn has_given_up(tag: u64) -> bool {
    tag & MET == 0 && (GIVEN_UP..PARKED).contains(&count_of(tag))
}

/// Particles of a chunk made for a level that are due.
pub fn due<const D: usize>(chunk: &Chunk<D>, level: u8, turn: RetrySlot) -> Vec<u32> {
    let level = u64::from(level) << 32;
    let each = (0..).zip(chunk.tags());
    each.filter(|(_, tag)| **tag & LEVEL == level && turn.has(**tag)).map(|(p, _)| p).collect()
}

/// Whether all tags are of a level, as in a tag, and without counts: those of most leaves are.
fn are_plain(tags: &[u64], level: u64) -> bool {
    tags.iter().fold(0, |differs, tag| differs | (tag ^ level)) & (LEVEL | BITS) == 0
}

/// What the tags of a chunk say, without the level of its leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Levels {
    /// Coarsest level that a particle was made for, as in a tag.
    coarsest: u64,
    /// Intervals of these particles.
    of_coarsest: u32,
    /// Intervals of all others.
    of_finer: u32,
    /// Whether one of the coarsest has been tried.
    tried: bool,
}

impl Levels {
    /// Of some tags.
    pub fn of(tags: &[u64]) -> Self {
        let coarsest = tags.iter().fold(LEVEL, |least, tag| least.min(tag & LEVEL));
        let mut levels = Self { coarsest, of_coarsest: 0, of_finer: 0, tried: false };
        if are_plain(tags, coarsest) {
            levels.of_coarsest = u32::from(!tags.is_empty());
            return levels;
        }
        for &tag in tags {
            if tag & LEVEL == coarsest {
                levels.of_coarsest |= interval(tag);
                levels.tried |= tag & BITS != 0;
            } else {
                levels.of_finer |= interval(tag);
            }
        }
        levels
    }

    /// What this means in a leaf of a level; `None` if particles of the leaf's level cannot be told from others.
    pub fn look(self, level: u8, turn: RetrySlot) -> Option<BackoffState> {
        let (finer, stale) = match self.coarsest.cmp(&(u64::from(level) << 32)) {
            _ if self.of_coarsest == 0 => (0, false),
            std::cmp::Ordering::Less => return None,
            std::cmp::Ordering::Equal => (self.of_finer, self.tried),
            std::cmp::Ordering::Greater => (self.of_finer | self.of_coarsest, false),
        };
        Some(BackoffState { coarser: false, due: turn.intervals & finer != 0, stale })
    }
}

/// How the particles of a chunk fit a leaf of a level.
pub fn look<const D: usize>(chunk: &Chunk<D>, level: u8, turn: RetrySlot) -> BackoffState {
    let own = u64::from(level) << 32;
    let mut look = BackoffState::default();
    if are_plain(chunk.tags(), own) {
        return look;
    }
    for &tag in chunk.tags() {
        let is_finer = tag & LEVEL > own;
        look.coarser |= tag & LEVEL < own;
        look.stale |= !is_finer & (tag & BITS != 0);
        look.due |= is_finer & turn.has(tag);
    }
    look
}

/// What [`look`] sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BackoffState {
    /// Particles made for coarser leaves.
    pub coarser: bool,
    /// Particles made for finer leaves, some of them due.
    pub due: bool,
    /// Particles that fit their leaf have been tried elsewhere.
    pub stale: bool,
}

/// After a turn: counts those that were tried in vain, and forgets about those that fit the leaf. `refused`: identifiers
/// of those that the limits keep apart.
pub fn count<const D: usize>(chunk: &mut Chunk<D>, level: u8, turn: RetrySlot, refused: &FxHashSet<u64>) {
    for p in 0..chunk.len() {
        let (tag, id) = (chunk.tags()[p], chunk.ids()[p]);
        if Tag::unpack(tag).level <= level {
            chunk.tags_mut()[p] = plain(tag);
        } else if turn.has(tag) {
            chunk.tags_mut()[p] = tried_again(tag, refused.contains(&id), turn.beside_finer);
        }
    }
}

/// Notes that the families of some particles (identifiers) have been seen together.
pub fn met<const D: usize>(chunk: &mut Chunk<D>, together: &FxHashSet<u64>) {
    for p in 0..if together.is_empty() { 0 } else { chunk.len() } {
        if together.contains(&chunk.ids()[p]) {
            chunk.tags_mut()[p] |= MET;
        }
    }
}

/// The tag after one more try in vain.
fn tried_again(tag: u64, is_refused: bool, beside_finer: bool) -> u64 {
    let tries = count_of(tag);
    let tries = match (is_refused, tries) {
        (true, PARKED) => GIVEN_UP + DOUBLING,
        (true, _) => (tries + 2 * DOUBLING).min(REFUSED),
        (false, PARKED) if beside_finer => PARKED,
        (false, PARKED) => 0,
        (false, _) if beside_finer && tries + 1 == GIVEN_UP => PARKED,
        (false, _) if tag & MET != 0 => (tries + 1).min(TOGETHER.max(tries)),
        (false, _) => (tries + 1).min(WAITING.max(tries)),
    };
    tag & !COUNT | tries << SHIFT
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regrids at which a particle is tried when nothing comes of it.
    fn turns(leaf: u64, refused: bool, beside_finer: impl Fn(u64) -> bool) -> Vec<u64> {
        let mut chunk = Chunk::<2>::new();
        let (tag, id) = (Tag { material: 1, body: 2, level: 3 }, 7);
        chunk.push_zeroed(id, tag);
        let mut tried = Vec::new();
        let refused = if refused { FxHashSet::from_iter([id]) } else { FxHashSet::default() };
        for number in 0..1100 {
            let turn = RetrySlot::new(number, leaf, beside_finer(number));
            let look = look(&chunk, 2, turn);
            assert!(!look.coarser && !look.stale);
            assert_eq!(Levels::of(chunk.tags()).look(2, turn), Some(look));
            if look.due {
                tried.push(number);
                count(&mut chunk, 2, turn, &refused);
                assert_eq!(Tag::unpack(chunk.tags()[0]), tag);
            }
        }
        let fits = Levels::of(chunk.tags());
        assert!(
            look(&chunk, 3, RetrySlot::ALL).stale
                && fits.look(3, RetrySlot::ALL).is_some_and(|look| look.stale)
        );
        assert!(look(&chunk, 4, RetrySlot::ALL).coarser && fits.look(4, RetrySlot::ALL).is_none());
        count(&mut chunk, 3, RetrySlot::ALL, &FxHashSet::default());
        assert_eq!(chunk.tags()[0], tag.pack());
        assert_eq!(Levels::of(chunk.tags()).look(3, RetrySlot::ALL), Some(BackoffState::default()));
        tried
    }

    #[test]
    fn ever_more_rarely() {
        assert_eq!(turns(0, true, |_| false), [0, 4, 16, 64, 256, 512, 768, 1024]);
        let waiting = turns(0, false, |_| false);
        // All turns of the axes come round before siblings are given up.
        assert_eq!(waiting[..18], [0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 22, 24, 28]);
        assert_eq!(waiting[waiting.len() - 2..], [1024, 1088]);
        // Beside finer leaves nobody gives up; once these are gone, all turns of the axes come again.
        let parked = turns(0, false, |number| number < 601);
        assert_eq!(parked[14..18], [20, 22, 64, 128]);
        let freed = parked.iter().position(|&number| number == 601).expect("tried at once");
        assert_eq!(parked[freed..][..10], [601, 602, 603, 604, 605, 606, 607, 608, 609, 610]);
        // Other leaves, other times.
        let others = turns(5 << 40, true, |_| false);
        assert_eq!(others[..2], [0, 4]);
        assert!(
            others[3..].windows(2).all(|pair| pair[1] - pair[0] <= 256) && !others.contains(&1024),
            "{others:?}"
        );
    }

    #[test]
    fn levels_of_several() {
        let mut chunk = Chunk::<3>::new();
        assert_eq!(Levels::of(chunk.tags()).look(0, RetrySlot::ALL), Some(BackoffState::default()));
        for (id, level) in [4, 2, 3, 2].into_iter().enumerate() {
            chunk.push_zeroed(id as u64, Tag { material: 0, body: 0, level });
        }
        for number in 0..40 {
            for level in 1..=2 {
                let turn = RetrySlot::new(number, 0, false);
                let seen = look(&chunk, level, turn);
                assert_eq!(Levels::of(chunk.tags()).look(level, turn), Some(seen));
                count(&mut chunk, 2, turn, &FxHashSet::from_iter([1, 2]));
            }
        }
    }
}
