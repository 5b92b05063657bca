//! How a file comes to be whole, and is known to be.
//!
//! | file | what it has |
//! |---|---|
//! | `checked.rs` | data sets with checksums |
//! | [`commit`] | from a written file to one on disk under its own name |
//! | `sane.rs` | limits on what a state may hold |
pub(in crate::io) mod checked;
pub mod commit;
pub(in crate::io::snapshot) mod sane;
