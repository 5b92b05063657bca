//! The system's allocator, with a message when memory is exhausted.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::Write as _;

thread_local! {
    /// Whether the caller can handle a failure.
    static MAY_FAIL: Cell<bool> = const { Cell::new(false) };
}

/// The system's allocator. When memory is exhausted the program prints a message and ends with exit code 1:
/// an abort, as by default, would have MPI print a backtrace.
#[derive(Debug)]
pub struct Allocator;

/// Calls a function that handles a failure to allocate (`try_reserve`).
pub fn may_fail<T>(function: impl FnOnce() -> T) -> T {
    MAY_FAIL.set(true);
    let result = function();
    MAY_FAIL.set(false);
    result
}

// SAFETY: all calls go to the system's allocator, whose result is returned; or the process ends.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller's.
        checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller's.
        checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller's.
        checked(unsafe { System.realloc(pointer, layout, size) }, size)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller's.
        unsafe { System.dealloc(pointer, layout) };
    }
}

fn checked(pointer: *mut u8, size: usize) -> *mut u8 {
    if pointer.is_null() && !MAY_FAIL.try_with(Cell::get).unwrap_or(false) {
        end(size);
    }
    pointer
}

#[cold]
fn end(size: usize) -> ! {
    // Without memory, so in a buffer of fixed length, and without the handlers of an orderly end.
    let mut buffer = [0_u8; 200];
    let mut rest = &mut buffer[..];
    let _ = writeln!(
        rest,
        "agimp: no memory left: found no room for {size} bytes more; expected a smaller job, more machines or a higher limit (ulimit -v)"
    );
    let length = 200 - rest.len();
    let _ = std::io::stderr().write_all(&buffer[..length]);
    // SAFETY: ends the process; nothing of it is used afterwards.
    unsafe { libc::_exit(1) }
}
