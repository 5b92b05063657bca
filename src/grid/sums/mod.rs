//! Node fields of a step: sums of arenas, those of other ranks, restriction and prolongation.
//!
//! | file | what it holds |
//! |---|---|
//! | [`node_fields`] | values of all nodes of a rank; sums of its blocks |
//! | `contributions` | what adds to the sum of a block |
//! | `block_sum`, `irregular` | the sum of one block, by regions of nodes; terms outside the fixed pattern |
//! | [`exchange`], [`received`] | sums for other ranks, and theirs |
//! | `restrict_prolong` | restriction and prolongation |
//! | [`volumes`] | volumes of basis functions |
//! | [`statistics`] | counts for telemetry |
mod block_sum;
mod contributions;
pub mod exchange;
mod irregular;
pub mod node_fields;
pub mod received;
mod restrict_prolong;
pub mod statistics;
pub mod volumes;
