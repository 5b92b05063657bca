//! Octants of a brick of root octants and their Morton keys.
//!
//! All keys count cells of one lattice, the finest octants: `2^MAX_LEVEL` along each edge of a
//! root. A Morton key interleaves the bits of the coordinates on that lattice, axis 0 lowest.
//! An octant covers the keys `key()..key_end()`, and all octants that overlap it cover a part or
//! a superset of those; therefore a sorted list of leaves is the whole tree (a linear octree).

use std::cmp::Ordering;

/// Deepest level of an octant. Root octants have level 0.
pub const MAX_LEVEL: u8 = 15;
/// Most root octants along one axis (one axis of a key has 21 bits).
pub const MAX_ROOTS: u32 = 64;
/// Bits that number the root octants along one axis.
const ROOT_BITS: u32 = MAX_ROOTS.ilog2();

/// A brick of `roots[0] × roots[1] (× roots[2])` root octants of equal edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Brick<const D: usize> {
    /// Root octants along each axis, each in `1..=MAX_ROOTS`.
    pub roots: [u32; D],
}

impl<const D: usize> Brick<D> {
    /// First key after all keys of the largest brick. Keys of a brick need not be contiguous below.
    pub const KEY_END: u64 = 1 << (D as u32 * (MAX_LEVEL as u32 + ROOT_BITS));

    /// Whether each axis has between 1 and [`MAX_ROOTS`] roots and D is 2 or 3.
    pub fn is_valid(&self) -> bool {
        (D == 2 || D == 3) && self.roots.iter().all(|&n| (1..=MAX_ROOTS).contains(&n))
    }

    /// Number of root octants.
    pub fn root_count(&self) -> u64 {
        self.roots.iter().map(|&n| u64::from(n)).product()
    }

    /// Edge lengths in units of the finest lattice.
    pub fn lattice_size(&self) -> [u32; D] {
        self.roots.map(|n| n << MAX_LEVEL)
    }

    /// Number of finest octants, the measure by which the completeness of a tree is checked.
    pub fn volume(&self) -> u64 {
        self.root_count() << (D as u32 * u32::from(MAX_LEVEL))
    }

    /// Whether the octant lies in the brick.
    pub fn contains(&self, octant: &Octant<D>) -> bool {
        octant.level <= MAX_LEVEL && (0..D).all(|a| octant.coord[a] < self.roots[a] << octant.level)
    }

    /// Root octant number `index` along the curve.
    ///
    /// # Panics
    /// If there is no such root.
    pub fn root_on_curve(&self, mut index: u64) -> Octant<D> {
        assert!(index < self.root_count(), "root {index} of {}", self.root_count());
        // Down the octree that the roots themselves form, skipping the roots of earlier children.
        let mut corner = [0u32; D];
        for bit in (0..ROOT_BITS).rev() {
            for child in 0..1 << D {
                let at: [u32; D] = std::array::from_fn(|a| corner[a] | ((child >> a & 1) << bit));
                let inside: u64 =
                    (0..D).map(|a| u64::from(self.roots[a].saturating_sub(at[a]).min(1 << bit))).product();
                if index < inside {
                    corner = at;
                    break;
                }
                index -= inside;
            }
        }
        Octant { level: 0, coord: corner }
    }
}

/// A cell of the tree: `coord` counts edges of its own size from the lower corner of the brick,
/// so that it covers `[coord, coord + 1] · root_edge · 2^-level`.
///
/// Octants compare in curve order: by Morton key of their first descendant, ancestors first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Octant<const D: usize> {
    /// Level, 0 for a root octant.
    pub level: u8,
    /// Position in units of the octant's own edge.
    pub coord: [u32; D],
}

impl<const D: usize> Octant<D> {
    /// Number of children of an octant, and of siblings in a family: 4 or 8.
    pub const CHILDREN: usize = 1 << D;

    /// Morton key of the lower corner: the first finest octant inside.
    pub fn key(&self) -> u64 {
        let shift = self.shift();
        interleave(self.coord.map(|c| c << shift))
    }

    /// First key after this octant.
    pub fn key_end(&self) -> u64 {
        self.key() + self.volume()
    }

    /// Number of finest octants inside.
    pub fn volume(&self) -> u64 {
        1 << (D as u32 * self.shift())
    }

    /// The octant of this level that contains the finest octant `key`.
    pub fn from_key(key: u64, level: u8) -> Self {
        let shift = u32::from(MAX_LEVEL - level);
        Octant { level, coord: deinterleave(key).map(|c| c >> shift) }
    }

    /// One number for level and position: the key without its trailing zeros below a leading one.
    /// The form in which octants are sent and stored.
    pub fn code(&self) -> u64 {
        let bits = D as u32 * (u32::from(self.level) + ROOT_BITS);
        1 << bits | interleave(self.coord)
    }

    /// Inverse of [`Octant::code`]; `None` if no octant has this code.
    pub fn from_code(code: u64) -> Option<Self> {
        let bits = code.checked_ilog2()?;
        let level = (bits / D as u32).checked_sub(ROOT_BITS)?;
        (bits.is_multiple_of(D as u32) && level <= u32::from(MAX_LEVEL))
            .then(|| Octant { level: level as u8, coord: deinterleave(code ^ (1 << bits)) })
    }

    /// The octant of the next coarser level around this one; `None` for a root.
    pub fn parent(&self) -> Option<Self> {
        (self.level > 0).then(|| self.ancestor(self.level - 1))
    }

