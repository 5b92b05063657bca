//! Adding and removing particles.
use bytemuck::{cast_slice, cast_slice_mut};

use super::{Chunk, Layout, TILE, Tag};
use crate::memory::Block;
use crate::particle::widest::Widest;

impl<const D: usize> Chunk<D> {
    /// Appends a particle with all columns zero and returns its index.
    pub fn push_zeroed(&mut self, id: u64, tag: Tag) -> usize {
        let p = self.extend_zeroed(1);
        self.words_mut(Self::IDS)[p] = id;
        self.words_mut(Self::TAGS)[p] = tag.pack();
        p
    }

    /// Appends a particle given by the words of its columns, with its identifier, its packed tag and the
    /// words of its carried columns.
    pub fn push_words(&mut self, columns: &[u64], id: u64, tag: u64, carried: &[u64]) {
        // A leaf whose particles carry zeros alone needs no columns for them.
        if carried.iter().any(|&word| word != 0) {
            self.carry(carried.len());
        }
        self.grow_for(1);
        let (p, capacity) = (self.len, self.capacity);
        self.len += 1;
        let words: &mut [u64] = cast_slice_mut(&mut self.block);
        let own = &mut words[Self::first_word(p)..];
        for (to, &word) in own.iter_mut().step_by(TILE).zip(&columns[..Layout::<D>::REALS]) {
            *to = word;
        }
        (words[Self::IDS * capacity + p], words[Self::TAGS * capacity + p]) = (id, tag);
        for column in 0..self.carried {
            words[(Self::CARRIED + column) * capacity + p] = carried.get(column).copied().unwrap_or(0);
        }
        self.widest.add(f64::from_bits(columns[Layout::<D>::HALF]));
    }

    /// Appends particle `p` of `source`.
    pub fn push_from(&mut self, source: &Self, p: usize) {
        self.carry(source.carried);
        self.grow_for(1);
        self.len += 1;
        self.set(self.len - 1, source, p);
        self.widest.add(source.column(Layout::<D>::HALF)[p]);
    }

    /// Makes particle `p` a copy of particle `q` of `source`.
    pub fn replace(&mut self, p: usize, source: &Self, q: usize) {
        (self.widest, self.revision) = (Widest::UNKNOWN, None);
        self.carry(source.carried);
        self.set(p, source, q);
    }

    fn set(&mut self, p: usize, source: &Self, q: usize) {
        let from: &[u64] = &cast_slice(&source.block)[Self::first_word(q)..];
        let to: &mut [u64] = &mut cast_slice_mut(&mut self.block)[Self::first_word(p)..];
        for column in 0..Layout::<D>::REALS {
            to[column * TILE] = from[column * TILE];
        }
        for column in Self::IDS..Self::CARRIED + source.carried {
            self.words_mut(column)[p] = source.words(column)[q];
        }
        for column in source.columns()..self.columns() {
            self.words_mut(column)[p] = 0;
        }
    }

    /// Makes particle `to` a copy of particle `from`.
    fn copy_within(&mut self, to: usize, from: usize) {
        let (capacity, columns) = (self.capacity, self.columns());
        let words: &mut [u64] = cast_slice_mut(&mut self.block);
        let (first_to, first_from) = (Self::first_word(to), Self::first_word(from));
        for column in 0..Layout::<D>::REALS {
            words[first_to + column * TILE] = words[first_from + column * TILE];
        }
        for column in Self::IDS..columns {
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
        (Self::IDS..self.columns()).for_each(|column| self.words_mut(column)[first..].fill(0));
        self.widest = Widest::UNKNOWN;
        first
    }

    /// Removes the particles `gone` (ascending). The last of those that stay fill the gaps in order, so that
    /// the cost depends on the number removed and the new order on nothing else.
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

    /// Frees room once more than a quarter of the needed room is unused, as in leaves that the material has
    /// left.
    fn give_back(&mut self) {
        if self.len == 0 {
            *self = Self::new();
        } else if self.capacity > self.len + self.len / 4 + 4 * TILE {
            self.set_capacity((self.len + self.len / 16).next_multiple_of(TILE));
        }
    }

    /// A chunk whose particle `q` is particle `source[q]` of this one.
    pub fn gathered(&self, source: &[u32]) -> Self {
        let mut out = Self::new();
        out.carry(self.carried);
        out.reserve_exact(source.len());
        (out.len, out.widest) = (source.len(), Widest::UNKNOWN);
        source.iter().enumerate().for_each(|(q, &p)| out.set(q, self, p as usize));
        out
    }

    /// Makes this chunk the particles `source[q]` of another, of which it has the identifiers, tags and these
    /// columns. Other columns keep their values, which are zero in a chunk that is filled in this way alone.
    /// Keeps its memory from one time to the next. Whole tiles are copied fastest.
    pub fn gather_columns(&mut self, other: &Self, source: &[u32], columns: &[usize]) {
        if source.len() > self.capacity {
            let capacity = (source.len() + source.len() / 8).next_multiple_of(TILE);
            *self = Self::new();
            self.block = Block::zeroed(capacity / TILE * self.columns());
            self.capacity = capacity;
        }
        (self.len, self.widest, self.revision) = (source.len(), Widest::UNKNOWN, None);
        let tiles = self.lines_mut().chunks_exact_mut(Layout::<D>::REALS);
        for (tile, source) in tiles.zip(source.chunks(TILE)) {
            let is_whole =
                source[0].is_multiple_of(TILE as u32) && (source[0]..).zip(source).all(|(p, &q)| p == q);
            if is_whole {
                let from = other.tile_of(source[0] as usize);
                columns.iter().for_each(|&column| tile[column] = from[column]);
                continue;
            }
            for (lane, &p) in source.iter().enumerate() {
                let from = other.tile_of(p as usize);
                columns.iter().for_each(|&column| tile[column][lane] = from[column][p as usize % TILE]);
            }
        }
        for column in [Self::IDS, Self::TAGS] {
            let from = other.words(column);
            self.words_mut(column).iter_mut().zip(source).for_each(|(to, &p)| *to = from[p as usize]);
        }
    }

    /// Makes room for exactly `capacity` particles (rounded up to whole tiles) if there is less.
    pub fn reserve_exact(&mut self, capacity: usize) {
        if capacity > self.capacity {
            self.set_capacity(capacity.next_multiple_of(TILE));
        }
    }

    /// Changes the number of tiles; the words behind them move along.
    fn set_capacity(&mut self, capacity: usize) {
        let (before, len) = (self.capacity, self.len);
        let lines = capacity / TILE * self.columns();
        if capacity > before {
            self.block.resize(lines);
        }
        let words: &mut [u64] = cast_slice_mut(&mut self.block);
        let mut shift =
            |column: usize| words.copy_within(column * before..column * before + len, column * capacity);
        // Columns that would be overwritten move first.
        let columns = Self::IDS..Self::CARRIED + self.carried;
        if capacity > before {
            columns.rev().for_each(shift)
        } else {
            columns.for_each(&mut shift)
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
