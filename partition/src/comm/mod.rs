//! Messages between ranks. The only folder that names MPI, and without the feature `mpi` that of a single
//! rank.
//!
//! * [`World`] starts and ends MPI and installs the panic hook,
//! * [`Comm`] carries collective calls: reductions (`reduce.rs`), the error fence
//!   [`Comm::agree`] (`agree.rs`) and [`Comm::sparse_exchange`] (`sparse.rs`),
//! * [`NeighbourExchange`] sends one message to each of a fixed set of neighbours, with a begin
//!   and a finish between which other work can be done (`neighbour.rs`),
//! * `host.rs` has collective calls of the ranks of one machine,
//! * `environment.rs` knows launchers,
//! * `incoming.rs` puts messages together from pieces,
//! * `library/` is the seam below all of these: MPI, or one rank without it; it holds the `unsafe` of this
//!   crate.
//!
//! Everything here runs on the main thread (`MPI_THREAD_FUNNELED`); [`Comm`] is neither `Send`
//! nor `Sync`, so the compiler keeps it there. No call has a cost that grows like the number of
//! ranks times a message: the only O(P) data are the scalars of [`Comm::all_gather_u64`].
mod agree;
mod environment;
mod host;
mod incoming;
mod library;
mod neighbour;
mod reduce;
mod sparse;
mod world;

pub use agree::Disagreement;
pub use environment::{host, is_launched};
pub use neighbour::{NeighbourExchange, Pending, Traffic};
pub use world::{Comm, CommError, World};

/// Message tags. Exchanges with different tags cannot receive each other's messages.
mod tag {
    /// [`super::Comm::sparse_exchange`] alternates between these two tags.
    pub(super) const SPARSE: [i32; 2] = [1, 2];
    /// Tags of [`super::NeighbourExchange`] start here.
    pub(super) const NEIGHBOUR: i32 = 16;
}
