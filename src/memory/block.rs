//! Long arrays with pages of their own.
//!
//! Pages come from the system zeroed when they are first touched and go back to it at once; an array that
//! grows moves its pages without a copy. `unsafe` is needed for the latter: other references could still
//! point to the old place. Nothing here hands out any that outlive a change.
#![allow(unsafe_code)]

use std::ops::{Deref, DerefMut};

use bytemuck::{Pod, cast_slice, cast_slice_mut};
#[cfg(target_os = "linux")]
use memmap2::RemapOptions;
use memmap2::{MmapMut, MmapOptions};

/// Arrays of at least this many bytes have pages of their own.
const PAGES_FROM: usize = 32 << 10;

/// An array of fixed length, in the heap while it is short, with pages of its own when it is long.
#[derive(Debug)]
pub struct Block<T: Pod>(Memory<T>);

#[derive(Debug)]
enum Memory<T> {
    Heap(Vec<T>),
    Pages(MmapMut),
}

impl<T: Pod> Block<T> {
    /// So many zeros.
    pub fn zeroed(len: usize) -> Self {
        let bytes = len * size_of::<T>();
        if bytes >= PAGES_FROM {
            // The number of mappings of a process is limited; without one more the heap is used.
            if let Ok(pages) = MmapOptions::new().len(bytes).map_anon() {
                return Self(Memory::Pages(pages));
            }
        }
        Self(Memory::Heap(vec![T::zeroed(); len]))
    }

    /// Makes it `len` long. The first elements, as many as there are before and after, stay as they are;
    /// others are undefined.
    pub fn resize(&mut self, len: usize) {
        let bytes = len * size_of::<T>();
        match &mut self.0 {
            Memory::Heap(own) if bytes < PAGES_FROM => {
                own.reserve_exact(len.saturating_sub(own.len()));
                own.resize(len, T::zeroed());
                own.shrink_to_fit();
            }
            #[cfg(target_os = "linux")]
            Memory::Pages(pages) if bytes >= PAGES_FROM => {
                // SAFETY: `self` is borrowed exclusively, so that nothing refers to the old place; and there
                // is no file behind the pages that could be cut short.
                let moved = unsafe { pages.remap(bytes, RemapOptions::new().may_move(true)) };
                if moved.is_err() {
                    self.replace(len);
                }
            }
            _ => self.replace(len),
        }
    }

    /// [`Block::resize`] by way of a new one.
    fn replace(&mut self, len: usize) {
        let mut new = Self::zeroed(len);
        let kept = len.min(self.len());
        new[..kept].copy_from_slice(&self[..kept]);
        *self = new;
    }
}

impl<T: Pod> Deref for Block<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.0 {
            Memory::Heap(values) => values,
            Memory::Pages(pages) => cast_slice(pages),
        }
    }
}

impl<T: Pod> DerefMut for Block<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Memory::Heap(values) => values,
            Memory::Pages(pages) => cast_slice_mut(pages),
        }
    }
}

impl<T: Pod> Default for Block<T> {
    fn default() -> Self {
        Self(Memory::Heap(Vec::new()))
    }
}

impl<T: Pod> Clone for Block<T> {
    fn clone(&self) -> Self {
        let mut clone = Self::zeroed(self.len());
        clone.copy_from_slice(self);
        clone
    }

    fn clone_from(&mut self, source: &Self) {
        if self.len() == source.len() {
            self.copy_from_slice(source);
        } else {
            *self = source.clone();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy, Debug, Pod, bytemuck::Zeroable)]
    #[repr(C, align(64))]
    struct Line([u64; 8]);

    /// Numbers 1, 2, ... in all words.
    fn number(block: &mut Block<Line>) {
        let words: &mut [u64] = cast_slice_mut(block);
        words.iter_mut().zip(1..).for_each(|(word, i)| *word = i);
    }

    fn is_numbered(block: &[Line]) -> bool {
        cast_slice::<_, u64>(block).iter().zip(1..).all(|(word, i)| *word == i)
    }

    #[test]
    fn zeros_wherever_they_lie() {
        for len in [0, 1, 7, PAGES_FROM / 64 - 1, PAGES_FROM / 64, 1000, 4001] {
            let mut block = Block::<Line>::zeroed(len);
            assert_eq!(matches!(block.0, Memory::Pages(_)), 64 * len >= PAGES_FROM);
            assert_eq!((block.len(), block.as_ptr().addr() % 64), (len, 0));
            assert!(block.iter().all(|line| line.0 == [0; 8]));
            number(&mut block);
            assert!(is_numbered(&block.clone()));
            let mut other = Block::zeroed(1000);
            other.clone_from(&block);
            assert!(other.len() == len && is_numbered(&other));
        }
    }

    #[test]
    fn what_was_there_stays_when_it_becomes_longer_or_shorter() {
        let threshold = PAGES_FROM / 64;
        let lengths =
            [3, 200, threshold - 1, threshold, 5000, 5064, 40_000, 4000, threshold + 1, 100, 0, 7000];
        let mut block = Block::<Line>::default();
        for len in lengths {
            let kept = len.min(block.len());
            block.resize(len);
            assert_eq!((block.len(), block.as_ptr().addr() % 64), (len, 0));
            assert_eq!(matches!(block.0, Memory::Pages(_)), 64 * len >= PAGES_FROM);
            assert!(is_numbered(&block[..kept]), "{len}");
            number(&mut block);
        }
    }
}
