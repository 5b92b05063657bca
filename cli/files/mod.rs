//! Subcommands for output and checkpoint files.
//!
//! | file | task |
//! |---|---|
//! | `given.rs` | finds the files that a command line means |
//! | `info.rs` | lists the contents of a file |
//! | `digest.rs`, `diff.rs` | compares states: by a number, in detail |
pub(super) mod diff;
pub(super) mod digest;
#[cfg_attr(not(feature = "post"), expect(dead_code, reason = "the folder `results/` needs the rest"))]
pub(super) mod given;
pub(super) mod info;
