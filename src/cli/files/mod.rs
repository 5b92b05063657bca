//! Subcommands that look at output and checkpoint files.
//!
//! | file | what it does |
//! |---|---|
//! | `info.rs` | says what is in a file |
//! | `plot.rs`, `view.rs` | draws particles: as PNG, as a page for a browser |
//! | `report.rs` | writes a run on one page |
//! | `digest.rs`, `diff.rs` | compares states: by a number, in detail |
pub(super) mod diff;
pub(super) mod digest;
pub(super) mod info;
pub(super) mod plot;
pub(super) mod report;
pub(super) mod view;
