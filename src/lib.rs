//! Adaptive generalized interpolation material point method on a distributed octree.
pub mod io;
pub mod material;
pub mod particle;
