//! Particles follow the size of the cells of their leaf.
use super::merge_backoff::RetrySlot;
use super::split::moments::spread;
use super::split::{Gap, close_gaps, split};
use super::{Setting, ids};
use crate::adaptivity::Adaptivity;
use crate::kernel::{BoxPolicy, Coordinates, Scheme, Select, domain};
use crate::particle::chunk::{Chunk, Tag};

/// Splits in one leaf.
#[derive(Clone, Debug, Default)]
pub struct Splits {
    /// Particles that were split.
    pub split: u64,
    /// Particles that were not, since their identifiers have no room for another generation.
    pub refused: u64,
    /// Kinetic energy that each split added, J.
    pub energies: Vec<f64>,
}

impl Splits {
    /// Whether any particle was split.
    pub fn is_any(&self) -> bool {
        self.split > 0
    }
}

/// How particles follow the size of cells.
#[derive(Clone, Copy)]
pub struct Resampling<'a, const D: usize> {
    scheme: &'a Scheme<'a>,
    extent: [f64; D],
    nominal: &'a [f64],
    stretch: Option<f64>,
    gap: Option<Gap>,
    solid_strangers: bool,
}

impl<'a, const D: usize> Resampling<'a, D> {
    /// For a domain with its upper corner at `extent` (m); `None` if the job has no splitting and merging.
    pub fn new(
        adaptivity: Option<&'a Adaptivity<D>>,
        scheme: &'a Scheme<'a>,
        extent: [f64; D],
    ) -> Option<Self> {
        let adaptivity = adaptivity?;
        let (nominal, stretch) = (&adaptivity.nominal[..], adaptivity.split_stretch);
        // The stretch of neighbours' distances follows the columns carried for loads.
        let gap = adaptivity.split_gap.map(|cells| Gap { cells, column: scheme.shares });
        // Particles of solids keep their neighbours, so siblings meet again in a tree that stays as it is.
        let solid_strangers = adaptivity.is_refining();
        Some(Self { scheme, extent, nominal, stretch, gap, solid_strangers })
    }

    fn setting(&self, level: u8) -> Setting<'a, D> {
        let Self { scheme, extent, nominal, solid_strangers, .. } = *self;
        Setting { scheme, extent, level, nominal, turn: RetrySlot::ALL, solid_strangers }
    }

    /// For merges in a leaf of a level.
    pub fn setting_at(&self, level: u8, turn: RetrySlot) -> Setting<'a, D> {
        Setting { turn, ..self.setting(level) }
    }

    /// Stretch of boxes from which on particles split, if the job says so.
    pub fn stretch(&self) -> Option<f64> {
        self.stretch
    }

    /// Whether particles split where they drift apart.
    pub fn closes_gaps(&self) -> bool {
        self.gap.is_some()
    }

    /// Splits particles that have drifted apart, until none has. Their affine state comes from cells of level
    /// `from`.
    fn close_gaps(&self, chunk: &mut Chunk<D>, level: u8, from: u8, done: &mut Splits) {
        let Some(gap) = self.gap else { return };
        let from = self.setting(from);
        loop {
            let energies = &mut done.energies;
            let split =
                close_gaps(chunk, &self.setting(level), gap, |chunk, p| spread(chunk, p, &from), &mut |e| {
                    energies.push(e)
                });
            done.split += split;
            if split == 0 {
                return;
            }
        }
    }

    /// Splits the listed particles (ascending), whose affine state comes from cells of `level`.
    pub fn split(&self, chunk: &mut Chunk<D>, which: &[u32], level: u8, done: &mut Splits) {
        let from = self.setting(level);
        let spreads: Vec<[f64; D]> = which.iter().map(|&p| spread(chunk, p as usize, &from)).collect();
        let report = split(chunk, &self.setting(level), which, &spreads, &mut |e| done.energies.push(e));
        done.split += report.split;
        done.refused += report.refused;
    }

    /// Splits particles of a leaf that are too large for it until none is. Their affine state comes from
    /// cells of level `from`.
    pub fn fit(&self, chunk: &mut Chunk<D>, level: u8, from: u8) -> Splits {
        let mut done = Splits::default();
        loop {
            let stretch =
                self.stretch.filter(|&stretch| self.may_exceed(domain::widest(chunk), level, stretch));
            let wanted = needs_split(chunk, &self.setting(level), stretch);
            if wanted.which.is_empty() {
                done.refused += wanted.refused;
                self.close_gaps(chunk, level, from, &mut done);
                return done;
            }
            self.split(chunk, &wanted.which, from, &mut done);
        }
    }

    /// Whether boxes up to `width` (m) may be wider than `stretch` times that of an undeformed particle of a
    /// level. The width of a ring depends on its radius.
    pub fn may_exceed(&self, width: f64, level: u8, stretch: f64) -> bool {
        if self.scheme.coordinates == Coordinates::Axisymmetric {
            return true;
        }
        let least = self.nominal.iter().copied().fold(f64::INFINITY, f64::min);
        width.is_nan() || width > 0.999 * stretch * least / f64::from(1u32 << level)
    }

    /// Whether particle `p` is to be split where it enters a leaf of a level: it was made for a coarser one.
    pub fn splits_in(&self, chunk: &Chunk<D>, p: usize, level: u8) -> bool {
        Tag::unpack(chunk.tags()[p]).level < level && ids::has_room(chunk.ids()[p])
    }
}

/// Particles that are too large for their leaf.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Those to split, ascending.
    pub which: Vec<u32>,
    /// Number of those that cannot be split, since their identifiers have no room for another generation.
    pub refused: u64,
}

/// Particles that [`split()`] should treat: those made for a level coarser than that of the leaf, and, where
/// boxes follow the stretch ([`BoxPolicy::Volume`]), those whose box is wider along some axis than `stretch`
/// times that of an undeformed particle of the leaf's level. The latter are measured against the leaf and not
/// against themselves, so that their children do not split again before they have stretched as much once
/// more.
pub fn needs_split<const D: usize>(chunk: &Chunk<D>, setting: &Setting<D>, stretch: Option<f64>) -> Wanted {
    let stretch = stretch.filter(|_| matches!(setting.scheme.boxes, BoxPolicy::Volume { .. }));
    let half = stretch.map(|limit| (limit, setting.territories(chunk, Select::All)));
    let mut wanted = Wanted::default();
    for (p, (&tag, &id)) in chunk.tags().iter().zip(chunk.ids()).enumerate() {
        let tag = Tag::unpack(tag);
        let too_wide = |(limit, half): &(f64, Vec<[f64; D]>)| {
            let greatest = limit * setting.nominal(tag, setting.level);
            half[p].iter().any(|&half| half > greatest)
        };
        if tag.level < setting.level || half.as_ref().is_some_and(too_wide) {
            match ids::has_room(id) {
                true => wanted.which.push(p as u32),
                false => wanted.refused += 1,
            }
        }
    }
    wanted
}
