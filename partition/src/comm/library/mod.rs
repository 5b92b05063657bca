//! The calls of a message-passing library with which the rest of `comm` is written: one seam with two
//! implementations.
//!
//! | file | built |
//! |---|---|
//! | `with_mpi.rs`, `sends.rs` | with the feature `mpi` (default): MPI by rsmpi; the `unsafe` of this crate |
//! | `one_rank.rs` | without it: a single rank, whose messages to itself wait in a queue |
//!
//! Both offer the same items: [`Library`] starts and ends the library, a [`Group`] makes collective calls and
//! finds messages, [`Outgoing`] is a message on its way, [`Arrival`] a piece of one that has come.

#[cfg(not(feature = "mpi"))]
mod one_rank;
#[cfg(feature = "mpi")]
mod sends;
#[cfg(feature = "mpi")]
mod with_mpi;

#[cfg(not(feature = "mpi"))]
pub(super) use one_rank::{Arrival, Group, Library, Outgoing};
#[cfg(feature = "mpi")]
pub(super) use sends::Outgoing;
#[cfg(feature = "mpi")]
pub(super) use with_mpi::{Arrival, Group, Library};

/// How a send completes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// When the buffer may be reused.
    Standard,
    /// When the receiver has started to receive.
    Synchronous,
}

/// How a reduction combines the values of ranks. Integers only, so the order does not matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operation {
    Sum,
    Largest,
    Smallest,
    Union,
}
