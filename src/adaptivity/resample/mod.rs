//! Splitting and merging of particles, so that their size follows that of the cells.
//!
//! Pure functions on the chunk of one leaf: they use neither tree nor ranks, and the result depends on the
//! content of the chunk alone. After either, particles may lie in another leaf (children do where a box
//! crosses a face), so the caller sorts them into leaves afterwards. `docs/design/resampling.md` derives
//! which quantities are conserved.
use crate::kernel::{BoxPolicy, Coordinates, Scheme, Select, Transfer, domain};
use crate::particle::chunk::{Chunk, Layout, Tag};

pub mod cell_fit;
mod drift;
pub mod family;
pub(crate) mod halve;
pub mod ids;
pub mod ledger;
mod merge;
pub mod merge_backoff;
mod mixture;
mod pair;
mod rings;
mod split;
#[cfg(test)]
mod tests;

pub use drift::Gap;
pub use merge::{Limits, Merged, merge};
pub use split::{Split, split};

/// Input of splitting and merging, beside the particles of a leaf.
#[derive(Clone, Copy)]
pub struct Setting<'a, const D: usize> {
    /// Box policy, transfer and materials.
    pub scheme: &'a Scheme<'a>,
    /// Upper corner of the domain, m.
    pub extent: [f64; D],
    /// Level of the leaf.
    pub level: u8,
    /// Half width of an undeformed particle of level 0 by body, m: half a cell of level 0 over the particles
    /// per cell and direction. On level k it is this over 2^k.
    pub nominal: &'a [f64],
    /// Particles that are tried for a merge.
    pub turn: merge_backoff::RetrySlot,
}

impl<const D: usize> Setting<'_, D> {
    /// Edge of a cell of the leaf, m.
    fn cell(&self) -> f64 {
        self.scheme.root_cell / f64::from(1u32 << self.level.min(31))
    }

    /// Half width of an undeformed particle of a level, m.
    fn nominal(&self, tag: Tag, level: u8) -> f64 {
        self.nominal[usize::from(tag.body)] / f64::from(1u32 << level.min(31))
    }

    /// Half widths of the space that belongs to each of the selected particles, m: its box, except that boxes
    /// of one cell overlap those of their neighbours, so that there the part of the box counts that the
    /// particle's volume fills. Cut at the walls of the domain.
    fn territories(&self, chunk: &Chunk<D>, select: Select) -> Vec<[f64; D]> {
        let cell = self.cell();
        let mut out = Vec::new();
        domain::full_half_widths(chunk, select, cell, &self.extent, self.scheme, &mut out);
        if self.scheme.boxes == BoxPolicy::Cell {
            let by_volume = Scheme { boxes: BoxPolicy::default(), ..*self.scheme };
            let mut filled = Vec::new();
            domain::full_half_widths(chunk, select, cell, &self.extent, &by_volume, &mut filled);
            for (half, filled) in out.iter_mut().zip(filled) {
                *half = std::array::from_fn(|axis| half[axis].min(filled[axis]));
            }
        }
        out
    }

    /// Distances (m) along the first axis from the positions of the selected particles to their centres of
    /// mass; 0 but for rings.
    fn ways_to_mass_centres(&self, chunk: &Chunk<D>, which: &[u32]) -> Vec<f64> {
        if !self.has_rings() {
            return vec![0.0; which.len()];
        }
        let (cell, mut half) = (self.cell(), Vec::new());
        domain::full_half_widths(chunk, Select::List(which), cell, &self.extent, self.scheme, &mut half);
        let radius = |p: u32| chunk.position(p as usize)[0];
        let to_centre = |half: &[f64; D], x: f64| self.scheme.coordinates.to_mass_centre(half[0], x);
        half.iter().zip(which).map(|(half, &p)| to_centre(half, radius(p))).collect()
    }

    /// Area (3D: volume) of a particle's undeformed box, m²: of a ring, that of a section with its volume at
    /// its radius.
    fn section(&self, chunk: &Chunk<D>, p: usize) -> f64 {
        volume(chunk, p) / self.scheme.coordinates.around(chunk.position(p)[0])
    }

    fn has_rings(&self) -> bool {
        self.scheme.coordinates == Coordinates::Axisymmetric
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
            match ids::generation(id) < ids::GENERATIONS {
                true => wanted.which.push(p as u32),
                false => wanted.refused += 1,
            }
        }
    }
    wanted
}

/// Reference volume of particle `p`, m³ (m² in plane strain).
fn volume<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    let edge = 2.0 * chunk.column(Layout::<D>::HALF)[p];
    (1..D).fold(edge, |volume, _| volume * edge)
}

/// Velocity gradient (1/s) that a transfer keeps in the affine matrix of a particle whose weights have these
/// second moments, m².
fn gradient<const D: usize>(transfer: Transfer, matrix: &[[f64; D]; D], spread: &[f64; D]) -> [[f64; D]; D] {
    match transfer {
        Transfer::Apic => matrix.map(|row| std::array::from_fn(|k| row[k] / spread[k])),
        Transfer::Tpic => *matrix,
        Transfer::Flip { .. } | Transfer::Xpic { .. } => [[0.0; D]; D],
    }
}

/// The affine columns of particle `p` as a matrix.
fn read_matrix<const D: usize>(chunk: &Chunk<D>, p: usize) -> [[f64; D]; D] {
    std::array::from_fn(|i| chunk.read(Layout::<D>::AFFINE + D * i, p))
}

/// Places at a distance of about `offset` on both sides of x within the domain, whose mean is x exactly.
fn sides(x: f64, offset: f64, extent: f64) -> (f64, f64) {
    // At most half the distance to a wall: a box is wider than that only within a millionth of a cell of the
    // wall.
    let offset = offset.min(0.5 * x).min(0.5 * (extent - x)).max(0.0);
    let (lower, upper) = opposite(x, offset);
    if upper < extent { (lower, upper) } else { (x, x) }
}

/// `(a - b', a + b')` with b' next to b, such that both are exact where `|b| <= |a|`; else rounded.
fn opposite(a: f64, b: f64) -> (f64, f64) {
    // Away from zero numbers are coarser. The part of b that the sum retains is a multiple of the spacing of
    // numbers at a, so subtracting it again is exact.
    let far = a + b.abs().copysign(a);
    let near = a - (far - a);
    if b.is_sign_negative() == a.is_sign_negative() { (near, far) } else { (far, near) }
}

/// Writes the affine columns of particle `p` from a matrix.
fn write_matrix<const D: usize>(chunk: &mut Chunk<D>, p: usize, matrix: &[[f64; D]; D]) {
    for (i, row) in matrix.iter().enumerate() {
        chunk.write(Layout::<D>::AFFINE + D * i, p, row);
    }
}
