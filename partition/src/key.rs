//! Octants of a brick of root octants and their Morton keys.

/// Deepest level of an octant. Root octants have level 0.
pub const MAX_LEVEL: u8 = 15;
/// Most root octants along one axis (one axis of a key has 21 bits).
pub const MAX_ROOTS: u32 = 64;

/// A brick of `roots[0] × roots[1] (× roots[2])` root octants of equal edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Brick<const D: usize> {
    /// Root octants along each axis, each in `1..=MAX_ROOTS`.
    pub roots: [u32; D],
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
