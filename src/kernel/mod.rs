//! Particle kernels.
pub const BLOCK: usize = 4;
pub const ARENA_EDGE: usize = BLOCK + 3;
pub const fn arena_nodes(d: usize) -> usize { ARENA_EDGE.pow(d as u32) }
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row(pub [f64; 4]);
