//! Particles: chunks of tiles (arrays of structures of arrays), one per leaf, in a canonical order.
pub mod chunk;
mod column;
pub mod followed;
pub mod given;
pub mod group;
pub mod halvings;
pub mod lanes;
mod layout;
pub mod pores;
pub mod strain;
pub mod volume;
mod widest;

pub use chunk::{Chunk, Layout};
