//! Adaptive generalized interpolation material point method on a distributed octree.
pub mod adaptivity;
pub mod bench;
pub mod boundary;
pub mod cli;
pub mod exact_sum;
pub mod geometry;
pub mod grid;
pub mod io;
pub mod job;
pub mod kernel;
pub mod material;
pub mod memory;
pub mod particle;
pub mod run;
pub mod setup;
pub mod simd;
pub mod solver;
