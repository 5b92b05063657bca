//! From text to a tree of values with their places, checked against the schema; faults with their places.
pub(super) mod error;
pub(super) mod include;
pub(super) mod settings;
pub(super) mod source;
pub(super) mod structure;
mod unclosed;
