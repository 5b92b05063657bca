//! Integrity of files: when one is complete, and how that is checked.
//!
//! | file | content |
//! |---|---|
//! | `checked.rs` | data sets with checksums |
//! | [`commit`] | from a written file to one on disk under its own name |
//! | `sane.rs` | limits on the values of a state |
pub mod checked;
pub mod commit;
pub(in crate::io::snapshot) mod sane;
