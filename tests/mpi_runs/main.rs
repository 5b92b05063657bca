//! The whole program under `mpirun`: same bits on any ranks and threads, restarts, signals, and the end of
//! all ranks when one fails.
#[path = "../common/mod.rs"]
mod common;
mod differing_ranks;
mod directory;
mod faults;
mod mending;
mod ranks;
mod restart;
mod same_bits;
mod signals;
