//! The particles of one leaf, in tiles of eight: an array of structures of arrays.
//!
//! A tile holds one line of the cache for each component of its particles, one after the other. A batch of a kernel is a
//! tile, so that all that it reads and writes lies together, at offsets that the compiler knows.
//!
//! Order inside a chunk is part of the result: sums over particles run in this order, so it is
//! changed only by rules that depend on tree and particles (see `ARCHITECTURE.md`, "Canonical
//! order"), never by ranks or threads.
//!
//! Positions are relative to the lower corner of the domain, so that an origin far from zero costs
//! no digits.
use bytemuck::{Pod, Zeroable, cast_slice, cast_slice_mut};

pub use super::column::{Column, ColumnMut};
pub use super::layout::{Layout, Tag};
use super::widest::Widest;
use crate::memory::Block;
use std::num::NonZeroU64;
use std::sync::atomic::{AtomicU64, Ordering};

/// Particles of a tile.
pub const TILE: usize = 8;

/// One component of the particles of a tile: a line of the cache.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f64; TILE]);

/// Particles of one leaf: tiles of `Layout::<D>::REALS` lines of `f64`, then ids, then tags.
///
/// All lie in one block, with room for whole tiles; lanes of the last tile behind the last particle hold anything. Leaves
/// at the surface of a moving body become fuller or emptier all the time; in the heap each size that they pass through
/// would leave a hole that is too small for the next.
#[derive(Clone, Debug, Default)]
pub struct Chunk<const D: usize> {
    len: usize,
    capacity: usize,
    block: Block<Line>,
    widest: Widest,
    revision: Option<Revision>,
}

/// Names what the first particles of a chunk hold: as long as a chunk has the revision that it once had, these particles are what
/// they were, where they were. Appending keeps it, every other change ends it, and no two contents have the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Revision(NonZeroU64);

impl Revision {
    fn new() -> Option<Self> {
        static LAST: AtomicU64 = AtomicU64::new(0);
        NonZeroU64::new(LAST.fetch_add(1, Ordering::Relaxed) + 1).map(Self)
    }
}

/// Where a chunk lies in memory: from the chunk that comes next, kernels fetch the first lines while they
/// are still at work on this one. Holds no borrow; an address that is no longer right costs time and nothing else.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// Address of the first tile; 0 if there are no particles.
    pub tiles: usize,
    /// Address of the tags.
    pub tags: usize,
}

impl Place {
    /// Where the tile of particle `p` lies, and its tag.
    #[inline(always)]
    pub fn of_particle<const D: usize>(self, p: usize) -> Self {
        let tile = p / TILE * Layout::<D>::REALS * size_of::<[f64; TILE]>();
        Self { tiles: self.tiles + tile, tags: self.tags + p * size_of::<u64>() }
    }
}

impl<const D: usize> Chunk<D> {
    /// Where the identifiers begin, in words per particle that there is room for.
    const IDS: usize = Layout::<D>::REALS;
    /// Where the tags begin.
    const TAGS: usize = Self::IDS + 1;
    /// Words of a particle.
    const COLUMNS: usize = Self::TAGS + 1;

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

    /// Identifiers or tags.
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

    /// All tiles and tags at once, for kernels that write the former, undeformed half widths excepted, and read the
    /// latter.
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

    /// Values in a column of [`TILE`] particles from `first` on; what lies behind the last particle is of no use.
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

    /// Finds the greatest half width if something may have changed it, for [`Chunk::greatest_half`] to have it at hand.
    pub fn note_greatest_half(&mut self) {
        if self.widest.known().is_none() {
            self.widest = Widest::of(self.column(Layout::<D>::HALF));
        }
    }

    /// Position of particle `p` relative to the domain's lower corner, m.
    pub fn position(&self, p: usize) -> [f64; D] {
        self.read(Layout::<D>::POSITION, p)
    }

    /// Appends a particle with all columns zero and returns its index.
    pub fn push_zeroed(&mut self, id: u64, tag: Tag) -> usize {
        let p = self.extend_zeroed(1);
        self.words_mut(Self::IDS)[p] = id;
        self.words_mut(Self::TAGS)[p] = tag.pack();
        p
    }

