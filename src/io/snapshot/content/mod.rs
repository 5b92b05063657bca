//! Contents of a file.
//!
//! | file | what it has |
//! |---|---|
//! | `fields.rs` | the particle fields, and how they follow from the state |
//! | `averages.rs` | averages of stress over cells and leaves, invariants of stress |
//! | `vtkhdf.rs` | the group `/VTKHDF`, for viewers |
//! | `columns.rs` | the data sets with columns of particles |
//! | `state.rs` | the group `/state`, for restarts |
pub mod averages;
pub(in crate::io::snapshot) mod columns;
pub mod fields;
pub(in crate::io::snapshot) mod state;
pub(in crate::io::snapshot) mod vtkhdf;
