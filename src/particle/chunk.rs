//! The particles of one leaf, one contiguous column per component.
//!
//! Order inside a chunk is part of the result: sums over particles run in this order, so it is
//! changed only by rules that depend on tree and particles (see `ARCHITECTURE.md`, "Canonical
//! order"), never by ranks or threads.
//!
//! Positions are relative to the lower corner of the domain, so that an origin far from zero costs
//! no digits.
use bytemuck::{Pod, Zeroable, cast_slice, cast_slice_mut};

pub use super::layout::{Layout, Tag};
use super::widest::{Widest, greatest};
use crate::memory::Block;

/// One cache line of a column. Columns begin with a line, so that a batch of lanes never straddles two.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([f64; CAPACITY_STEP]);

/// Particles of one leaf: `Layout::<D>::REALS` columns of `f64` and two of `u64` (id and tag).
///
/// All columns lie one after the other in one block, with a common capacity. Leaves at the surface of a moving body become fuller or
/// emptier all the time; in the heap each size that they pass through would leave a hole that is too small for the next.
#[derive(Clone, Debug, Default)]
pub struct Chunk<const D: usize> {
    len: usize,
    capacity: usize,
    block: Block<Line>,
    widest: Widest,
}

/// Where the columns of a chunk lie in memory: from the chunk that comes next, kernels fetch the first lines while they
/// are still at work on this one. Holds no borrow; an address that is no longer right costs time and nothing else.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// Address of the first column; 0 if there are no particles.
    pub columns: usize,
    /// Bytes from column to column.
    pub stride: usize,
    /// Address of the tags.
    pub tags: usize,
}

/// Capacities are multiples of this, so that a batch of lanes never reads past a column.
const CAPACITY_STEP: usize = 8;

impl<const D: usize> Chunk<D> {
    /// Column of identifiers.
    const IDS: usize = Layout::<D>::REALS;
    /// Column of tags.
    const TAGS: usize = Self::IDS + 1;
    /// Number of columns.
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

    /// Room for particles before the next allocation; a multiple of 8.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Bytes held.
    pub fn heap_bytes(&self) -> usize {
        size_of_val(&*self.block)
    }

    /// Column `column` (see [`Layout`]), `len` values.
    pub fn column(&self, column: usize) -> &[f64] {
        &self.reals().0[column * self.capacity..][..self.len]
    }

    /// Column `column`, mutable.
    pub fn column_mut(&mut self, column: usize) -> &mut [f64] {
        if column == Layout::<D>::HALF {
            self.widest = Widest::UNKNOWN;
        }
        self.values_mut(column)
    }

    fn values_mut(&mut self, column: usize) -> &mut [f64] {
        let start = column * self.capacity;
        &mut cast_slice_mut(&mut self.block)[start..][..self.len]
    }

    fn words(&self, column: usize) -> &[u64] {
        &cast_slice(&self.block)[column * self.capacity..][..self.len]
    }

    fn words_mut(&mut self, column: usize) -> &mut [u64] {
        let start = column * self.capacity;
        &mut cast_slice_mut(&mut self.block)[start..][..self.len]
    }

    fn all_reals_mut(&mut self) -> &mut [f64] {
        &mut cast_slice_mut(&mut self.block)[..Layout::<D>::REALS * self.capacity]
    }

    /// All columns at once: `(reals, stride)`; column `c` of particle `p` is `reals[c * stride + p]`.
    pub fn reals(&self) -> (&[f64], usize) {
        (&cast_slice(&self.block)[..Layout::<D>::REALS * self.capacity], self.capacity)
    }

    /// All columns at once, mutable.
    pub fn reals_mut(&mut self) -> (&mut [f64], usize) {
        self.widest = Widest::UNKNOWN;
        let stride = self.capacity;
        (self.all_reals_mut(), stride)
    }

    /// Real columns (with their stride) and tags at once, for kernels that write the former, undeformed half widths
    /// excepted, and read the latter.
    pub fn reals_mut_and_tags(&mut self) -> (&mut [f64], usize, &[u64]) {
        let (len, stride) = (self.len, self.capacity);
        let (reals, others) = self.block.split_at_mut(Layout::<D>::REALS * stride / CAPACITY_STEP);
        let tags = &cast_slice(others)[(Self::TAGS - Self::IDS) * stride..][..len];
        (cast_slice_mut(reals), stride, tags)
    }

