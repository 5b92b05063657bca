//! Particles follow the size of the cells of their leaf.
use super::merge_backoff::RetrySlot;
use super::{Gap, Setting, drift, ids, needs_split, rings, split};
use crate::adaptivity::Adaptivity;
use crate::kernel::{Coordinates, Scheme, domain};
use crate::particle::chunk::{Chunk, Layout, Tag};

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
        Some(Self { scheme, extent, nominal, stretch, gap })
    }

    fn setting(&self, level: u8) -> Setting<'a, D> {
        let (scheme, extent, nominal) = (self.scheme, self.extent, self.nominal);
        Setting { scheme, extent, level, nominal, turn: RetrySlot::ALL }
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
            let split = drift::close_gaps(
                chunk,
                &self.setting(level),
                gap,
                |chunk, p| spread(chunk, p, &from),
                &mut |e| energies.push(e),
            );
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
        Tag::unpack(chunk.tags()[p]).level < level && ids::generation(chunk.ids()[p]) < ids::GENERATIONS
    }
}

/// Second moments of the weights of a particle on the lattice of the cells of a leaf, m².
fn spread<const D: usize>(chunk: &Chunk<D>, p: usize, leaf: &Setting<D>) -> [f64; D] {
    let cell = leaf.cell();
    if leaf.has_rings() {
        return rings::spread(chunk, p, cell, leaf);
    }
    let half = chunk.column(Layout::<D>::HALF)[p];
    chunk.position(p).map(|x| spread_on_lattice(x, half, cell))
}

/// Second moment of the weights of a box on a lattice of nodes, along one axis: `l²/3 + mean of d (h - d)`,
/// where d is the distance to the node below, m². The first part is that of the box, the second that of
/// linear interpolation between two nodes.
pub(super) fn spread_on_lattice(x: f64, half: f64, cell: f64) -> f64 {
    let inside = |y: f64| y - cell * (y / cell).floor();
    let box_part = half * half / 3.0;
    if half < 1e-4 * cell {
        let d = inside(x);
        return f64::mul_add(d, cell - d, box_part).max(f64::MIN_POSITIVE);
    }
    // Integral of d (h - d) from 0, each whole cell h³/6.
    let integral = |y: f64| {
        let d = inside(y);
        (y / cell).floor() * cell.powi(3) / 6.0 + d * d * (cell / 2.0 - d / 3.0)
    };
    box_part + ((integral(x + half) - integral(x - half)) / (2.0 * half)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the sums over nodes and points of a fine quadrature.
    #[test]
    fn spread_is_the_second_moment_of_the_weights() {
        let cell = 0.2;
        for (x, half) in [(0.53, 0.05), (0.6, 0.1), (0.47, 0.1), (0.71, 0.02), (0.65, 0.25), (0.55, 1e-7)] {
            let (mut sum, points) = (0.0, 20_000);
            for i in 0..points {
                let y: f64 = x + half * (2.0 * (f64::from(i) + 0.5) / f64::from(points) - 1.0);
                let below = (y / cell).floor();
                let share = y / cell - below;
                let squared = |node: f64| (node * cell - x) * (node * cell - x);
                sum += (1.0 - share) * squared(below) + share * squared(below + 1.0);
            }
            approx::assert_relative_eq!(
                spread_on_lattice(x, half, cell),
                sum / f64::from(points),
                max_relative = 1e-6
            );
        }
    }
}
