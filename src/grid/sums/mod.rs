//! Node fields of a step: sums of arenas, those of other ranks, restriction and prolongation.
//!
//! | file | what it holds |
//! |---|---|
//! | [`fields`] | values of all nodes of a rank; sums of its blocks |
//! | `block_sum`, `mixed` | the sum of one block, by regions of nodes; terms outside the fixed pattern |
//! | [`exchange`] | sums for other ranks, and theirs |
//! | `levels` | restriction and prolongation |
//! | [`census`] | counts for telemetry |
mod block_sum;
pub mod census;
pub mod exchange;
pub mod fields;
mod levels;
mod mixed;
