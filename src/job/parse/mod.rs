//! From text to a tree of values with their places, checked against the schema; faults with their places.
//!
//! | file | what it holds |
//! |---|---|
//! | `bytes` | the bytes of a job file |
//! | `source`, `unclosed`, `syntax` | the tree of values; brackets and quotes that are not closed; other slips |
//! | `include`, `included` | files that are part of a job, and one of them |
//! | `settings` | values that are set from outside |
//! | `structure` | keys, types and ranges against the schema |
//! | `error` | faults with their places |
pub(super) mod bytes;
pub(super) mod error;
pub(super) mod include;
pub(super) mod included;
pub(super) mod settings;
pub(super) mod source;
pub(super) mod structure;
mod syntax;
mod unclosed;