    /// Appends a particle given by the words of its columns, with its identifier and packed tag.
    pub fn push_words(&mut self, columns: &[u64], id: u64, tag: u64) {
        self.grow_for(1);
        let (p, capacity) = (self.len, self.capacity);
        self.len += 1;
        let words: &mut [u64] = cast_slice_mut(&mut self.block);
        let own = &mut words[Self::first_word(p)..];
        for (to, &word) in own.iter_mut().step_by(TILE).zip(&columns[..Layout::<D>::REALS]) {
            *to = word;
        }
        (words[Self::IDS * capacity + p], words[Self::TAGS * capacity + p]) = (id, tag);
        self.widest.add(f64::from_bits(columns[Layout::<D>::HALF]));
    }

    /// Appends particle `p` of `source`.
    pub fn push_from(&mut self, source: &Self, p: usize) {
        self.grow_for(1);
        self.len += 1;
        self.set(self.len - 1, source, p);
        self.widest.add(source.column(Layout::<D>::HALF)[p]);
    }

    /// Makes particle `p` a copy of particle `q` of `source`.
    pub fn replace(&mut self, p: usize, source: &Self, q: usize) {
        (self.widest, self.revision) = (Widest::UNKNOWN, None);
        self.set(p, source, q);
    }

    fn set(&mut self, p: usize, source: &Self, q: usize) {
        let from: &[u64] = &cast_slice(&source.block)[Self::first_word(q)..];
        let to: &mut [u64] = &mut cast_slice_mut(&mut self.block)[Self::first_word(p)..];
        for column in 0..Layout::<D>::REALS {
            to[column * TILE] = from[column * TILE];
        }
        for column in [Self::IDS, Self::TAGS] {
            self.words_mut(column)[p] = source.words(column)[q];
        }
    }

    /// Makes particle `to` a copy of particle `from`.
    fn copy_within(&mut self, to: usize, from: usize) {
        let capacity = self.capacity;
        let words: &mut [u64] = cast_slice_mut(&mut self.block);
        let (first_to, first_from) = (Self::first_word(to), Self::first_word(from));
        for column in 0..Layout::<D>::REALS {
            words[first_to + column * TILE] = words[first_from + column * TILE];
        }
        for column in [Self::IDS, Self::TAGS] {
            words[column * capacity + to] = words[column * capacity + from];
        }
    }

    /// Place of the first column of particle `p` among the words of the block.
    fn first_word(p: usize) -> usize {
        p / TILE * TILE * Layout::<D>::REALS + p % TILE
    }

    /// Appends `n` zeroed particles (id and tag zero) and returns the index of the first.
    pub fn extend_zeroed(&mut self, n: usize) -> usize {
        self.grow_for(n);
        let first = self.len;
        self.len += n;
        for p in first..self.len {
            self.tile_of_mut(p).iter_mut().for_each(|line| line[p % TILE] = 0.0);
        }
        [Self::IDS, Self::TAGS].into_iter().for_each(|column| self.words_mut(column)[first..].fill(0));
        self.widest = Widest::UNKNOWN;
        first
    }

    /// Appends all columns as bytes, to send the particles to another rank of the same job.
    pub fn append_to(&self, bytes: &mut Vec<u8>) {
        bytes.reserve(8 * self.len * Self::COLUMNS);
        for column in 0..Layout::<D>::REALS {
            let (lines, rest) = self.column(column).lines();
            lines.for_each(|line| bytes.extend_from_slice(cast_slice(line)));
            bytes.extend_from_slice(cast_slice(rest));
        }
        [Self::IDS, Self::TAGS]
            .iter()
            .for_each(|&column| bytes.extend_from_slice(cast_slice(self.words(column))));
    }

