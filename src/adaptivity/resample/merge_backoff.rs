//! Backoff of failed merges: the regrids at which a merge is tried again.
//!
//! A particle finer than its leaf is tried at every regrid at first, then more and more rarely, since a merge
//! that fails once usually fails again, and each try is expensive. Seven bits of its packed tag count its
//! failed tries; the interval between tries doubles every eight counts. An eighth bit, `MET`, is set once all
//! its siblings have been in one leaf.
//!
//! | state | a failed try adds | tried at one regrid in | until |
//! |---|---|---|---|
//! | waiting for siblings | 1 | 1, then 2 | it gives up after 16 tries |
//! | given up: merges with strangers too | 1 | 4 to 64 | it merges |
//! | siblings met, but too far apart | 1 | 1 to 8 | it merges |
//! | refused by the limits | 16 | 4 times as many, to 256 | it merges |
//! | parked: after 16 tries beside finer leaves | 0 | 64 | no finer leaf is beside; then it waits anew |
//!
//! So no particle waits longer than about four times the time needed. Up to intervals of 8 all leaves have
//! the same regrids, since siblings meet across faces of leaves only at the regrids of one combination of
//! axes of three or seven (see [`super::family`]). Longer intervals fall on other regrids from leaf to leaf,
//! which spreads the work. Finer leaves separate siblings too, so beside them a particle parks and does not
//! give up. The count of a particle that fits its leaf is cleared.
use rustc_hash::FxHashSet;

use crate::particle::Chunk;
use crate::particle::chunk::Tag;

/// Lowest bit of the count in a packed tag.
const SHIFT: u32 = 40;
/// All bits of the count.
const COUNT: u64 = 0x7f << SHIFT;
/// Bit of particles whose whole family has been seen together, if not yet close enough.
const MET: u64 = 1 << 47;
/// All bits of the tag that belong to the backoff.
const BITS: u64 = COUNT | MET;
/// Increase of the count from one interval to the next, which is twice as long. A particle that the limits
/// refuse advances by two intervals.
const DOUBLING: u64 = 8;
/// Greatest count of a particle that the limits refuse: tried at one regrid in 256.
const REFUSED: u64 = 8 * DOUBLING;
/// Greatest count of a particle whose family is incomplete: tried at one regrid in 64.
const WAITING: u64 = 6 * DOUBLING;
/// Greatest count of a particle whose family has been seen together: tried at one regrid in 8, the same in
/// all leaves.
const TOGETHER: u64 = 4 * DOUBLING - 1;
/// Count from which on a particle stops waiting for missing siblings, which most likely have merged with
/// others: after all combinations of axes have had their turn.
const GIVEN_UP: u64 = 2 * DOUBLING;
/// Count of a particle that keeps waiting, as its leaf touches finer ones.
const PARKED: u64 = 0x7f;
/// Bits of the level in a packed tag.
const LEVEL: u64 = 0xff << 32;

/// The packed tag without its count.
pub fn plain(tag: u64) -> u64 {
    tag & !BITS
}

/// Particles of a leaf that are tried at a regrid, by their interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetrySlot {
    /// One bit for each interval between tries.
    intervals: u32,
    /// Whether finer leaves touch the leaf.
    beside_finer: bool,
}

impl RetrySlot {
    /// All particles, in a leaf that touches no finer ones.
    pub const ALL: Self = Self { intervals: u32::MAX, beside_finer: false };

    /// Slot of regrid `number` in the leaf that begins at a key of the curve.
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

/// Count of a particle: about the number of tries.
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

/// Whether all tags have a level (as packed in a tag) and no count: the case in most leaves.
fn are_plain(tags: &[u64], level: u64) -> bool {
    tags.iter().fold(0, |differs, tag| differs | (tag ^ level)) & (LEVEL | BITS) == 0
}

/// Summary of the tags of a chunk, independent of the level of its leaf.
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
    /// Summary of some tags.
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

    /// State in a leaf of a level; `None` if the summary does not separate particles of the leaf's level from
    /// others.
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

/// State of the particles of a chunk in a leaf of a level.
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

/// State of the particles of a leaf with respect to its level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BackoffState {
    /// Whether there are particles made for coarser leaves.
    pub coarser: bool,
    /// Whether particles made for finer leaves are due.
    pub due: bool,
    /// Whether particles that fit the leaf still have a count from another leaf.
    pub stale: bool,
}

/// Updates the counts after a regrid: increases those of particles tried in vain, and clears those of
/// particles that fit the leaf. `refused`: identifiers of particles that the limits refuse.
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

/// Marks particles (identifiers) whose families have been seen together.
pub fn met<const D: usize>(chunk: &mut Chunk<D>, together: &FxHashSet<u64>) {
    for p in 0..if together.is_empty() { 0 } else { chunk.len() } {
        if together.contains(&chunk.ids()[p]) {
            chunk.tags_mut()[p] |= MET;
        }
    }
}

/// Tag after one more try in vain.
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
        // All combinations of axes have their turn before siblings are given up.
        assert_eq!(waiting[..18], [0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 22, 24, 28]);
        assert_eq!(waiting[waiting.len() - 2..], [1024, 1088]);
        // Beside finer leaves no particle gives up; once these are gone, all combinations of axes have their
        // turn again.
        let parked = turns(0, false, |number| number < 601);
        assert_eq!(parked[14..18], [20, 22, 64, 128]);
        let freed = parked.iter().position(|&number| number == 601).expect("tried at once");
        assert_eq!(parked[freed..][..10], [601, 602, 603, 604, 605, 606, 607, 608, 609, 610]);
        // Other leaves have other regrids.
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
