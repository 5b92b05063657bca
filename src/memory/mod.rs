//! Settings of the system's allocator, arrays that do without it, and limits on memory.
#![allow(unsafe_code)]

pub mod block;
pub mod exhausted;
pub mod limits;

pub use block::Block;
pub use exhausted::{Allocator, may_fail};
pub use limits::Limits;

/// Blocks of at least this many bytes go back to the system as soon as they are freed: far above what steps
/// allocate, and below the columns that a file is written from.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const RETURNED: libc::c_int = 4 << 20;

/// Has large blocks returned to the system when they are freed. Left to itself, the allocator of GNU systems
/// raises its bound for such blocks up to 32 MiB as they are allocated and freed, and then keeps their pages
/// between the particles' columns: 25 bytes per particle in a run of two million. To be called before
/// anything large is allocated.
pub fn return_large_blocks() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: no other thread allocates yet. Where the setting is refused, memory
        // is used as before.
        unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, RETURNED) };
    }
}
