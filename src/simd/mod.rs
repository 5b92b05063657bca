//! Explicit vectors of `f64`: the only module of this crate with CPU intrinsics.
//!
//! [`F64x4`] is one AVX register where the build has AVX2 and FMA and an array of four numbers elsewhere. It
//! holds a row of a node. [`LANES`] particles at a time make a [`Vector`]: two of them ([`Lanes`]), or one
//! register of 512 bits where the processor has AVX-512 (see [`widest`]). All do the same IEEE 754
//! operations, each correctly rounded, so a result never depends on the choice.
//!
//! | file or folder | what it holds |
//! |---|---|
//! | `vector`, `lanes` | a vector of particles; as two groups of four numbers |
//! | `registers/` | registers of each instruction set |
//! | `dispatch`, `processor` | the widest registers, chosen at run time; what the program needs |
//! | `dual` | numbers with derivatives |
//! | [`math`] | elementary functions |
//! | `prefetch` | hints to the cache |
pub use dispatch::{Kernel, widest};
pub use dual::{DIRECTIONS, Dual};
pub use lanes::{Lanes, Mask};
pub use prefetch::{prefetch, prefetch_to_second_level};
pub use processor::missing;
pub use registers::{F64x4, Mask4};
pub use vector::{LANES, Vector, VectorMask, each};

mod dispatch;
mod dual;
mod lanes;
mod prefetch;
mod processor;
mod registers;
mod vector;

pub mod math;
#[cfg(test)]
mod tests;
