//! Messages that arrive in pieces, and how to wait for them.

use bytemuck::Pod;

use super::Comm;
use super::library::Arrival;

/// A message that is arriving, piece by piece.
#[derive(Debug, Default)]
pub(super) struct Incoming<T> {
    items: Vec<T>,
}

impl<T: Pod> Incoming<T> {
    pub(super) fn new() -> Self {
        Incoming { items: Vec::new() }
    }

    /// Not collective. Receives the next piece, which a matched probe has found. Returns the whole
    /// message after its last piece.
    pub(super) fn receive(&mut self, comm: &Comm, found: Arrival) -> Option<Vec<T>> {
        let bytes = found.len();
        let item = size_of::<T>();
        assert!(bytes.is_multiple_of(item), "a message of {bytes} bytes does not hold items of {item} bytes");
        let count = bytes / item;
        let before = self.items.len();
        self.items.resize(before + count, T::zeroed());
        let target: &mut [u8] = bytemuck::cast_slice_mut(&mut self.items[before..]);
        found.receive_into(target);
        (count < comm.piece_len::<T>()).then(|| std::mem::take(&mut self.items))
    }
}

/// Waits politely: polls without pause for a while, then gives the core away between polls.
#[derive(Debug, Default)]
pub(super) struct Patience {
    looks: u32,
}

impl Patience {
    /// Not collective. To be called after each poll that found nothing.
    pub(super) fn wait(&mut self) {
        self.looks += 1;
        if self.looks > 100 {
            std::thread::yield_now();
        } else {
            std::hint::spin_loop();
        }
    }

    /// Not collective. To be called after a poll that found something.
    pub(super) fn reset(&mut self) {
        self.looks = 0;
    }
}
