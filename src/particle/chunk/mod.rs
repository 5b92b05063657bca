//! The particles of one leaf, in tiles of eight: an array of structures of arrays.
//!
//! A tile holds one line of the cache for each component of its particles, one after the other. A batch of a
//! kernel is a tile, so that its data are contiguous, at offsets that the compiler knows.
//!
//! Order inside a chunk is part of the result: sums over particles run in this order, so it is changed only
//! by rules that depend on tree and particles (see `docs/design/node-sums.md`, "Rules"), never by ranks or
//! threads.
//!
//! Positions are relative to the lower corner of the domain, so that an origin far from zero costs
//! no digits.
//!
//! | file | what it holds |
//! |---|---|
//! | `mod.rs` | the chunk, and access in place |
//! | `edit.rs` | adding and removing particles |
//! | `bytes.rs` | chunks as bytes for other ranks |
//! | `carried.rs` | columns that some particles carry for loads |
//! | `place.rs` | revision of a chunk's content, and its place in memory |
use bytemuck::{Pod, Zeroable, cast_slice, cast_slice_mut};

pub use self::place::{Place, Revision};
pub use super::column::{Column, ColumnMut};
pub use super::layout::{Layout, TILE, Tag};
use super::widest::Widest;
use crate::memory::Block;

mod bytes;
mod carried;
mod edit;
mod place;
#[cfg(test)]
mod tests;

/// One component of the particles of a tile: a line of the cache.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f64; TILE]);

/// Particles of one leaf: tiles of `Layout::<D>::REALS` lines of `f64`, then ids, then tags, then carried
/// columns, in leaves that have any (see [`Chunk::carried`]).
///
/// All lie in one block, with room for whole tiles; lanes of the last tile behind the last particle are
/// undefined. Leaves at the surface of a moving body become fuller or emptier all the time; in the heap each
/// size that they pass through would leave a hole that is too small for the next.
#[derive(Clone, Debug, Default)]
pub struct Chunk<const D: usize> {
    len: usize,
    capacity: usize,
    block: Block<Line>,
    widest: Widest,
    /// Number of carried columns.
    carried: usize,
    revision: Option<Revision>,
}

impl<const D: usize> Chunk<D> {
    /// Where the identifiers begin, in words per particle that there is room for.
    const IDS: usize = Layout::<D>::REALS;
    /// Where the tags begin.
    const TAGS: usize = Self::IDS + 1;
    /// Where the columns begin that only some chunks have.
    const CARRIED: usize = Self::TAGS + 1;

    /// An empty chunk.
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty chunk with room for `capacity` particles.
    pub fn with_capacity(capacity: usize) -> Self {
        let mut chunk = Self::new();
        chunk.reserve_exact(capacity);
        chunk
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True when the chunk has no particles.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Room for particles before the next allocation; a multiple of [`TILE`].
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Bytes held.
    pub fn heap_bytes(&self) -> usize {
        size_of_val(&*self.block)
    }

    /// Column `column` (see [`Layout`]), `len` values.
    pub fn column(&self, column: usize) -> Column<'_> {
        Column::new(self.tiles().get(column..).unwrap_or_default(), Layout::<D>::REALS, self.len)
    }

    /// The revision of the present content.
    pub fn revision(&mut self) -> Option<Revision> {
        self.revision = self.revision.or_else(Revision::new);
        self.revision
    }

    /// Whether the chunk has had this revision since, and only appended particles.
    pub fn still_has(&self, revision: Revision) -> bool {
        self.revision == Some(revision)
    }

