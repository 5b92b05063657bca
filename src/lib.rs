//! Adaptive generalized interpolation material point method on a distributed octree.
pub mod geometry;
pub mod job;
pub mod material;
pub mod particle;