    /// The particles that [`Chunk::append_to`] packed; empty if the bytes are not of that form.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let len = bytes.len() / (8 * Self::COLUMNS);
        let mut chunk = Self::with_capacity(len);
        if bytes.len() != 8 * len * Self::COLUMNS || len == 0 {
            return chunk;
        }
        chunk.len = len;
        let (reals, words) = bytes.split_at(8 * len * Layout::<D>::REALS);
        for (column, values) in reals.chunks_exact(8 * len).enumerate() {
            for (to, value) in chunk.column_mut(column).into_iter().zip(values.as_chunks().0) {
                *to = f64::from_ne_bytes(*value);
            }
        }
        for (column, values) in (Self::IDS..).zip(words.chunks_exact(8 * len)) {
            cast_slice_mut(chunk.words_mut(column)).copy_from_slice(values);
        }
        chunk.widest = Widest::UNKNOWN;
        chunk
    }

    /// Removes the particles `gone` (ascending). The last of those that stay fill the gaps in order, so that the cost
    /// depends on the number removed and the new order on nothing else.
    pub fn remove(&mut self, gone: &[u32]) {
        self.revision = None;
        let len = self.len - gone.len();
        let gaps = gone.iter().copied().take_while(|&p| (p as usize) < len);
        let mut leaving = gone[gaps.clone().count()..].iter().copied().peekable();
        let fillers = (len as u32..self.len as u32).filter(|&p| leaving.next_if_eq(&p).is_none());
        let moves: Vec<(usize, usize)> =
            gaps.zip(fillers).map(|(to, from)| (to as usize, from as usize)).collect();
        let mut widest = self.widest;
        let halves = self.column(Layout::<D>::HALF);
        gone.iter().for_each(|&p| widest.remove(halves[p as usize]));
        self.widest = widest;
        moves.iter().for_each(|&(to, from)| self.copy_within(to, from));
        self.len = len;
        self.give_back();
    }

    /// Removes all particles but the listed ones (ascending), which keep their order.
    pub fn keep(&mut self, stay: &[u32]) {
        stay.iter().enumerate().for_each(|(to, &from)| self.copy_within(to, from as usize));
        self.len = stay.len();
        (self.widest, self.revision) = (Widest::UNKNOWN, None);
        self.give_back();
    }

    /// Gives back room once more than a quarter of what is needed stands empty, as in leaves that the material has left.
    fn give_back(&mut self) {
        if self.len == 0 {
            *self = Self::new();
        } else if self.capacity > self.len + self.len / 4 + 4 * TILE {
            self.set_capacity((self.len + self.len / 16).next_multiple_of(TILE));
        }
    }

    /// A chunk whose particle `q` is particle `source[q]` of this one.
    pub fn gathered(&self, source: &[u32]) -> Self {
        let mut out = Self::with_capacity(source.len());
        (out.len, out.widest) = (source.len(), Widest::UNKNOWN);
        source.iter().enumerate().for_each(|(q, &p)| out.set(q, self, p as usize));
        out
    }

    /// Makes room for exactly `capacity` particles (rounded up to whole tiles) if there is less.
    pub fn reserve_exact(&mut self, capacity: usize) {
        if capacity > self.capacity {
            self.set_capacity(capacity.next_multiple_of(TILE));
        }
    }

    /// Changes the number of tiles; ids and tags move along.
    fn set_capacity(&mut self, capacity: usize) {
        let (before, len) = (self.capacity, self.len);
        let lines = capacity / TILE * Self::COLUMNS;
        // Those that would be overwritten go first.
        let order = if capacity > before { [Self::TAGS, Self::IDS] } else { [Self::IDS, Self::TAGS] };
        if capacity > before {
            self.block.resize(lines);
        }
        let words: &mut [u64] = cast_slice_mut(&mut self.block);
        for column in order {
            words.copy_within(column * before..column * before + len, column * capacity);
        }
        if capacity < before {
            self.block.resize(lines);
        }
        self.capacity = capacity;
    }

    /// Room for `extra` more; grows by little, since memory per particle is the limit.
    fn grow_for(&mut self, extra: usize) {
        let needed = self.len + extra;
        if needed > self.capacity {
            self.reserve_exact(needed.max(self.capacity + self.capacity / 32 + TILE));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_round_trip() {
        let mut chunk = Chunk::<3>::new();
        for id in 0..11 {
            let p = chunk.push_zeroed(id << 40, Tag { material: 1, body: 2, level: 3 });
            chunk.column_mut(Layout::<3>::WORK)[p] = -0.1 * id as f64;
        }
        let mut bytes = Vec::new();
        chunk.append_to(&mut bytes);
        let back = Chunk::<3>::from_bytes(&bytes);
        assert_eq!(back.ids(), chunk.ids());
        assert_eq!(back.tags(), chunk.tags());
        for column in 0..Layout::<3>::REALS {
            assert_eq!(back.column(column), chunk.column(column));
        }
        assert!(Chunk::<3>::from_bytes(&[1, 2, 3]).is_empty());
    }

    #[test]
    fn a_revision_lasts_until_something_but_appending_happens() {
        type Change = fn(&mut Chunk<2>);
        let tag = Tag { material: 0, body: 0, level: 0 };
        let appending: [Change; 3] = [
            |chunk| _ = chunk.push_zeroed(7, Tag { material: 0, body: 0, level: 0 }),
            |chunk| chunk.push_from(&chunk.clone(), 0),
            |chunk| chunk.reserve_exact(1000),
        ];
        let others: [Change; 9] = [
            |chunk| chunk.column_mut(Layout::<2>::MASS)[0] = 1.0,
            |chunk| chunk.write(Layout::<2>::MASS, 0, &[1.0]),
            |chunk| chunk.tags_mut()[0] = 1,
            |chunk| chunk.ids_mut()[0] = 1,
            |chunk| chunk.tiles_mut_and_tags().0[0][0] = 1.0,
            |chunk| chunk.replace(0, &chunk.clone(), 1),
            |chunk| chunk.remove(&[1]),
            |chunk| chunk.keep(&[0]),
            |chunk| *chunk = chunk.gathered(&[1, 0]),
        ];
        let mut chunk = Chunk::<2>::new();
        (0..20).for_each(|id| _ = chunk.push_zeroed(id, tag));
        for change in others {
            let mut chunk = chunk.clone();
            let first = chunk.revision().unwrap();
            for append in appending {
                append(&mut chunk);
                assert!(chunk.still_has(first) && chunk.revision() == Some(first));
            }
            change(&mut chunk);
            assert!(!chunk.still_has(first));
            assert_ne!(chunk.revision(), Some(first));
        }
        let first = chunk.revision().unwrap();
        chunk.keep(&[]);
        (0..20).for_each(|id| _ = chunk.push_zeroed(id, tag));
        assert!(!chunk.still_has(first));
    }

    #[test]
    fn the_last_fill_the_gaps() {
        let mut chunk = Chunk::<2>::new();
        for id in 0..10 {
            let p = chunk.push_zeroed(id, Tag { material: id as u16, body: 0, level: 0 });
            chunk.column_mut(Layout::<2>::MASS)[p] = id as f64;
            chunk.column_mut(Layout::<2>::HALF)[p] = id as f64;
        }
        chunk.remove(&[0, 2, 3, 7, 9]);
        let expected = [5, 1, 6, 8, 4];
        assert_eq!(chunk.ids(), expected);
        assert!(chunk.column(Layout::<2>::MASS).iter().zip(expected).all(|(m, id)| *m == id as f64));
        assert!(chunk.tags().iter().zip(expected).all(|(t, id)| u64::from(Tag::unpack(*t).material) == id));
        chunk.remove(&[]);
        assert_eq!(chunk.len(), 5);
        chunk.keep(&[1, 2, 4]);
        assert_eq!((chunk.ids(), chunk.greatest_half()), (&[1, 6, 4][..], 6.0));
        assert!(chunk.column(Layout::<2>::MASS).iter().eq(&[1.0, 6.0, 4.0]));
        chunk.remove(&[0, 1, 2]);
        assert!(chunk.is_empty());
    }
}