    /// The octant of `level` that contains this one (itself at its own level).
    ///
    /// # Panics
    /// If `level` is finer than the octant.
    pub fn ancestor(&self, level: u8) -> Self {
        assert!(level <= self.level, "an ancestor is not finer than its descendant");
        let shift = self.level - level;
        Octant { level, coord: self.coord.map(|c| c >> shift) }
    }

    /// Child `i` in curve order; bit `a` of `i` chooses the upper half along axis `a`.
    ///
    /// # Panics
    /// In debug builds, if the octant has [`MAX_LEVEL`] or there is no such child.
    pub fn child(&self, i: usize) -> Self {
        debug_assert!(self.level < MAX_LEVEL && i < Self::CHILDREN);
        let coord = std::array::from_fn(|a| self.coord[a] << 1 | (i as u32 >> a & 1));
        Octant { level: self.level + 1, coord }
    }

    /// Which child of its parent this octant is; 0 for a root.
    pub fn child_id(&self) -> usize {
        if self.level == 0 {
            return 0;
        }
        (0..D).map(|a| (self.coord[a] as usize & 1) << a).sum()
    }

    /// Whether both have the same parent. A root has no siblings but itself.
    pub fn is_sibling(&self, other: &Self) -> bool {
        self == other || (self.level > 0 && self.level == other.level && self.parent() == other.parent())
    }

    /// Whether `other` is this octant or lies inside.
    pub fn contains(&self, other: &Self) -> bool {
        other.level >= self.level && other.ancestor(self.level) == *self
    }

    /// The octant of the same level, `offset` edges away; `None` outside the brick.
    pub fn neighbour(&self, offset: [i32; D], brick: &Brick<D>) -> Option<Self> {
        let mut coord = self.coord;
        for a in 0..D {
            coord[a] = coord[a].checked_add_signed(offset[a])?;
            if coord[a] >= brick.roots[a] << self.level {
                return None;
            }
        }
        Some(Octant { level: self.level, coord })
    }

    /// Lower corner on the finest lattice.
    pub fn lower(&self) -> [u32; D] {
        let shift = self.shift();
        self.coord.map(|c| c << shift)
    }

    /// Upper corner on the finest lattice.
    pub fn upper(&self) -> [u32; D] {
        let shift = self.shift();
        self.coord.map(|c| (c + 1) << shift)
    }

    /// Whether the closed boxes share a point: overlap, or a common face, edge or corner.
    pub fn touches(&self, other: &Self) -> bool {
        let (low, high) = (self.lower(), self.upper());
        let (other_low, other_high) = (other.lower(), other.upper());
        (0..D).all(|a| low[a] <= other_high[a] && other_low[a] <= high[a])
    }

    /// Halvings of the edge down to the finest lattice.
    fn shift(&self) -> u32 {
        u32::from(MAX_LEVEL - self.level)
    }
}

impl<const D: usize> Ord for Octant<D> {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.key(), self.level).cmp(&(other.key(), other.level))
    }
}

impl<const D: usize> PartialOrd for Octant<D> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Bit `b` of coordinate `a` becomes bit `D b + a`.
fn interleave<const D: usize>(coord: [u32; D]) -> u64 {
    match D {
        2 => (0..D).map(|a| spread_2(coord[a]) << a).sum(),
        3 => (0..D).map(|a| spread_3(coord[a]) << a).sum(),
        _ => panic!("octants have 2 or 3 axes"),
    }
}

/// Inverse of [`interleave`].
fn deinterleave<const D: usize>(key: u64) -> [u32; D] {
    match D {
        2 => std::array::from_fn(|a| gather_2(key >> a)),
        3 => std::array::from_fn(|a| gather_3(key >> a)),
        _ => panic!("octants have 2 or 3 axes"),
    }
}

// The usual doubling of gaps: each line moves the upper half of every group of bits to its place.

/// Bit `b` to bit `2 b`.
fn spread_2(x: u32) -> u64 {
    let mut x = u64::from(x);
    x = (x | x << 16) & 0x0000_ffff_0000_ffff;
    x = (x | x << 8) & 0x00ff_00ff_00ff_00ff;
    x = (x | x << 4) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | x << 2) & 0x3333_3333_3333_3333;
    (x | x << 1) & 0x5555_5555_5555_5555
}

/// Bit `2 b` to bit `b`; others are dropped.
fn gather_2(x: u64) -> u32 {
    let mut x = x & 0x5555_5555_5555_5555;
    x = (x | x >> 1) & 0x3333_3333_3333_3333;
    x = (x | x >> 2) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | x >> 4) & 0x00ff_00ff_00ff_00ff;
    x = (x | x >> 8) & 0x0000_ffff_0000_ffff;
    (x | x >> 16) as u32
}

/// Bit `b < 21` to bit `3 b`.
fn spread_3(x: u32) -> u64 {
    let mut x = u64::from(x) & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Bit `3 b` to bit `b`; others are dropped.
fn gather_3(x: u64) -> u32 {
    let mut x = x & 0x1249_2492_4924_9249;
    x = (x | x >> 2) & 0x10c3_0c30_c30c_30c3;
    x = (x | x >> 4) & 0x100f_00f0_0f00_f00f;
    x = (x | x >> 8) & 0x001f_0000_ff00_00ff;
    x = (x | x >> 16) & 0x001f_0000_0000_ffff;
    (x | x >> 32) as u32 & 0x1f_ffff
}

#[cfg(test)]
#[path = "key_tests.rs"]
mod tests;
