//! Particles: structure-of-arrays chunks, one per leaf, in a canonical order.
pub mod chunk;
mod layout;
pub mod resample;
pub mod seed;
mod widest;

pub use chunk::{Chunk, Layout};