    /// Where the columns lie in memory.
    pub fn place(&self) -> Place {
        if self.is_empty() {
            return Place::default();
        }
        let stride = self.capacity * size_of::<f64>();
        let columns = self.block.as_ptr().addr();
        Place { columns, stride, tags: columns + Self::TAGS * stride }
    }

    /// Identifiers, unique over the run.
    pub fn ids(&self) -> &[u64] {
        self.words(Self::IDS)
    }

    /// Identifiers, mutable.
    pub fn ids_mut(&mut self) -> &mut [u64] {
        self.words_mut(Self::IDS)
    }

    /// Packed tags (see [`Tag`]).
    pub fn tags(&self) -> &[u64] {
        self.words(Self::TAGS)
    }

    /// Packed tags, mutable.
    pub fn tags_mut(&mut self) -> &mut [u64] {
        self.words_mut(Self::TAGS)
    }

    /// Greatest undeformed half width, m; 0 without particles.
    pub fn greatest_half(&self) -> f64 {
        self.widest.known().unwrap_or_else(|| greatest(self.column(Layout::<D>::HALF)))
    }

    /// Finds the greatest half width if something may have changed it, for [`Chunk::greatest_half`] to have it at hand.
    pub fn note_greatest_half(&mut self) {
        if self.widest.known().is_none() {
            self.widest = Widest::of(self.column(Layout::<D>::HALF));
        }
    }

    /// Position of particle `p` relative to the domain's lower corner, m.
    pub fn position(&self, p: usize) -> [f64; D] {
        let (reals, stride) = self.reals();
        std::array::from_fn(|axis| reals[(Layout::<D>::POSITION + axis) * stride + p])
    }

    /// Appends a particle with all columns zero and returns its index.
    pub fn push_zeroed(&mut self, id: u64, tag: Tag) -> usize {
        self.grow_for(1);
        let p = self.len;
        self.len += 1;
        let (reals, stride) = self.reals_mut();
        (0..Layout::<D>::REALS).for_each(|column| reals[column * stride + p] = 0.0);
        self.ids_mut()[p] = id;
        self.tags_mut()[p] = tag.pack();
        p
    }

    /// Appends a particle given by the words of its columns, with its identifier and packed tag.
    pub fn push_words(&mut self, columns: &[u64], id: u64, tag: u64) {
        self.grow_for(1);
        let (p, stride) = (self.len, self.capacity);
        self.len += 1;
        let words: &mut [u64] = cast_slice_mut(&mut self.block);
        for (column, &word) in columns[..Layout::<D>::REALS].iter().chain(&[id, tag]).enumerate() {
            words[column * stride + p] = word;
        }
        self.widest.add(f64::from_bits(columns[Layout::<D>::HALF]));
    }

    /// Appends particle `p` of `source`.
    pub fn push_from(&mut self, source: &Self, p: usize) {
        self.grow_for(1);
        let q = self.len;
        self.len += 1;
        for column in 0..Self::COLUMNS {
            self.words_mut(column)[q] = source.words(column)[p];
        }
        self.widest.add(source.column(Layout::<D>::HALF)[p]);
    }

    /// Appends `n` zeroed particles (id and tag zero) and returns the index of the first.
    pub fn extend_zeroed(&mut self, n: usize) -> usize {
        self.grow_for(n);
        let first = self.len;
        self.len += n;
        (0..Self::COLUMNS).for_each(|column| self.words_mut(column)[first..].fill(0));
        self.widest = Widest::UNKNOWN;
        first
    }

    /// Appends all columns as bytes, to send the particles to another rank of the same job.
    pub fn append_to(&self, bytes: &mut Vec<u8>) {
        bytes.reserve(8 * self.len * Self::COLUMNS);
        (0..Self::COLUMNS).for_each(|column| bytes.extend_from_slice(cast_slice(self.words(column))));
    }

