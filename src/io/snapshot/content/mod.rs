//! Contents of a file.
//!
//! | file | what it has |
//! |---|---|
//! | `fields.rs` | the particle fields, and how they follow from the state |
//! | `averages.rs` | averages of stress over cells and leaves, principal stresses |
//! | `vtkhdf.rs` | the group `/VTKHDF`, for viewers |
//! | `state.rs` | the group `/state`, for restarts |
pub(crate) mod averages;
pub(crate) mod fields;
pub(in crate::io::snapshot) mod state;
pub(in crate::io::snapshot) mod vtkhdf;
