//! Transfers between particles and nodes.
//!
//! | file | what it holds |
//! |---|---|
//! | [`p2g`] | particles to nodes, over all bins |
//! | [`g2p`] | nodes to particles, over all leaves |
//! | `interpolate` | gather for the particles of a leaf, without an advance |
//! | `flip_xpic` | velocities that FLIP and XPIC need |
//! | `mean_dilation` | F-bar: dilation as the mean over cells |
mod flip_xpic;
pub mod g2p;
pub(in crate::solver) mod interpolate;
pub(in crate::solver) mod mean_dilation;
pub mod p2g;