    /// The particles that [`Chunk::append_to`] packed; empty if the bytes are not of that form.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let len = bytes.len() / (8 * Self::COLUMNS);
        let mut chunk = Self::with_capacity(len);
        if bytes.len() != 8 * len * Self::COLUMNS || len == 0 {
            return chunk;
        }
        chunk.extend_zeroed(len);
        for (column, values) in bytes.chunks_exact(8 * len).enumerate() {
            cast_slice_mut(chunk.words_mut(column)).copy_from_slice(values);
        }
        chunk
    }

    /// Removes the particles `gone` (ascending). The last of those that stay fill the gaps in order, so that the cost
    /// depends on the number removed and the new order on nothing else.
    pub fn remove(&mut self, gone: &[u32]) {
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
        for column in 0..Self::COLUMNS {
            let values = self.words_mut(column);
            moves.iter().for_each(|&(to, from)| values[to] = values[from]);
        }
        self.len = len;
        self.give_back();
    }

    /// Removes all particles but the listed ones (ascending), which keep their order.
    pub fn keep(&mut self, stay: &[u32]) {
        for column in 0..Self::COLUMNS {
            let values = self.words_mut(column);
            stay.iter().enumerate().for_each(|(to, &from)| values[to] = values[from as usize]);
        }
        self.len = stay.len();
        self.widest = Widest::UNKNOWN;
        self.give_back();
    }

    /// Gives back room once more than a quarter of what is needed stands empty, as in leaves that the material has left.
    fn give_back(&mut self) {
        if self.len == 0 {
            *self = Self::new();
        } else if self.capacity > self.len + self.len / 4 + 4 * CAPACITY_STEP {
            self.set_capacity(rounded(self.len + self.len / 16));
        }
    }

    /// A chunk whose particle `q` is particle `source[q]` of this one.
    pub fn gathered(&self, source: &[u32]) -> Self {
        let mut out = Self::with_capacity(source.len());
        (out.len, out.widest) = (source.len(), Widest::UNKNOWN);
        for column in 0..Self::COLUMNS {
            let from = self.words(column);
            out.words_mut(column).iter_mut().zip(source).for_each(|(value, &p)| *value = from[p as usize]);
        }
        out
    }

    /// Makes room for exactly `capacity` particles (rounded up to an odd multiple of 8) if there is less.
    pub fn reserve_exact(&mut self, capacity: usize) {
        if capacity > self.capacity {
            self.set_capacity(rounded(capacity));
        }
    }

    /// Moves the columns apart or closer together.
    fn set_capacity(&mut self, capacity: usize) {
        let (before, len) = (self.capacity, self.len);
        let lines = capacity / CAPACITY_STEP * Self::COLUMNS;
        let move_column = |words: &mut [u64], column: usize| {
            words.copy_within(column * before..column * before + len, column * capacity);
        };
        if capacity > before {
            self.block.resize(lines);
            let words: &mut [u64] = cast_slice_mut(&mut self.block);
            (0..Self::COLUMNS).rev().for_each(|column| move_column(words, column));
        } else {
            let words: &mut [u64] = cast_slice_mut(&mut self.block);
            (0..Self::COLUMNS).for_each(|column| move_column(words, column));
            self.block.resize(lines);
        }
        self.capacity = capacity;
    }

    /// Room for `extra` more; grows by little, since memory per particle is the limit.
    fn grow_for(&mut self, extra: usize) {
        let needed = self.len + extra;
        if needed > self.capacity {
            self.reserve_exact(needed.max(self.capacity + self.capacity / 32 + CAPACITY_STEP));
        }
    }
}

/// The next capacity that is an odd multiple of the step: with powers of two all columns would share a few sets of the
/// cache.
fn rounded(capacity: usize) -> usize {
    (capacity.div_ceil(CAPACITY_STEP) | 1) * CAPACITY_STEP
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
        assert_eq!(chunk.column(Layout::<2>::MASS), [1.0, 6.0, 4.0]);
        chunk.remove(&[0, 1, 2]);
        assert!(chunk.is_empty());
    }
}
