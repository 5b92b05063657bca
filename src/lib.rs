//! Adaptive generalized interpolation material point method on a distributed octree.
pub mod kernel;
pub mod material;
pub mod particle;
