//! What tests on several ranks share.
#![allow(dead_code, reason = "each test uses its part")]
pub(crate) mod boxes;
pub(crate) mod exact;
pub(crate) mod launch;
pub(crate) mod mpirun;
pub(crate) mod random;
pub(crate) mod tree;
