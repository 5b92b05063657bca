//! What tests on several ranks share.
#![allow(dead_code, reason = "each test uses its part")]
pub mod boxes;
pub mod exact;
pub mod launch;
pub mod mpirun;
pub mod random;
pub mod tree;
