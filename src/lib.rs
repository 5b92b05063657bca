//! Adaptive generalized interpolation material point method on a distributed octree.
pub mod cli;
pub mod geometry;
pub mod job;
pub mod kernel;
pub mod material;
pub mod particle;
