//! Particles: chunks of tiles (arrays of structures of arrays), one per leaf, in a canonical order.
pub mod chunk;
mod column;
pub mod lanes;
mod layout;
mod widest;

pub use chunk::{Chunk, Layout};