    /// Column `column`, mutable.
    pub fn column_mut(&mut self, column: usize) -> ColumnMut<'_> {
        self.revision = None;
        if column == Layout::<D>::HALF {
            self.widest = Widest::UNKNOWN;
        }
        let len = self.len;
        ColumnMut::new(self.lines_mut().get_mut(column..).unwrap_or_default(), Layout::<D>::REALS, len)
    }

    /// Words of a particle.
    fn columns(&self) -> usize {
        Self::CARRIED + self.carried
    }

    /// Identifiers, tags, or a carried column.
    fn words(&self, column: usize) -> &[u64] {
        &cast_slice(&self.block)[column * self.capacity..][..self.len]
    }

    fn words_mut(&mut self, column: usize) -> &mut [u64] {
        let start = column * self.capacity;
        &mut cast_slice_mut(&mut self.block)[start..][..self.len]
    }

    fn lines_mut(&mut self) -> &mut [[f64; TILE]] {
        let lines = self.capacity / TILE * Layout::<D>::REALS;
        cast_slice_mut(&mut self.block[..lines])
    }

    /// All tiles: column `c` of the particles of tile `t` is line `t * REALS + c`.
    pub fn tiles(&self) -> &[[f64; TILE]] {
        cast_slice(&self.block[..self.capacity / TILE * Layout::<D>::REALS])
    }

    /// The tile of particle `p`, which has place `p % TILE` in each of its lines.
    pub fn tile_of(&self, p: usize) -> &[[f64; TILE]] {
        &self.tiles()[p / TILE * Layout::<D>::REALS..][..Layout::<D>::REALS]
    }

    fn tile_of_mut(&mut self, p: usize) -> &mut [[f64; TILE]] {
        &mut self.lines_mut()[p / TILE * Layout::<D>::REALS..][..Layout::<D>::REALS]
    }

    /// All tiles and tags at once, for kernels that write the former, undeformed half widths excepted, and
    /// read the latter.
    pub fn tiles_mut_and_tags(&mut self) -> (&mut [[f64; TILE]], &[u64]) {
        self.revision = None;
        let (tiles, words) = self.block.split_at_mut(self.capacity / TILE * Layout::<D>::REALS);
        let tags = &cast_slice(words)[(Self::TAGS - Self::IDS) * self.capacity..][..self.len];
        (cast_slice_mut(tiles), tags)
    }

    /// Columns `first..first + N` of particle `p`.
    pub fn read<const N: usize>(&self, first: usize, p: usize) -> [f64; N] {
        let tile = self.tile_of(p);
        std::array::from_fn(|i| tile[first + i][p % TILE])
    }

    /// Writes columns of particle `p` from `first` on.
    pub fn write(&mut self, first: usize, p: usize, values: &[f64]) {
        self.revision = None;
        if (first..first + values.len()).contains(&Layout::<D>::HALF) {
            self.widest = Widest::UNKNOWN;
        }
        for (line, &value) in self.tile_of_mut(p)[first..].iter_mut().zip(values) {
            line[p % TILE] = value;
        }
    }

    /// Values in a column of [`TILE`] particles from `first` on; values behind the last particle are
    /// undefined.
    #[inline(always)]
    pub fn values(&self, column: usize, first: usize) -> [f64; TILE] {
        let line = first / TILE * Layout::<D>::REALS + column;
        let (tiles, shift) = (self.tiles(), first % TILE);
        if shift == 0 {
            return tiles[line];
        }
        let next = tiles.get(line + Layout::<D>::REALS).unwrap_or(&[f64::NAN; TILE]);
        std::array::from_fn(|lane| match shift + lane {
            own if own < TILE => tiles[line][own],
            other => next[other - TILE],
        })
    }

    /// Where the chunk lies in memory.
    pub fn place(&self) -> Place {
        if self.is_empty() {
            return Place::default();
        }
        let tiles = self.block.as_ptr().addr();
        Place { tiles, tags: tiles + Self::TAGS * self.capacity * size_of::<u64>() }
    }

    /// Identifiers, unique over the run.
    pub fn ids(&self) -> &[u64] {
        self.words(Self::IDS)
    }

    /// Identifiers, mutable.
    pub fn ids_mut(&mut self) -> &mut [u64] {
        self.revision = None;
        self.words_mut(Self::IDS)
    }

    /// Packed tags (see [`Tag`]).
    pub fn tags(&self) -> &[u64] {
        self.words(Self::TAGS)
    }

    /// Packed tags, mutable.
    pub fn tags_mut(&mut self) -> &mut [u64] {
        self.revision = None;
        self.words_mut(Self::TAGS)
    }

    /// Greatest undeformed half width, m; 0 without particles.
    pub fn greatest_half(&self) -> f64 {
        self.widest.known().unwrap_or_else(|| self.column(Layout::<D>::HALF).greatest())
    }

    /// Updates the greatest half width if it may have changed, so that [`Chunk::greatest_half`] need not
    /// search for it.
    pub fn note_greatest_half(&mut self) {
        if self.widest.known().is_none() {
            self.widest = Widest::of(self.column(Layout::<D>::HALF));
        }
    }

    /// Position of particle `p` relative to the domain's lower corner, m.
    pub fn position(&self, p: usize) -> [f64; D] {
        self.read(Layout::<D>::POSITION, p)
    }
}
