//! Code that several subcommands share.
//!
//! | file | what it holds |
//! |---|---|
//! | `failure` | why the program ends, with its exit code |
//! | `message` | failures in words, once whatever the number of ranks |
//! | `quote` | the lines of a job around a fault |
//! | `settings` | `--set`, `--out` and `--end` |
//! | `summary` | the size and the cost of a job |
//! | `ranks` | one command and one job on all ranks |
pub(super) mod failure;
pub(super) mod message;
mod quote;
pub(super) mod ranks;
pub(super) mod settings;
pub(super) mod summary;
